"""
Ten published methods on one loop
=================================

The verdict is shown with the votes of ten published methods. A method that is not valid for the
loop is grey.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
record = st.simulate(loop, sp=10.0, duration=3000.0, seed=1, loop_type="flow")
found = st.diagnose(record)
figure, ax = plt.subplots()
for row in found.evidence[::-1]:
    color = "0.75" if not row.valid else "#bc4c00" if row.vote == "stiction" else "#0969da"
    ax.barh(row.method.replace("_", " "), row.index, color=color)
    ax.plot(row.threshold, row.method.replace("_", " "), "|", color="black", markersize=16)
ax.set(
    xlabel="index; the mark is the threshold",
    title=f"{found.verdict}: orange votes for stiction, blue does not",
    xlim=(-1, 2),
)
plt.show()

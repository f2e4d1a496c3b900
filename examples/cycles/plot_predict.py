"""
Predict limit cycles and check by simulation
============================================

The describing function predicts period and amplitude; the exact solution corrects them. The
simulated loop ends in the exact cycle.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
[predicted] = [cycle for cycle in st.predict_limit_cycles(loop) if cycle.stable]
record = st.simulate(loop, sp=10.0, duration=1500.0, op_start=3.0)
figure, ax = plt.subplots()
ax.plot(record.time, record.op, label="simulated OP")
middle = record.op[-600:].mean()
for cycle, name, color in ((predicted, "describing function", "#bc4c00"), (predicted.exact, "exact", "#1a7f37")):
    for sign in (-1, 1):
        label = f"{name}: {cycle.amplitude:.2f} %, {cycle.period:.0f} s" if sign > 0 else None
        ax.axhline(middle + sign * cycle.amplitude, color=color, linestyle="--", label=label)
ax.set(xlabel="time [s]", ylabel="OP [%]", title="Limit cycle of a flow loop")
ax.legend(loc="lower right")
plt.show()

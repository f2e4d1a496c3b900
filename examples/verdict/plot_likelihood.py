"""
Sticky valve against other explanations
=======================================

The identification compares a sticky valve with other explanations of the same record. Every bar is
twice the log likelihood ratio: a positive one favours the sticky valve.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S=4.0, J=1.5), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.2)
record = st.simulate(loop, sp=10.0, duration=3000.0, seed=1, loop_type="flow")
found = st.identify(st.LoopRecord("FIC-101", 1.0, op=record.op, pv=record.pv, sp=record.sp))
ratios = dict(sorted(found.likelihood_ratios.items(), key=lambda item: item[1]))
figure, ax = plt.subplots()
ax.barh([name.replace("_", " ") for name in ratios], ratios.values())
ax.set(xlabel="2 ln(likelihood ratio)", title="Sticky valve against ...")
plt.show()

"""
Every remedy on one loop
========================

Repair, retune, or one of seven compensators: PV deviation against stem travel, which wears the
valve.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
trial = st.compensate(loop, seeds=4)
trial.plot()
plt.show()

# %%

trial

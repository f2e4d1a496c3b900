"""
Diagnose one loop
=================

A flow loop with a sticky valve: the signals, the verdict, and what each feature adds to the log
odds.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
record = st.simulate(
    loop, sp=150.0, duration=1800.0, seed=1, pv_start=148.0, op_start=50.0, loop_type="flow", tag="FIC-101"
)
record.plot()
plt.show()

# %%
# The verdict uses OP, PV and SP. The simulated valve position is removed first, as most plants do not record it.

from dataclasses import replace

found = st.diagnose(replace(record, mv=None))
found

# %%
# A positive contribution makes stiction more likely.

found.plot()
plt.show()

"""
Stiction, tight tuning, outside disturbance
===========================================

Three loops oscillate. The verdict names the cause of each: a sticky valve, a controller gain that
is too high, a load that swings.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

process = st.FOPDT(3.0, 10.0, 10.0)
good, sticky = st.Kano(S=0.3, J=0.1), st.Kano(S=5.0, J=2.0)
time = np.arange(2400.0)
load = 2.0 * np.sin(2 * np.pi * time / 130.0)
runs = {
    "sticky valve": st.simulate(st.Loop(st.PID(0.2, 10.0), sticky, process, dt=1.0, noise=0.1), 10.0, 2400.0, seed=1),
    "gain too high": st.simulate(st.Loop(st.PID(0.54, 17.0), good, process, dt=1.0, noise=0.3), 10.0, 2400.0, seed=2),
    "outside load": st.simulate(
        st.Loop(st.PID(0.15, 12.0), good, process, dt=1.0, noise=0.1), 10.0, 2400.0, seed=3, disturbance=load
    ),
}
figure, axes = plt.subplots(len(runs), 2, figsize=(10, 7), sharex="col")
for (left, right), (name, record) in zip(axes, runs.items(), strict=True):
    found = st.diagnose(record)
    left.plot(record.time, record.pv, color="#1a7f37")
    left.set_title(f"{name}: {found.verdict}, probability {found.probability:.2f}", fontsize=10, loc="left")
    causes = ("valve", "tuning", "external", "sensor", "dead_zone")
    right.barh(causes, [getattr(found.oscillation_cause, cause) for cause in causes])
    right.set_xlim(0, 1)
axes[-1][0].set_xlabel("time [s]")
axes[-1][1].set_xlabel("score of the cause")
plt.show()

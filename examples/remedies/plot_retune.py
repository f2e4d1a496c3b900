"""
Retuning: slower, not smaller
=============================

A slower controller makes the limit cycle slower. The slip jump decides its size, and retuning
cannot remove it.
"""

import matplotlib.pyplot as plt

import stiction as st

figure, axes = plt.subplots(3, 1, figsize=(8, 6.5), sharex=True, sharey=True)
for ax, Ti in zip(axes, (10.0, 20.0, 40.0), strict=True):
    loop = st.Loop(st.PID(Kc=0.2, Ti=Ti), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = st.simulate(loop, sp=10.0, duration=3000.0, op_start=3.0)
    ax.plot(record.time, record.pv, color="#1a7f37")
    ax.set(title=f"Ti = {Ti:g} s", ylabel="PV")
axes[-1].set_xlabel("time [s]")
plt.show()

"""
All valve models on one signal
==============================

The same OP drives every data-driven model with the same band. They agree when OP moves in held
steps and differ on a ramp.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

valves = {
    "Stenman": st.Stenman(d=2.0),
    "Kano": st.Kano(S=3.0, J=1.0),
    "Choudhury": st.Choudhury(S=3.0, J=1.0),
    "He": st.He(fs=2.0, fd=1.0),
    "Srinivasan": st.Srinivasan(sb=2.0, sj=1.0, r=0.05),
}
ramp = np.concatenate([np.linspace(45.0, 55.0, 251), np.linspace(55.0, 45.0, 251)])
figure, axes = plt.subplots(len(valves), 1, figsize=(7, 8), sharex=True, sharey=True)
for ax, (name, valve) in zip(axes, valves.items(), strict=True):
    ax.plot(ramp, color="0.7")
    ax.plot(st.stroke(valve, ramp, dt=1.0).mv)
    ax.set_title(name, loc="left", fontsize=10)
axes[2].set_ylabel("OP (grey) and valve position [% of span]")
axes[-1].set_xlabel("time [s]")
plt.show()

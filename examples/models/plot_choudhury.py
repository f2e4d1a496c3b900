"""
Choudhury: undershoot, no offset, overshoot
===========================================

The ratio of slip jump J to stiction band S decides how the stem meets OP: for J below S it stays
behind, for J = S it arrives exactly, for J above S it overshoots.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

time = np.arange(0.0, 600.0)
op = 50.0 + 6.0 * np.sin(2 * np.pi * time / 300.0)
figure, axes = plt.subplots(1, 3, figsize=(10, 3.4), sharey=True)
for ax, J in zip(axes, (1.5, 3.0, 4.5), strict=True):
    stem = st.stroke(st.Choudhury(S=3.0, J=J), op, dt=1.0).mv
    ax.plot(op[300:], op[300:], color="0.7", linestyle="--")
    ax.plot(op[300:], stem[300:])
    ax.set(xlabel="OP [%]", title=f"S = 3 %, J = {J:g} %")
axes[0].set_ylabel("valve position [%]")
plt.show()

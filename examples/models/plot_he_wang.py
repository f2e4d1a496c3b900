"""
He and Wang: a slip that overshoots
===================================

In the semi-physical model a slip carries the stem K times as far as the balance of forces. K = 1 is
He's model.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

time = np.arange(0.0, 400.0)
op = 50.0 + 5.0 * np.sin(2 * np.pi * time / 200.0)
figure, ax = plt.subplots()
ax.plot(time, op, color="0.6", linestyle="--", label="OP")
for K in (1.0, 1.5, 2.0):
    ax.plot(time, st.stroke(st.HeWang(fs=2.5, fd=1.0, K=K), op, dt=1.0).mv, label=f"K = {K:g}")
ax.set(xlabel="time [s]", ylabel="valve position [%]", title="He and Wang's valve")
ax.legend()
plt.show()

"""
He: a valve that stops at every sample
======================================

He's valve stops after each sample and must break away again. It therefore depends on the sampling
period: sampled faster, the same ramp gives more and smaller stairs.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

valve = st.He(fs=2.0, fd=1.0)
figure, ax = plt.subplots()
for dt in (1.0, 5.0, 20.0):
    time = np.arange(0.0, 200.0, dt)
    record = st.stroke(valve, 40.0 + 0.1 * time, dt=dt)
    ax.step(time, record.mv, where="post", label=f"sampled every {dt:g} s")
ax.plot(time, 40.0 + 0.1 * time, color="0.6", linestyle="--", label="OP")
ax.set(xlabel="time [s]", ylabel="valve position [%]", title="He's valve, fs = 2 %, fd = 1 %")
ax.legend()
plt.show()

"""
Srinivasan: stairs below a rate, following above
================================================

Ramp tests of real valves show both: on a slow ramp the stem climbs in stairs, on a fast one it
follows after the first jump. The three-parameter model has a rate r that separates the two.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

valve = st.Srinivasan(sb=2.0, sj=1.0, r=0.05)
figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True)
for ax, rate in zip(axes, (0.02, 0.2), strict=True):
    time = np.arange(0.0, 10.0 / rate)
    record = st.stroke(valve, 40.0 + rate * time, dt=1.0)
    ax.plot(time, record.op, color="0.6", linestyle="--", label="OP")
    ax.plot(time, record.mv, label="valve position")
    ax.set(xlabel="time [s]", title=f"ramp of {rate:g} %/s, r = 0.05 %/s")
axes[0].set_ylabel("[% of span]")
axes[0].legend()
plt.show()

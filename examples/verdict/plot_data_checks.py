"""
Data checks: what a historian does to a record
==============================================

Each check of ``st.quality`` marks samples or returns a number. Here a record is compressed by
straight lines, its PV is rounded, and OP reaches its limit.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

rng = np.random.default_rng(1)
time = np.arange(1200.0)
op = 92.0 + 10.0 * np.sin(time / 40.0) + rng.normal(0.0, 0.1, time.size)
op = np.clip(op, 0.0, 100.0)
pv = 200 + 9 * np.cos(time / 40.0) + rng.normal(0, 0.5, time.size)
knots = time[::12]

figure, axes = plt.subplots(3, 1, figsize=(8, 7), sharex=True)
at_limit = st.quality.find_saturation(op)
axes[0].plot(time, op)
axes[0].fill_between(time, 80, 102, where=at_limit, alpha=0.3, color="#bc4c00")
axes[0].set(ylabel="OP [%]", title=f"saturation: {at_limit.sum()} samples at a limit")
stored_pv, stored_op = (np.interp(time, knots, signal[::12]) for signal in (pv, op))
lines = st.quality.count_interpolated(stored_op, stored_pv)
axes[1].plot(time, pv, color="0.8")
axes[1].plot(time, stored_pv)
axes[1].set(ylabel="PV", title=f"compression: {lines} samples on straight lines")
coarse = np.round(pv / 3.0) * 3.0
axes[2].plot(time, coarse)
step = st.quality.quantisation_step(coarse)
axes[2].set(ylabel="PV", xlabel="time [s]", title=f"resolution: PV moves in steps of {step:g}")
plt.show()

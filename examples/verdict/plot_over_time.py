"""
A fault that grows, and a repair
================================

Twelve days of one flow loop, half an hour of each. The packing is tightened bit by bit, S grows from 1.5 to 5 %, and on
the ninth day the valve is overhauled. Each day is judged by itself, and all are pooled: the probability is that of the
valve since the repair.
"""

from dataclasses import replace
from datetime import datetime, timedelta

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

sizes = [*np.linspace(1.5, 5.0, 8), *[0.1] * 4]
records = []
for day, S in enumerate(sizes):
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S, 0.4 * S), st.FOPDT(2.0, 10.0, 8.0), dt=1.0, noise=0.05)
    load = np.repeat(np.random.default_rng(day).uniform(-2.0, 2.0, 10), 200)
    record = st.simulate(loop, sp=10.0, duration=2000.0, disturbance=load, seed=day, loop_type="flow")
    start = datetime(2026, 3, 1) + timedelta(days=day)
    records.append(replace(record, mv=None, tag="FIC-101", start=start))

found = st.diagnose(records)
print(found.reason)

days = np.arange(len(sizes)) + 1
S = np.array([window.S for window in found.windows])
low, high = (np.array([getattr(window, name) for window in found.windows]) for name in ("S_low", "S_high"))
figure, (upper, lower) = plt.subplots(2, 1, figsize=(8, 5), sharex=True)
upper.bar(days, [window.probability for window in found.windows], color="#1f6feb")
upper.set(ylim=(0, 1), ylabel="probability of the day")
upper.set_title(f"Since the last change: {found.verdict}, probability {found.probability:.2f}", fontsize=10, loc="left")
lower.errorbar(days, S, (S - low, high - S), fmt="o", color="#22272e")
lower.plot(days, sizes, color="#1a7f37", label="true S")
lower.set(xlabel="day", ylabel="S [% of span]", ylim=(0, 8))
lower.legend()
for change in found.history:
    for axis in (upper, lower):
        axis.axvline(change.first + 0.5, color="#5a6270", linestyle="--")
plt.show()

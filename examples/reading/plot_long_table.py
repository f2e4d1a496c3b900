"""
One row for each tag and time
=============================

Historians often export a long table: tag, time, value, quality, each tag with its own time stamps.
The signals are put on one clock; values with bad quality are missing.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import stiction as st

rng = np.random.default_rng(2)
start = pd.Timestamp("2026-03-02 06:00")
parts = []
for tag, offset, level in (("FIC-101.PV", 0.2, 50.0), ("FIC-101.OP", 0.7, 40.0), ("FIC-101.SP", 0.0, 50.0)):
    seconds = np.arange(0.0, 1800.0, 5.0) + offset
    values = level + (0 if tag.endswith("SP") else 3) * np.sin(seconds / 40 + level) + rng.normal(0, 0.05, seconds.size)
    quality = np.where((tag.endswith("PV")) & (seconds > 600) & (seconds < 660), "Bad", "Good")
    stamps = start + pd.to_timedelta(seconds, unit="s")
    parts.append(pd.DataFrame({"tag": tag, "time": stamps, "value": values, "quality": quality}))
table = pd.concat(parts).sort_values("time")
print(table.head())

[record] = st.read(table)
record.plot()
plt.show()

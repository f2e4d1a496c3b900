"""
Excel, Parquet, MATLAB, zip
===========================

The same two loops in four formats. ``st.read`` recognises the format by the content of the file.
"""

import tempfile
import zipfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import polars as pl
import scipy.io

import stiction as st

time = np.arange(1200.0)
frame = pl.DataFrame(
    {
        "Time": time,
        "FIC-101.PV": 50 + 4 * np.sign(np.sin(time / 30)),
        "FIC-101.OP": 40 + 3 * np.abs((time / 60) % 2 - 1),
        "LIC-102.PV": 60 + 2 * np.sin(time / 90),
        "LIC-102.OP": 55 + 5 * np.cos(time / 90),
    }
)
found = {}
with tempfile.TemporaryDirectory() as folder:
    files = {kind: Path(folder) / f"plant.{kind}" for kind in ("csv", "xlsx", "parquet", "mat", "zip")}
    frame.write_csv(files["csv"])
    frame.write_excel(files["xlsx"])
    frame.write_parquet(files["parquet"])
    arrays = {name.replace("-", "_").replace(".", "_"): frame[name].to_numpy() for name in frame.columns}
    scipy.io.savemat(files["mat"], arrays)
    with zipfile.ZipFile(files["zip"], "w") as packed:
        packed.write(files["csv"], "plant.csv")
    for kind, file in files.items():
        found[kind] = st.read(file)
        print(kind, [(record.tag, len(record), record.dt) for record in found[kind]])

figure, axes = plt.subplots(2, 2, figsize=(10, 5), sharex=True)
for column, record in zip(axes.T, found["parquet"], strict=True):
    record.plot(column)
plt.show()

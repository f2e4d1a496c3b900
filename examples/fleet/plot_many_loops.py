"""
A table of many loops
=====================

Read a folder, diagnose each loop, and rank by probability.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

import stiction as st

process = st.FOPDT(3.0, 10.0, 10.0)
with tempfile.TemporaryDirectory() as folder:
    for k, S in enumerate((0.2, 0.8, 2.0, 4.0, 6.0)):
        loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S=S, J=0.4 * S), process, dt=1.0, noise=0.3)
        run = st.simulate(loop, sp=10.0, duration=1800.0, seed=k, pv_start=9.0, op_start=3.0)
        record = st.LoopRecord(f"FIC-10{k}", 1.0, op=run.op, pv=run.pv, sp=run.sp, loop_type="flow")
        record.to_parquet(Path(folder) / f"FIC-10{k}.parquet")
    found = [st.diagnose(record) for record in st.read(folder)]

table = pd.DataFrame({"tag": one.record.tag, "verdict": one.verdict, "probability": one.probability} for one in found)
print(table.sort_values("probability", ascending=False))

figure, ax = plt.subplots()
colors = {"stiction": "#bc4c00", "no_stiction": "#1a7f37", "undecided": "0.6"}
ax.barh(table["tag"], table["probability"], color=[colors[verdict] for verdict in table["verdict"]])
ax.set(xlim=(0, 1), xlabel="probability of stiction", title="true S: 0.2, 0.8, 2, 4, 6 % from the bottom up")
plt.show()

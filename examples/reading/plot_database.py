"""
Read from a database
====================

Any database that SQLAlchemy can reach, here SQLite with a table of tag, time and value.
"""

import sqlite3
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "plant.db"
    with sqlite3.connect(file) as database:
        database.execute("create table trend (ts text, tag text, value real)")
        for k in range(1200):
            stamp = f"2026-03-02 06:{k // 60:02d}:{k % 60:02d}"
            for tag, value in (("PIC-3.PV", 5 + np.sin(k / 25)), ("PIC-3.OP", 50 + 4 * np.cos(k / 25))):
                database.execute("insert into trend values (?, ?, ?)", (stamp, tag, float(value)))
    database.close()
    [record] = st.read(f"sqlite:///{file}", table="trend", time="ts", tag_column="tag", value="value")

record.plot()
plt.show()

"""
A CSV file with semicolons, decimal commas and bad values
=========================================================

Exports from plants differ in separator, decimal mark, time format and status texts. All are found
from the file. What was assumed is listed.
"""

import tempfile
from datetime import datetime, timedelta
from pathlib import Path

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=5.0, noise=0.1)
plant = st.simulate(loop, sp=50.0, duration=6000.0, seed=1, pv_start=49.0, op_start=17.0)
lines = ["Zeit;FIC-101 Istwert;FIC-101 Sollwert;FIC-101 Stellgrad [%]"]
for k in range(len(plant)):
    stamp = (datetime(2026, 3, 2, 6) + timedelta(seconds=5 * k)).strftime("%d.%m.%Y %H:%M:%S")
    values = [f"{signal[k]:.3f}".replace(".", ",") for signal in (plant.pv, plant.sp, plant.op)]
    if 300 < k < 320:
        values[0] = "Bad"
    lines.append(";".join([stamp, *values]))

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "export.csv"
    file.write_text("\n".join(lines), encoding="latin-1")
    [record] = st.read(file)
print(record.tag, record.dt, record.start, record.provenance.assumptions)

record.plot()
plt.show()

"""
An FMU in fmpy, beside the same valve in Python
===============================================

Kano's valve is written as an FMU for co-simulation and stepped by fmpy, sample by sample. Its positions are those of
`st.stroke`. The FMU takes one sample in each step of its own sampling period, so an importer that reads the output
after the step of sample k gets position k.
"""

import tempfile
from pathlib import Path

import fmpy
import matplotlib.pyplot as plt
import numpy as np
from fmpy.fmi2 import FMU2Slave

import stiction as st

DT = 1.0
valve = st.Kano(S=5.0, J=2.0)
time = np.arange(0.0, 400.0, DT)
op = 50.0 + 8.0 * np.sin(2 * np.pi * time / 200.0)

folder = Path(tempfile.mkdtemp())
written = st.export_fmu(valve, folder / "kano.fmu", dt=DT)
print(written.summary())

# %%
# Step it
# -------
# The reference of a variable stands in the description. `S` and `J` are parameters and could be set before
# `exitInitializationMode`.
description = fmpy.read_model_description(str(folder / "kano.fmu"))
reference = {one.name: one.valueReference for one in description.modelVariables}
fmu = FMU2Slave(
    guid=description.guid,
    unzipDirectory=fmpy.extract(str(folder / "kano.fmu")),
    modelIdentifier=description.coSimulation.modelIdentifier,
    instanceName="valve",
)
fmu.instantiate()
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.setReal([reference["op"]], [op[0]])
fmu.exitInitializationMode()
position = []
for t, u in zip(time, op, strict=True):
    fmu.setReal([reference["op"]], [u])
    fmu.doStep(t, DT)
    position += fmu.getReal([reference["position"]])
fmu.terminate()
fmu.freeInstance()

expected = st.stroke(valve, op, DT).mv
print("largest difference:", np.abs(np.array(position) - expected).max())
assert np.abs(np.array(position) - expected).max() < 1e-12

plt.figure(figsize=(8, 3.4))
plt.plot(time, op, color="0.7", label="OP")
plt.plot(time, expected, label="st.stroke")
plt.plot(time[::8], position[::8], ".", label="FMU in fmpy")
plt.xlabel("time [s]")
plt.ylabel("valve position [%]")
plt.legend()
plt.show()

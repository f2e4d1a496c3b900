"""
The twin of a recorded loop, exported and rerun
===============================================

A recorded loop is diagnosed, and the loop as identified is written as an FMU: valve, process and controller. The FMU
runs on its own, here in fmpy, and oscillates like the record. S and J are parameters whose ranges are the intervals
of the diagnosis.
"""

import tempfile
from pathlib import Path

import fmpy
import matplotlib.pyplot as plt
import numpy as np
from fmpy.fmi2 import FMU2Slave

import stiction as st

truth = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
record = st.simulate(truth, sp=10.0, duration=2000.0, seed=1, tag="FIC-101")
diagnosis = st.diagnose(record)
path = Path(tempfile.mkdtemp()) / "twin.fmu"
print(st.export_fmu(diagnosis, path).summary())

description = fmpy.read_model_description(str(path))
for one in description.modelVariables:
    if one.name in ("valve_S", "valve_J"):
        print(f"{one.name} = {float(one.start):.2f} ({float(one.min):.2f} to {float(one.max):.2f})")

# %%
# Run it
# ------
known = {one.name: one for one in description.modelVariables}
dt = float(known["dt"].start)
fmu = FMU2Slave(
    guid=description.guid,
    unzipDirectory=fmpy.extract(str(path)),
    modelIdentifier=description.coSimulation.modelIdentifier,
    instanceName="twin",
)
fmu.instantiate()
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.setReal([known["position_offset"].valueReference], [-2.0])
fmu.exitInitializationMode()
outputs = [known[name].valueReference for name in ("pv", "op")]
rows = []
for k in range(round(2000.0 / dt)):
    fmu.doStep(k * dt, dt)
    rows.append(fmu.getReal(outputs))
fmu.terminate()
fmu.freeInstance()
twin = np.array(rows)

per_sample = round(record.dt / dt)
op = twin[::per_sample, 1]
print(f"OP swing: record {np.ptp(record.op[1000:]):.2f} %, twin {np.ptp(op[1000:]):.2f} %")
assert 0.6 < np.ptp(op[1000:]) / np.ptp(record.op[1000:]) < 1.6

plt.figure(figsize=(8, 3.4))
plt.plot(record.time[1600:], record.op[1600:], label="record")
plt.plot(record.time[1600:], op[1600:2000], label="twin (FMU)")
plt.xlabel("time [s]")
plt.ylabel("OP [%]")
plt.legend()
plt.show()

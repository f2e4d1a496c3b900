"""
A sticky valve in python-control
================================

`control.interconnect` joins systems by the names of their signals. The valve is a discrete nonlinear system whose
states are the fields of the valve's state; its rule is the kernel of the package, so the loop is that of `st.simulate`.
"""
# ruff: noqa: ARG001 - python-control calls every system with t and params

import control
import matplotlib.pyplot as plt
import numpy as np

import stiction as st
from stiction.models.component import ValveState
from stiction.models.dispatch import stem_position, valve_at_rest, valve_step

DT, SP = 1.0, 10.0
loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=3.0, J=1.0), st.FOPDT(K=3.0, tau=10.0, dead_time=2.0), dt=DT)
code, packed = loop.valve.code, loop.valve.pack(DT)


def next_state(t, x, u, params):
    return np.array(valve_step(code, float(u[0]), ValveState(*x.tolist()), packed))


def position(t, x, u, params):
    return stem_position(valve_step(code, float(u[0]), ValveState(*x.tolist()), packed), packed)


valve = control.nlsys(
    next_state, position, inputs=["op"], outputs=["mv"], states=list(ValveState._fields), dt=DT, name="valve"
)

# %%
# Controller and process
# ----------------------
# The controller adds the error of the sample to its integral before it computes the OP. The process holds its input
# between the samples; two samples of dead time are two more states.
Ki = loop.controller.Ki * DT
controller = control.ss([[1.0]], [[Ki]], [[1.0]], [[0.2 + Ki]], DT, inputs=["e"], outputs=["op"], name="controller")
discrete = loop.discrete
A = np.array([[discrete.A[0, 0], 0.0, discrete.b_new[0]], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
process = control.ss(A, [[0.0], [1.0], [0.0]], [[discrete.c[0], 0.0, 0.0]], [[0.0]], DT, inputs=["mv"], outputs=["pv"],
                     name="process")  # fmt: skip
error = control.summing_junction(["sp", "-pv"], "e", name="error")
closed = control.interconnect([controller, valve, process, error], inputs=["sp"], outputs=["pv", "op", "mv"])

# %%
# The limit cycle, beside `st.simulate`
# -------------------------------------
time = np.arange(0.0, 300.0, DT)
start = np.concatenate([[0.0], np.array(valve_at_rest(code, 0.0, 0.0, packed)), np.zeros(3)])
response = control.input_output_response(closed, time, np.full(time.size, SP), start)
record = st.simulate(loop, sp=SP, duration=time.size * DT)
print("largest difference of the PV:", np.abs(response.outputs[0] - record.pv).max())
assert np.abs(response.outputs[0] - record.pv).max() < 1e-6

plt.figure(figsize=(8, 3.4))
plt.plot(time, record.pv, label="st.simulate")
plt.plot(time[::5], response.outputs[0][::5], ".", label="python-control")
plt.xlabel("time [s]")
plt.ylabel("PV")
plt.legend()
plt.show()

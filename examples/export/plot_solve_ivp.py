"""
A nonlinear tank around a sticky valve, by SciPy
================================================

The plant is a differential equation that `scipy.integrate.solve_ivp` integrates from sample to sample: a tank whose
outflow grows with the root of its level. At each sample the controller computes the OP, and the valve's kernel moves
the stem, which then stands still until the next sample, as with a DCS.
"""
# ruff: noqa: ARG001 - solve_ivp gives the time

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import stiction as st
from stiction.models.dispatch import stem_position, valve_at_rest, valve_step

DT = 2.0
AREA, INFLOW, OUTFLOW = 10.0, 0.04, 0.2
"""Cross section [m2], inflow per % of valve position [m3/s per %], outflow per root of level [m3/s per m^0.5]."""


def level_rate(t, level, position):
    return (INFLOW * position - OUTFLOW * np.sqrt(max(level[0], 0.0)) * 10.0) / AREA


def run(valve, samples=800, sp=1.2):
    """Level [m], OP and valve position [%]."""
    code, packed = valve.code, valve.pack(DT)
    op = position = 50.0
    state = valve_at_rest(code, op, position, packed)
    level, integral, rows = 1.0, op, []
    for k in range(samples):
        error = sp - level
        integral += 25.0 * DT / 120.0 * error
        op = 25.0 * error + integral
        state = valve_step(code, op, state, packed)
        position = stem_position(state, packed)
        rows.append((level, op, position))
        level = solve_ivp(level_rate, (k * DT, (k + 1) * DT), [level], args=(position,)).y[0, -1]
    return np.array(rows)


good, sticky = run(st.Ideal()), run(st.Srinivasan(sb=3.0, sj=1.5, r=0.05))
spread = [result[400:, 0].std() for result in (good, sticky)]
print(f"standard deviation of the level at the end: good {spread[0]:.4f} m, sticky {spread[1]:.4f} m")
assert spread[0] < 0.2 * spread[1]

time = np.arange(len(good)) * DT
figure, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True)
axes[0].plot(time, good[:, 0], color="0.7", label="no friction")
axes[0].plot(time, sticky[:, 0], label="sticky")
axes[0].set_ylabel("level [m]")
axes[0].legend()
axes[1].plot(time, sticky[:, 1], label="OP")
axes[1].plot(time, sticky[:, 2], label="valve position")
axes[1].set(xlabel="time [s]", ylabel="[%]")
axes[1].legend()
plt.show()

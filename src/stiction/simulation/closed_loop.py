"""Simulation of a control loop."""

from __future__ import annotations

from reprlib import repr as brief
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, as_floats, require_finite, require_positive, require_samples, require_seed
from stiction.models.dispatch import NO_COMPENSATOR, is_data_driven
from stiction.models.loop import require_loop
from stiction.records.record import LoopRecord, Provenance
from stiction.simulation.drivers import closed_loop, fast_closed_loop

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from stiction.models import Loop

__all__ = ["simulate"]

_NO_LOAD = np.zeros(1)
_AUTOMATIC = np.full(1, np.nan)


def simulate(
    loop: Loop,
    sp: ArrayLike,
    duration: float,
    disturbance: ArrayLike | None = None,
    seed: int | None = None,
    *,
    pv_disturbance: ArrayLike | None = None,
    manual: ArrayLike | None = None,
    pv_start: float = 0.0,
    op_start: float = 0.0,
    mv_start: float | None = None,
    tag: str = "simulated",
    loop_type: str = "other",
) -> LoopRecord:
    """Simulate a control loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    sp : float or array_like, shape (n_samples,)
        Set point [PV units].
    duration : float
        Length of the simulation [s]; n_samples = round(duration / dt).
    disturbance : float or array_like, shape (n_samples,), optional
        Load, added to the valve position at the process inlet [% of span].
    seed : int, optional
        Seed of the measurement noise, 0 or more [-]; without it every run has different noise.
    pv_disturbance : float or array_like, shape (n_samples,), optional
        Added to the process output [PV units].
    manual : float or array_like, shape (n_samples,), optional
        OP in manual [% of span]; NaN in automatic. Changes are bumpless.
    pv_start, op_start : float
        Operating point of the loop at rest before the first sample [PV units, % of span]: the PV is `pv_start`
        when the stem is at the position for `op_start`.
    mv_start : float, optional
        Stem position before the first sample [% of span]; by default `op_start`.
    tag, loop_type : str
        Name and type of the record.

    Returns
    -------
    LoopRecord
        `op`, `pv`, `sp` and the valve position `mv`; with a compensator also `valve_signal`, the signal to the
        valve within the output limits of the controller.

    Raises
    ------
    ParameterError
        When the length of a series differs from that of the simulation, a series is not numeric, or `seed` is not
        a whole number of 0 or more.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0)
    >>> round(float(record.op[-400:].max() - record.op[-400:].min()), 1)
    3.5
    """
    require_loop(loop)
    duration = require_positive("duration", duration, "s")
    require_samples("duration", duration, loop.dt)
    n = round(duration / loop.dt)
    if n < 1:
        raise ParameterError(f"duration = {duration:g} s is shorter than one sample of {loop.dt:g} s; make it longer.")
    seed, set_point = require_seed(seed), _series("sp", sp, n)
    load = _NO_LOAD if disturbance is None else _series("disturbance", disturbance, n)
    pv_load = _NO_LOAD if pv_disturbance is None else _series("pv_disturbance", pv_disturbance, n)
    if loop.noise > 0.0:
        pv_load = pv_load + np.random.default_rng(seed).normal(0.0, loop.noise, n)
    manual_op = _AUTOMATIC if manual is None else _series("manual", manual, n, gaps=True)
    start = np.array(
        [
            require_finite("pv_start", pv_start, "PV units"),
            require_finite("op_start", op_start, "% of span"),
            require_finite("mv_start", op_start if mv_start is None else mv_start, "% of span"),
        ]
    )
    compensator = loop.compensator
    # One large array: the operating system gives its memory pages in groups, those of small arrays one by one.
    pv, op, mv, recorded_sp, *valve_signal = np.empty((4 if compensator is None else 5, n))
    recorded_sp[:] = set_point
    controller, valve, packed = loop.controller.pack(loop.dt), loop.valve.code, loop.valve.pack(loop.dt)
    if compensator is None and is_data_driven(valve):
        fast_closed_loop(
            controller, valve, packed, *loop.discrete, set_point, load, pv_load, manual_op, start, pv, op, mv
        )  # fmt: skip
    else:
        kind, settings = NO_COMPENSATOR, _NO_LOAD
        if compensator is not None:
            kind, settings = compensator.code, compensator.pack(loop.dt)
        closed_loop(
            controller, kind, settings, valve, packed, *loop.discrete,
            set_point, load, pv_load, manual_op, start, pv, op, valve_signal[0] if valve_signal else _NO_LOAD, mv,
        )  # fmt: skip
    return LoopRecord(
        tag,
        loop.dt,
        op=op,
        pv=pv,
        sp=recorded_sp,
        mv=mv,
        valve_signal=valve_signal[0] if valve_signal else None,
        auto=None if manual is None else np.broadcast_to(np.isnan(manual_op), n).copy(),
        loop_type=loop_type,
        provenance=Provenance(source="simulation", rows=n),
    )


def _series(name: str, value: ArrayLike, n: int, *, gaps: bool = False) -> NDArray[np.float64]:
    """One value for all samples, shape (1,), or one per sample, shape (n,)."""
    try:
        series = np.atleast_1d(np.ascontiguousarray(as_floats(value)))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be a number or a series of numbers, got {brief(value)}.") from None
    if series.ndim != 1 or series.size not in (1, n):
        raise ParameterError(f"{name} has shape {series.shape}; give one number or {n} (one per sample).")
    if np.isinf(series).any() or (np.isnan(series).any() and not gaps):
        raise ParameterError(f"{name} has entries that are not finite; give finite numbers.")
    return series

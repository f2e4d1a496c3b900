"""The valve position as a positioner reports it: the stem behind a lag, in some unit, coarse and noisy, or no stem.

What a historian calls the valve's position is not always one: some positioners give back their set point (`echo`), some
transmitters hang (`frozen`), and some tags belong to the valve next door (`another`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.loads import lagged_noise, wave

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["POSITIONS", "report_position"]

POSITIONS = {"stem": 0.8, "echo": 0.1, "frozen": 0.05, "another": 0.05}
"""What is recorded as the position, and how often."""
UNITS = {(1.0, 0.0): 0.6, (0.16, 4.0): 0.2, (0.01, 0.0): 0.1, (-1.0, 100.0): 0.1}
"""Slope and offset from % of span to the unit recorded (%, mA, a share, % closed), and how often they come."""
NOISE = (0.005, 0.5)
"""Standard deviation of the noise [% of span]."""
RESOLUTION = (0.01, 1.0)
"""Resolution of three in four of the positions [% of span]."""
LAG = 0.03
"""Longest lag of three in four of the positions, as a share of the period [-]."""
LATE = 2
"""Latest samples reported [samples of the controller]."""


def report_position(
    record: LoopRecord, period: float, rng: np.random.Generator, kind: str | None = None
) -> tuple[LoopRecord, str]:
    """Report a stem position as plants do.

    Parameters
    ----------
    record : LoopRecord
        A record with the true stem position `mv` [% of span].
    period : float
        Period of the oscillation, or another time scale [samples].
    rng : numpy.random.Generator
        Where chance comes from.
    kind : str, optional
        One of `POSITIONS`; drawn by default.

    Returns
    -------
    LoopRecord
        The record with `mv` as reported, in some unit.
    str
        What it is, one of `POSITIONS`.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> moved = st.stroke(st.Kano(2.0, 1.0), 50.0 + 3.0 * np.sin(np.arange(500.0) / 20.0), dt=1.0)
    >>> record, kind = report_position(moved, 126.0, np.random.default_rng(0), "frozen")
    >>> kind, float(np.ptp(record.mv))
    ('frozen', 0.0)
    """
    assert record.mv is not None
    kind = str(rng.choice(list(POSITIONS), p=list(POSITIONS.values()))) if kind is None else kind
    n, calm = len(record), kind in ("echo", "frozen")
    if kind == "frozen":
        x = np.full(n, record.mv[0])
    elif kind == "echo":
        x = record.op.copy()
    elif kind == "another":
        x = 50.0 + float(rng.uniform(1.0, 10.0)) * _elsewhere(rng, n, period)
    else:
        x = record.mv.copy()
    if not calm:
        noise = float(np.exp(rng.uniform(*np.log(NOISE))))
        lag = LAG * period * float(rng.random()) if rng.random() < 0.75 else 0.0
        x = _behind(x, lag) + noise * rng.normal(size=n)
        x = x * float(rng.normal(1.0, 0.01)) + float(rng.normal(0.0, 1.0))
    late = int(rng.integers(LATE + 1)) if rng.random() < 0.3 else 0
    x = np.concatenate([np.full(late, x[0]), x[: n - late]])
    if rng.random() < 0.75:
        step = float(np.exp(rng.uniform(*np.log(RESOLUTION))))
        x = step * np.round(x / step)
    slope, offset = list(UNITS)[int(rng.choice(len(UNITS), p=list(UNITS.values())))]
    return replace(record, mv=slope * x + offset), kind


def _elsewhere(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    """The valve of another loop, which moves at a pace of its own, shape (n,)."""
    if rng.random() < 0.5:
        return wave(rng, "triangle", n, period * float(rng.choice([rng.uniform(0.3, 0.8), rng.uniform(1.25, 4.0)])))
    return lagged_noise(rng, n, period * float(rng.uniform(0.1, 1.0)))


def _behind(x: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """A series behind a first-order lag of `lag` samples, at rest before the first."""
    if lag <= 0.0:
        return x
    from scipy.signal import lfilter

    keep = float(np.exp(-1.0 / lag))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0], dtype=np.float64)

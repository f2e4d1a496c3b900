"""Plan of a ramp test: rates around an expected threshold, up and down, with rests between."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_count, require_not_negative, require_positive, require_samples
from stiction.simulation.valve_test_plan import TestPlan, require_range_in_span

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["plan_ramp_test"]

RATE_MULTIPLES = (4.0, 1.25, 0.8, 0.5)
"""Tested rates over the expected threshold [-], the fast rates first."""


def plan_ramp_test(
    low: float,
    high: float,
    *,
    threshold: float | None = None,
    rates: float | Sequence[float] | None = None,
    wait: float = 60.0,
    dt: float = 1.0,
    start: float | None = None,
    S: float | None = None,
    repeats: int = 1,
) -> TestPlan:
    """Plan OP ramps from `low` to `high` and back at several rates.

    Parameters
    ----------
    low, high : float
        Range of the OP [% of span], within 0 and 100.
    threshold : float, optional
        Expected rate r below which the valve moves in stairs [% of span / s]; the rates are chosen around it.
    rates : float or sequence of float, optional
        Rates to test instead [% of span / s].
    wait : float
        Rest before, between and after the ramps [s].
    dt : float
        Sampling period [s].
    start : float, optional
        OP before the test [% of span]; by default `low`.
    S : float, optional
        Expected deadband plus stickband [% of span]; the range must exceed twice this, or the stem hardly slips.
    repeats : int
        Number of tests up and down at each rate [-].

    Returns
    -------
    TestPlan
        The OP over time, duration and upset, with `to_csv` and `summary`.

    Raises
    ------
    ParameterError
        When the range, a rate or a time is outside its limits, neither or both of `threshold` and `rates` are given, or
        the range is too small for `S`.

    References
    ----------
    srinivasan2008, section III: four ramps from 5 to 15 % at 0.0667, 0.0167, 0.0125 and 0.01 %/s.

    Examples
    --------
    >>> import stiction as st
    >>> plan = st.plan_ramp_test(5.0, 15.0, rates=[0.0667, 0.0167, 0.0125, 0.01])
    >>> print(plan.summary().splitlines()[0])
    Ramp test: 94 min in manual, OP from 5 to 15 %, at most 10 % from its start at 5 %.
    """
    low, high = require_range_in_span(low, high)
    if (threshold is None) == (rates is None):
        raise ParameterError("Give either threshold (the expected r) or rates [% of span / s], not both.")
    if threshold is not None:
        rates = [factor * require_positive("threshold", threshold, "% of span / s") for factor in RATE_MULTIPLES]
    assert rates is not None
    speeds = [require_positive("rate", rate, "% of span / s") for rate in np.atleast_1d(rates).tolist()]
    dt, wait = require_positive("dt", dt, "s"), require_not_negative("wait", wait, "s")
    repeats = require_count("repeats", repeats)
    begin = low if start is None else require_not_negative("start", start, "% of span")
    if begin > 100.0:
        raise ParameterError(f"start = {begin:g} % is outside the span; give 0 to 100.")
    if not speeds:
        raise ParameterError("rates is empty; give one rate or more [% of span / s].")
    too_fast = [speed for speed in speeds if speed * dt * 20.0 > high - low]
    if too_fast:
        raise ParameterError(
            f"A ramp of {high - low:g} % at {max(too_fast):g} %/s has fewer than 20 samples of {dt:g} s; "
            "ramp slower or sample faster."
        )
    if S is not None and high - low < 2.0 * require_positive("S", S, "% of span"):
        raise ParameterError(
            f"The range of {high - low:g} % is less than twice S = {S:g} %, and the stem would hardly slip; "
            "widen the range."
        )
    ramps = repeats * sum(2.0 * (high - low) / speed for speed in speeds)
    require_samples("the ramps and their rests together", ramps + 2.0 * repeats * len(speeds) * wait, dt)
    rest = round(wait / dt)
    parts = [np.full(max(rest, 1), begin)]
    if begin != low:
        parts += [_ramp_values(begin, low, speeds[0] * dt), np.full(rest, low)]
    for speed in speeds:
        for _ in range(repeats):
            parts += [
                _ramp_values(low, high, speed * dt),
                np.full(rest, high),
                _ramp_values(high, low, speed * dt),
                np.full(rest, low),
            ]
    if begin != low:
        parts += [_ramp_values(low, begin, speeds[0] * dt), np.full(rest, begin)]
    upset = max(abs(high - begin), abs(low - begin))
    listed = ", ".join(f"{speed:.3g}" for speed in speeds)
    notes = (
        f"Rate{'s' if len(speeds) > 1 else ''} {listed} %/s, {'once' if repeats == 1 else f'{repeats} times'} up and "
        f"down{' at each' if len(speeds) > 1 else ''}, with {wait:g} s of rest.",
        "Record OP and the valve position at every sample; without a position signal, record a flow.",
        f"The test shows a deadband plus stickband of up to {0.5 * (high - low):g} %"
        f"{', and r between two of these rates' if len(speeds) > 1 else ''}.",
    )
    settings = {
        "low": low, "high": high, "rates": speeds, "start": begin, "wait": wait, "repeats": repeats,
    }  # fmt: skip
    return TestPlan("ramp test", dt, np.concatenate(parts), begin, upset, notes, settings)


def _ramp_values(first: float, last: float, step: float) -> np.ndarray:
    """From `first` to `last` in equal steps of about `step`, without the first and with the last value."""
    n = max(1, round(abs(last - first) / step))
    return first + (last - first) * np.arange(1, n + 1) / n

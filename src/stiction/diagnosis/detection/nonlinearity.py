"""Thornhill 2005: is the error easier to predict than what a linear loop would have made of it? (`thornhill2005`).

Each series is predicted from its own nearest neighbours, stretches one period long, half a period ahead; the record is
compared with its `surrogates`, whose harmonics and noise slide past the fundamental.

    N = (mean error of the surrogates - error of the record) / (3 deviations of the surrogates' errors)

Above 1 something in the loop is nonlinear, which need not be the valve (after `thornhill2005`). Derived here: of a
linear loop and 12 surrogates, N is sqrt(13/12) / 3 times Student's t with 11 degrees of freedom, above 1 with a
probability of 0.8 %. The tests measure it on linear loops, oscillating ones among them.

Settings, after the spirit of the paper: 10 to 20 samples to a period, 320 in all, ends matched, 8 neighbours, a fixed
seed. What the harmonics do is all that counts: a nearly pure sine says nothing. The bicoherence (NGI,
NLI) asks the same question; it is left out for the patent application US2007/0288103, whose status was not read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import blocks, judge, objections, swing
from stiction.diagnosis.detection.surrogate_data import end_matched, prediction_error, split, surrogates
from stiction.diagnosis.oscillation.signals import error_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["nonlinearity", "nonlinearity_index"]

PER_PERIOD, LONGEST = 10, 320
NEIGHBOURS, SURROGATES, SEED = 8, 12, 2005
FEWEST_CYCLES = 8.0
LEAST_HARMONICS = 1e-3  # share of the power that harmonics and noise must hold


def nonlinearity(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Test the control error against surrogates of the same spectrum (`thornhill2005`).

    `record`: the control error is used; valid for any process, with 8 periods or more. `oscillation`: what
    `find_oscillation` says of the record. `index` is N [-]; above 1 the loop is nonlinear.
    """
    error = swing(record, oscillation, "error")
    index, against = float("nan"), objections(record, oscillation, cycles=FEWEST_CYCLES)
    if error is not None and oscillation.period > 0.0:
        period = oscillation.period / record.dt
        width = max(1, int(period / PER_PERIOD))
        per_period = max(4, round(period / width))
        index = nonlinearity_index(blocks(error, width)[: LONGEST + 3 * per_period], per_period)
    why = (
        f"{error_name(record)} is {'easier' if index > 1.0 else 'no easier'} to predict than linear signals with the "
        f"same spectrum: N = {index:.2f}. Above 1, something in the loop is nonlinear, not necessarily the valve."
    )
    # A low N clears no valve: what sticks may leave the error a sine.
    return judge("nonlinearity", index, 1.0, -np.inf, why, against, source="thornhill2005")


def nonlinearity_index(x: NDArray[np.float64], per_period: int) -> float:
    """N of a series [-]; NaN where it is too short, or has next to nothing above its fundamental.

    `x`: the series about its drift; 8 periods or more. `per_period`: samples to a period [-]; also the length of the
    stretches compared. Returns .

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(320)
    >>> nonlinearity_index(np.sin(2 * np.pi * t / 10) + 0.1 * rng.standard_normal(320), 10) < 1.0
    True
    """
    if x.size < round(FEWEST_CYCLES * per_period):
        return float("nan")
    low, high = split(x, per_period)
    whole = end_matched(high, per_period)
    low, high = low[whole], high[whole]
    size = float((low + high).std())
    if not float(high.std()) ** 2 > LEAST_HARMONICS * size**2:
        return float("nan")
    ahead, room = max(1, per_period // 2), np.empty((2, low.size, NEIGHBOURS))
    series = (low + np.vstack((high, surrogates(high, SURROGATES, SEED)))) / size
    limit = np.empty(low.size)
    own, *others = (prediction_error(one, per_period, ahead, limit, room[0], room[1]) for one in series)
    spread = float(np.std(others, ddof=1))
    return (float(np.mean(others)) - own) / (3.0 * spread) if spread > 0.0 else float("nan")

"""When the fault of a valve began, grew or was repaired."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.evidence.partition import Level, find_boundaries, last_beginnings
from stiction.diagnosis.evidence.pooling import pool_windows, pooling_model, tabulate
from stiction.diagnosis.identification.intervals import trend
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR
from stiction.diagnosis.verdict.history import Change
from stiction.diagnosis.verdict.model import log_odds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.evidence.pooling import WindowTable
    from stiction.diagnosis.verdict.history import Window

__all__ = ["change_quantities", "evidence_of_today", "find_changes"]

MOST_WINDOWS = 1000
"""Windows in which changes are looked for, the last ones [-]."""
SHORTEST = 2
"""Windows that a change must last to be told [-]: single windows err."""
LEAST_GROWTH_WINDOWS = 5
"""Windows from which growth of S is told [-]."""
GROWTH_SIGNIFICANCE = 4.0
"""Slope of ln S over its standard error from which S grows [-]."""
LEAST_GROWTH = 0.3
"""Growth of ln S over the windows from which it is told [-]."""


def find_changes(windows: Sequence[Window]) -> tuple[Change, ...]:
    """Find when the fault of a valve began, grew or was repaired.

    Parameters
    ----------
    windows : sequence of Window
        Windows of one valve in the order of time.

    Returns
    -------
    tuple of Change
        The changes in the order of time; empty where there is none.

    Notes
    -----
    A valve sticks or is in order, and goes from one to the other. The evidence of the windows, the probability that the
    valve drives the loop, and ln S each have a level in a stretch, whose distribution comes from simulated histories.
    """
    known = [one for one in windows if one.in_control][-MOST_WINDOWS:]
    if len(known) < 2:
        return ()
    table, model = tabulate(known), pooling_model()["changes"]
    found = find_boundaries(
        *_series_and_levels(table), hazard=model["hazard"], least=model["least"], shortest=SHORTEST
    )  # fmt: skip
    numbers = {id(one): k for k, one in enumerate(windows)}
    ends = [0, *(one.first for one in found), len(known)]
    tables = [table.part(*pair) for pair in pairwise(ends)]
    pooled = [pool_windows(part) for part in tables]
    sticks = [found[0].kind == 0 if found else pooled[0].evidence > 0.0, *(one.kind == 1 for one in found)]
    changes: list[Change] = []
    for k, (first, last) in enumerate(pairwise(ends)):
        growth = _find_growth(known[first:last], tables[k], numbers) if sticks[k] else None
        before = None if not sticks[k] else growth.S_before if growth else pooled[k].S.value
        if k:
            window, earlier = known[first], changes[-1] if changes else None
            was = earlier.S_after if earlier and earlier.kind == "growth" else pooled[k - 1].S.value
            sizes = (None, before) if sticks[k] else (was, pooled[k].S_detectable)
            kind = "onset" if sticks[k] else "repair"
            sure, number = found[k - 1].probability, numbers[id(window)]
            changes.append(Change(window.start, window.start_s, kind, *sizes, sure, number))
        changes += [growth] if growth else []
    return tuple(changes)


def evidence_of_today(windows: Sequence[Window]) -> float:
    """Evidence for a valve that sticks today, log odds beyond those of the prior [-].

    The windows since the last change count; it may have been at each of them, also where that is too unsure to tell.
    One window keeps its evidence.
    """
    table, model = tabulate([one for one in windows if one.in_control][-MOST_WINDOWS:]), pooling_model()["changes"]
    begins = last_beginnings(*_series_and_levels(table), hazard=model["hazard_of_today"], power=model["power"])
    places = np.flatnonzero(begins >= LEAST_SHARE)
    evidence = np.array([pool_windows(table.part(int(first))).evidence for first in places])
    if places.size == 1:
        return float(evidence[0])
    share, odds = begins[places], evidence + log_odds(DEFAULT_PRIOR)
    sticks, good = (float(np.logaddexp.reduce(np.log(share) - np.logaddexp(0.0, sign * odds))) for sign in (-1.0, 1.0))
    return sticks - good - log_odds(DEFAULT_PRIOR)


LEAST_SHARE = 1e-3
"""Probability of a last change from which it counts [-]."""


def _series_and_levels(table: WindowTable) -> tuple[list[NDArray[np.float64]], list[tuple[Level, Level]]]:
    """The quantities that change with the valve, and their levels."""
    model, series = pooling_model()["changes"], change_quantities(table)
    return list(series.values()), [(Level(*model[name][0]), Level(*model[name][1])) for name in series]


def _find_growth(known: Sequence[Window], table: WindowTable, numbers: dict[int, int]) -> Change | None:
    """Growth of S over windows of a sticky valve, by least squares of ln S; None where it is not sure."""
    if len(known) < LEAST_GROWTH_WINDOWS:
        return None
    x, y = np.array([one.start_s for one in known]), np.log(np.maximum(table.S[:, 0], 1e-3))
    slope, error = trend(x, y)
    rise = slope * float(x[-1] - x[0])
    if not (rise > LEAST_GROWTH and slope > GROWTH_SIGNIFICANCE * error):
        return None
    before, after = (float(np.exp(y.mean() + slope * (at - x.mean()))) for at in (x[0], x[-1]))
    sure = 0.5 * math.erfc(-slope / max(error, 1e-300) / math.sqrt(2.0))
    return Change(known[0].start, known[0].start_s, "growth", before, after, sure, numbers[id(known[0])])


def change_quantities(table: WindowTable) -> dict[str, NDArray[np.float64]]:
    """Quantities that differ between a sticky valve and one in order, by the name of their levels in the model."""
    cause = np.clip(table.valve_cause, 0.01, 0.99)
    return {
        "evidence": table.evidence,
        "valve_cause": np.log(cause / (1.0 - cause)),
        "ln_S": np.log(np.maximum(table.S[:, 0], 1e-3)),
    }

"""Damarla and others 2022: in how many windows does OP slope and PV not? (`damarla2022`).

Straight lines are fitted to OP and PV in windows of six samples side by side. The valve is taken as stuck where
|slope of OP / slope of PV| >= eta; the index is the share of stuck windows. The paper's ratio depends on the units;
here both signals are divided by their deviation, and eta is 5. Then chance has a level, derived here: the ratio of two
independent Gaussian slopes of one deviation, like that of two sinusoids a quarter period apart, passes eta in
2 arctan(1/eta) / pi of the windows, 0.126. Stiction three standard errors above that. A PV much slower than OP slopes
less for its deviation: unrelated, it passes eta more often than that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import coarse, judge, objections, swing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["damarla_regression", "stuck_windows"]

WINDOW = 6
ETA = 5.0
CHANCE = 2.0 / np.pi * float(np.arctan(1.0 / ETA))


def damarla_regression(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Count the windows in which OP slopes and PV does not (`damarla2022`).

    `record`: OP and control error are used; valid for a self-regulating process, oscillating or not. `oscillation`:
    what `find_oscillation` says of the record; sets how far samples are averaged. `index` is the share of stuck windows
    [-].
    """
    op, error = swing(record, oscillation, "op"), swing(record, oscillation, "error")
    stuck, windows = float("nan"), 0
    if op is not None and error is not None:
        op, error = (coarse(record, oscillation, x, 48) for x in (op, error))
        windows = op.shape[0] // WINDOW
        stuck = stuck_windows(op, error)
    limit = CHANCE + 3.0 * float(np.sqrt(CHANCE * (1.0 - CHANCE) / max(windows, 1)))
    why = (
        f"In {100.0 * stuck:.0f} % of {windows} short windows OP changes {ETA:.0f} times as fast as PV, each over "
        f"its own standard deviation; unrelated signals with the same spectrum give {100.0 * CHANCE:.0f} %."
    )
    against = objections(record, oscillation, integrating=False, cycles=0.0)
    if windows < 30:
        against.append(f"it has {windows} windows, 30 are needed")
    return judge("damarla_regression", stuck, limit, CHANCE, why, against, source="damarla2022")


def stuck_windows(op: NDArray[np.float64], pv: NDArray[np.float64]) -> float:
    """Share of windows with |slope of OP / slope of PV| >= 5 after division by the deviations [-].

    Examples
    --------
    >>> import numpy as np
    >>> stuck_windows(np.arange(60.0), np.repeat([0.0, 1.0], 30))
    1.0
    """
    n = op.shape[0] // WINDOW
    if n == 0 or not (op.std() > 0.0 and pv.std() > 0.0):
        return float("nan")
    t = np.arange(WINDOW) - (WINDOW - 1) / 2.0
    slope_op, slope_pv = (np.abs(x[: n * WINDOW].reshape(n, WINDOW) @ t) / x.std() for x in (op, pv))
    return float(np.mean((slope_op >= ETA * slope_pv) & (slope_op > 0.0)))

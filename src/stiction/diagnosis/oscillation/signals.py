"""The loop's error, freed of gaps, drift and noise, and cut into half periods."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.models.numba_compile import kernel
from stiction.records.analysis_window import forward_fill_sp
from stiction.records.gaps import interpolate_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["about_drift", "control_error", "error_name", "filled", "half_cycles", "smooth"]


def control_error(record: LoopRecord) -> NDArray[np.float64] | None:
    """SP - PV, or -PV where no set point is known, shape (n_samples,) [engineering units]; None where PV does not move.

    Missing values are bridged by straight lines, and those of the set point as `forward_fill_sp` does.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation.signals import control_error
    >>> from stiction.records import LoopRecord
    >>> pv = np.arange(8.0)
    >>> control_error(LoopRecord("FIC-101", 1.0, op=pv, pv=pv, sp=np.full(8, 2.0))).tolist()
    [2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -4.0, -5.0]
    """
    if record.pv is None:
        return None
    sp, _ = forward_fill_sp(record)
    return filled(-record.pv if sp is None else sp - record.pv)


def error_name(record: LoopRecord) -> str:
    """Name `control_error` of a record as it begins a sentence: no error is known without a set point.

    Examples
    --------
    >>> from stiction.diagnosis.oscillation.signals import error_name
    >>> from stiction.records import LoopRecord
    >>> error_name(LoopRecord("FIC-101", 1.0, op=[50.0], pv=[3.0], sp=[3.0]))
    'The control error'
    >>> error_name(LoopRecord("FIC-101", 1.0, op=[50.0], pv=[3.0]))
    'The PV about its drift (SP unknown)'
    """
    known = forward_fill_sp(record)[0] is not None
    return "The control error" if known else "The PV about its drift (SP unknown)"


def filled(x: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """Bridge missing values by straight lines, shape (n_samples,) [unit of `x`].

    None where under half of the signal or under 8 samples are there, or where it never moves.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation.signals import filled
    >>> filled(np.array([0.0, 1.0, np.nan, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    """
    if x is None:
        return None
    good = np.isfinite(x)
    count = int(np.count_nonzero(good))
    if count < 8 or 2 * count < x.shape[0]:
        return None
    whole = interpolate_gaps(x)
    low, high = float(whole.min()), float(whole.max())
    return whole if high - low > 1e-12 * max(abs(low), abs(high)) else None


def smooth(x: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Centred moving average over `width` samples, a fractional number [-], with straight lines beyond the ends.

    Shape and unit are those of `x`, which has no gaps.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation.signals import smooth
    >>> smooth(np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0]), 3.0)[1:4].round(6).tolist()
    [1.0, 1.0, 1.0]
    """
    n = x.shape[0]
    half = (min(width, n - 1.0) - 1.0) / 2.0
    if half <= 0.0:
        return x
    whole = int(half)
    long, out = np.empty(n + 2 * whole + 2), np.empty(n)
    long[whole + 1 : whole + 1 + n] = x
    _smooth(long, half, whole, np.empty(long.size + 1), out)
    return out


@kernel
def _smooth(long, half, whole, total, out):
    """Fill `out` (n_samples,) with the average over `half` samples either way, `whole` of them whole ones.

    The signal stands in `long` (n_samples + 2 whole + 2,), with room for the lines at both ends; `total`, one longer,
    is work space.
    """
    n, pad = out.shape[0], whole + 1
    m = min(n - 1, 2 * pad) + 1
    for side in range(2):
        begin = pad if side == 0 else pad + n - m
        mean = slope = 0.0
        for k in range(m):
            mean += long[begin + k]
            slope += (k - 0.5 * (m - 1)) * long[begin + k]
        mean, slope = mean / m, slope / (m * (m * m - 1.0) / 12.0)
        for k in range(1, pad + 1):
            beyond = 0.5 * (m - 1) + k
            if side == 0:
                long[pad - k] = mean - slope * beyond
            else:
                long[pad + n - 1 + k] = mean + slope * beyond
    total[0] = 0.0
    for k in range(long.shape[0]):
        total[k + 1] = total[k] + long[k]
    for k in range(n):
        inner = total[k + pad + whole + 1] - total[k + pad - whole]
        out[k] = (inner + (half - whole) * (long[k + pad - whole - 1] + long[k + pad + whole + 1])) / (2.0 * half + 1.0)


def about_drift(x: NDArray[np.float64], samples_per_period: float) -> NDArray[np.float64]:
    """Take off the moving average over one period [samples]: the wave stays as it is, slower drift goes.

    Shape and unit are those of `x`, which has no gaps.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation.signals import about_drift
    >>> t = np.arange(200.0)
    >>> wave = np.sin(2 * np.pi * t / 20)
    >>> bool(np.abs(about_drift(wave + 0.5 * t, 20.0) - wave)[20:180].max() < 1e-9)
    True
    """
    return x - smooth(x, samples_per_period)


def half_cycles(x: NDArray[np.float64], samples_per_period: float) -> NDArray[np.intp]:
    """Cut a signal that swings about zero into half periods.

    A half period ends where the signal, smoothed over a tenth of a period, crosses zero on its way through a band of
    a quarter of its deviation on either side; smaller crossings are noise.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal about its drift.
    samples_per_period : float
        Period over sampling period [-].

    Returns
    -------
    ndarray, shape (n_half_periods, 2)
        First sample and the one past the last of each half period; the cut ones at the ends are left out.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation import half_cycles
    >>> half_cycles(np.sin(2 * np.pi * (np.arange(100) + 0.5) / 20), 20.0)[:3].tolist()
    [[10, 20], [20, 30], [30, 40]]
    """
    none = np.empty((0, 2), dtype=np.intp)
    if not samples_per_period > 0.0:
        return none
    calm = smooth(x, samples_per_period / 10.0)
    outside = np.flatnonzero(np.abs(calm) > 0.25 * float(calm.std()))
    if outside.size < 3:
        return none
    side = calm[outside] > 0.0
    turns = np.flatnonzero(side[1:] != side[:-1])
    positive = calm > 0.0
    crossings = np.flatnonzero(positive[1:] != positive[:-1]) + 1
    first = np.searchsorted(crossings, outside[turns], side="right")
    last = np.searchsorted(crossings, outside[turns + 1], side="right") - 1
    cuts = (crossings[first] + crossings[last] + 1) // 2
    segments = np.column_stack((cuts[:-1], cuts[1:]))
    return segments[segments[:, 1] - segments[:, 0] > max(2.0, 0.1 * samples_per_period)]

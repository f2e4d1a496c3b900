"""A regular rhythm in one octave of periods, by the zero crossings of the autocorrelation (`thornhill2003`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.oscillation.signals import about_drift, smooth
from stiction.records.correlation import lagged_products

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["NOTHING", "Rhythm", "autocorrelation", "octave", "octaves", "strongest"]

SHORTEST = 4.0  # samples per period below which a wave cannot be told from noise
FEWEST = 3.0  # periods a record must hold
CHANCE = 1.5  # autocorrelation one period later times sqrt(periods): noise of any colour stays below, see the tests
INTERVALS = 11  # intervals between zero crossings used, the first skipped (Thornhill 2003)
LEAST_HEIGHT = 0.1  # autocorrelation one period later: the filter of an octave alone leaves white noise up to 0.06
LAGS = 13.0  # lags looked at, over the middle of the octave: 12 half periods, 8 periods for the eye
MOST_REGULAR = 10.0  # reported at most
LONG = 8192  # samples above which slow octaves are searched in means of samples


class Rhythm(NamedTuple):
    """What the autocorrelation of one octave says."""

    period: float
    """Period [samples]; NaN when there is none."""
    regularity: float
    """Thornhill's r [-], at most `MOST_REGULAR`."""
    height: float
    """Autocorrelation one period later [-]."""
    cycles: float
    """Periods in the record [-]."""
    power: float
    """Variance of the octave times height: what the wave carries."""
    acf: NDArray[np.float64]
    """Autocorrelation of the octave [-]."""

    @property
    def repeats(self) -> bool:
        """Whether the wave comes back more than noise in a band would."""
        return bool(self.height * np.sqrt(self.cycles) > CHANCE and self.height > LEAST_HEIGHT)

    @property
    def regular(self) -> bool:
        """Whether it repeats, and at one pace."""
        return self.regularity > 1.0 and self.repeats


NOTHING = Rhythm(np.nan, np.nan, np.nan, 0.0, 0.0, np.empty(0))


def autocorrelation(x: NDArray[np.float64], longest: float = np.inf) -> NDArray[np.float64]:
    """Autocorrelation of a signal, each lag over the pairs that it has (unbiased).

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal without gaps [any unit].
    longest : float
        Lags given at most [samples]; three quarters of the record by default.

    Returns
    -------
    ndarray, shape (n_lags,)
        Autocorrelation at lags 0, 1, 2 ... [-], 1 at lag 0; all 0 of a signal that does not move.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation import autocorrelation
    >>> wave = np.sin(2 * np.pi * np.arange(400) / 20)
    >>> autocorrelation(wave, 21)[[0, 10, 20]].round(2).tolist()
    [1.0, -1.0, 1.0]
    """
    n = x.shape[0]
    lags = int(max(2, min((3 * n) // 4, longest)))
    about_mean = x - x.mean()
    acf = lagged_products(about_mean, about_mean, lags) / np.arange(n, n - lags, -1.0)
    return acf / acf[0] if acf[0] > 0.0 else np.zeros(lags)


def octaves(x: NDArray[np.float64]) -> Iterator[tuple[float, Rhythm, bool]]:
    """Middle period [samples] and rhythm of all octaves that have one, the shortest periods first.

    In a long record that of a slow octave is found from means of two, four, ... samples, 24 or more to a period; the
    last value says whether it was found from all samples.
    """
    longest, around, width = x.shape[0] / FEWEST, 0.75 * 2.0 * SHORTEST, 1
    for i in range(int(np.log2(max(longest / SHORTEST, 1.0))) + 1):
        if i > 2 and x.shape[0] > LONG:
            x, width = 0.5 * (x[:-1:2] + x[1::2]), 2 * width
        found = octave(x, around * 2.0**i / width)
        if found.period > 0.0:
            yield around * 2.0**i, found._replace(period=width * found.period), width == 1


def strongest(x: NDArray[np.float64]) -> Rhythm:
    """Find the octave whose wave carries most, regular ones first."""
    found = [one for one in octaves(x) if one[1].power > 0.0]
    for around, rhythm, all_samples in sorted(found, key=lambda one: (one[1].regular, one[1].power), reverse=True):
        if (exact := rhythm if all_samples else octave(x, around)).power > 0.0:
            return exact
    return NOTHING


def octave(x: NDArray[np.float64], around: float) -> Rhythm:
    """Find the rhythm with a period between 0.6 and 1.5 of `around` [samples]."""
    band = about_drift(smooth(x, around / 12.0), 4.0 / 3.0 * around)
    acf = autocorrelation(band, LAGS * around)
    above = acf > 0.0
    at = np.flatnonzero(above[1:] != above[:-1])[: INTERVALS + 1]
    crossings = at + acf[at] / (acf[at] - acf[at + 1])
    intervals = np.diff(crossings)
    if intervals.size < 3:
        return NOTHING
    period = 2.0 * float(intervals.mean())
    if not max(SHORTEST, 0.6 * around) <= period <= min(x.shape[0] / FEWEST, 1.5 * around):
        return NOTHING
    spread = np.concatenate([part - part.mean() for part in (intervals[::2], intervals[1::2])])
    sigma = 2.0 * np.sqrt(float(spread @ spread) / max(1, intervals.size - 2))
    height = float(acf[min(round(period), acf.shape[0] - 1)])
    regularity = float(min(period / (3.0 * max(sigma, 1e-3 * period)), MOST_REGULAR))
    return Rhythm(period, regularity, height, x.shape[0] / period, float(band.var()) * max(height, 0.0), acf)

"""Since when a loop takes part in the oscillation of its group."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.fleet.loop_oscillations import complex_envelope, signal_at

if TYPE_CHECKING:
    from stiction.fleet.block_means import BlockMeans

__all__ = ["SwingBegin", "swing_begin"]

ENVELOPE_PERIODS = 3.0
"""Periods of a window in which the amplitude is measured; windows overlap by half [-]."""


class SwingBegin(NamedTuple):
    """When a loop begins to swing."""

    time_s: float
    """Time after the start of the clock [s]."""
    is_earlier: bool
    """Whether it swings already at this time, where the examined blocks begin."""


def swing_begin(means: BlockMeans, period: float, signal: str, *, min_share: float = 0.4) -> SwingBegin | None:
    """Find the time at which the swing of a loop at one period begins.

    Parameters
    ----------
    means : BlockMeans
        Block means of the loop.
    period : float
        The period [s].
    signal : str
        "error" or "op".
    min_share : float
        Share of its largest amplitude (90 % quantile) from which it swings [-].

    Returns
    -------
    SwingBegin or None
        When it begins, to within three periods; None where the record is too short to say.

    Examples
    --------
    >>> from stiction.fleet.block_means import common_clock, make_block_means
    >>> from stiction.records import LoopRecord
    >>> k = np.arange(7200)
    >>> wave = np.where(k < 3600, 0.0, 2.0) * np.sin(2 * np.pi * k / 120) + 0.1 * np.sin(k)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + wave, pv=wave)
    >>> means = make_block_means(record, common_clock([record]))
    >>> begin = swing_begin(means, 120.0, "op")
    >>> abs(begin.time_s - 3600.0) < 360.0, begin.is_earlier
    (True, False)
    """
    x, dt = signal_at(means, period, signal)
    amplitude = np.abs(complex_envelope(x, period / dt, periods=ENVELOPE_PERIODS))
    if amplitude.size < 4:
        return None
    swings = amplitude >= min_share * np.quantile(amplitude, 0.9)
    first = int(np.argmax(swings))
    hop = max(1, round(ENVELOPE_PERIODS * period / dt) // 2)
    shown_from = means.clock.fast_first if means.clock.fast_count and dt == means.clock.fast_dt else 0.0
    return SwingBegin(shown_from + (float((first + 1) * hop * dt) if first else 0.0), first == 0)

"""Trends and spectra of the loops of a group as numbers: the page of an audit and the browser draw the same."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.duration_format import format_seconds, format_time
from stiction.fleet.group_times import swing_begin
from stiction.fleet.loop_oscillations import signal_at
from stiction.fleet.signals import read_signals
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.fleet import Audit
    from stiction.fleet.group_times import SwingBegin

__all__ = ["GroupPicture", "picture_group"]

MIN_BLOCKS = 16
"""Fewest block means of which a loop is drawn [-]."""
PERIODS = 8.0
"""Periods in the middle of the record that are shown [-]."""
TREND_POINTS, SPECTRUM_POINTS = 400, 300
"""Largest number of points of a line [-]."""
RATIOS = (0.4, 8.0)
"""Frequencies of a spectrum, over that of the group [-]."""


@dataclass(frozen=True)
class GroupPicture:
    """Lines of the loops of one group, the likeliest source first."""

    shown_s: float
    """Time that the trends cover [s]."""
    trends: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]
    """Tag -> time over `shown_s` [-], and the signal over its own range, -0.5 to 0.5 [-]."""
    spectra: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]
    """Tag -> frequency over that of the group, and amplitude over its largest [-]."""
    since: dict[str, str]
    """Tag -> since when the loop swings, in words; empty where that is not known."""
    left_out: int
    """Loops that are not drawn [-]."""


def picture_group(audit: Audit, group: dict[str, Any], max_loops: int = 12) -> GroupPicture:
    """Return the lines of a group: PV less SP, or OP where that swings more.

    `audit`: the audit. `group`: one of its groups. `max_loops`: largest number of loops that are drawn [-].
    """
    signal_of = {one["tag"]: one["signal"] for one in group["member_details"]}
    tags = [tag for tag in group["members"] if tag in audit.signal_parts]
    parts = {number: part for number, part in (audit.signal_parts[tag] for tag in tags) if part}
    means, period = read_signals(audit.signals_folder, parts), group["period_s"]
    shown_s, trends, spectra, since = 0.0, {}, {}, dict.fromkeys(group["members"], "")
    for tag in tags:
        one = means.get(audit.signal_parts[tag][0])
        if one is None:
            continue
        x, dt = signal_at(one, period, signal_of[tag])
        since[tag] = _since(swing_begin(one, period, signal_of[tag]), one.clock.start)
        if x.size < MIN_BLOCKS or not np.ptp(x) > 0.0 or len(trends) == max_loops:
            continue
        x = x.astype(np.float64) * (1.0 if signal_of[tag] == "op" else -1.0)
        count = min(x.size, max(MIN_BLOCKS, round(PERIODS * period / dt)))
        first = (x.size - count) // 2
        part = x[first : first + count]
        chosen, shown_s = downsample(part, TREND_POINTS), count * dt
        trends[tag] = (chosen / max(count - 1, 1), (part[chosen] - part.mean()) / (np.ptp(part) or 1.0))
        spectra[tag] = _spectrum(x, dt, period)
    return GroupPicture(shown_s, trends, spectra, since, len(group["members"]) - len(trends))


def _since(begin: SwingBegin | None, start: datetime | None) -> str:
    """Say since when a loop swings; empty where the record is too short, or begins with the swing and has no times."""
    if begin is None or (begin.is_earlier and start is None):
        return ""
    if start is None:
        return f"since {format_seconds(begin.time_s)} after the start of the record"
    moment = (start + timedelta(seconds=begin.time_s)).replace(second=0, microsecond=0)
    return f"since {'before ' if begin.is_earlier else ''}{format_time(moment)}"


def _spectrum(x: NDArray[np.float64], dt: float, period: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    amplitude = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))).astype(np.float64)
    ratio = (np.fft.rfftfreq(x.size, dt) * period).astype(np.float64)
    inside = (ratio > RATIOS[0]) & (ratio < RATIOS[1])
    level = amplitude[inside] / max(amplitude[inside].max(initial=0.0), 1e-300)
    chosen = downsample(level, SPECTRUM_POINTS)
    return ratio[inside][chosen], level[chosen]

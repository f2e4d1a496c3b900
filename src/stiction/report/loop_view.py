"""One diagnosis as its figures see it: time axis, analysed stretch, and fitted signals laid on the record."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.runs import runs
from stiction.report import labels, style
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Diagnosis

__all__ = ["LoopView"]

IN_PART = 1.5
"""Periods of the analysed stretch without a simulated PV beyond which only part of it was simulated: half a period at
both ends has no moving average to be compared about [-]."""


@dataclass(frozen=True)
class LoopView:
    """What the figures of one loop share."""

    diagnosis: Diagnosis
    """The diagnosis shown."""

    @cached_property
    def window(self) -> tuple[int, int]:
        """First and one past the last sample analysed; the whole record when that is not told."""
        n = len(self.diagnosis.record)
        quality: Any = self.diagnosis.quality
        first, last = getattr(quality, "first", 0), getattr(quality, "last", n)
        return (first, last) if 0 <= first < last <= n else (0, n)

    @property
    def whole(self) -> bool:
        """Whether the whole record was analysed."""
        return self.window == (0, len(self.diagnosis.record))

    @cached_property
    def unit(self) -> tuple[str, float]:
        """Name and length [s] of the unit of the time axis."""
        return labels.time_unit(self.diagnosis.record.duration)

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Time since the first sample [unit], shape (n_samples,)."""
        return self.diagnosis.record.time / self.unit[1]

    @property
    def time_title(self) -> str:
        """Title of the time axis."""
        start = self.diagnosis.record.start
        return f"Time{f' since {start:%Y-%m-%d %H:%M}' if start else ''} [{self.unit[0]}]"

    @property
    def pv_unit(self) -> str:
        """Unit of the PV as the source names it, for the title of an axis."""
        return labels.pv_unit(self.diagnosis)

    @cached_property
    def op_unit(self) -> str:
        """Unit of OP, S and J, for the title of an axis."""
        return self.diagnosis.record.op_unit

    @cached_property
    def op_unit_short(self) -> str:
        """The same behind a number in a sentence."""
        return self.diagnosis.record.op_unit_short

    @property
    def valve_is_accepted(self) -> bool:
        """Whether the valve that was fitted may be the loop's; where none was found to stick, only one with play is."""
        return self.diagnosis.verdict != "no_stiction" or self.diagnosis.cause == "deadband"

    @cached_property
    def stem(self) -> NDArray[np.float64]:
        """Estimated valve position on the samples of the record, shape (n,); NaN where there is none."""
        found = self.diagnosis.identification
        return self.on_record_samples(found.mv if found is not None else np.empty(0))

    @property
    def good_shown(self) -> bool:
        """Whether the PV of a good valve is drawn in place of that of a sticky one which was not believed."""
        found = self.diagnosis.identification
        return found is not None and not self.valve_is_accepted and found.pv_linear.size > 0

    @cached_property
    def model(self) -> NDArray[np.float64]:
        """Simulated PV drawn beside the record's, on its samples, shape (n,); NaN where there is none."""
        found = self.diagnosis.identification
        if found is None:
            return self.on_record_samples(np.empty(0))
        return self.on_record_samples(found.pv_linear if self.good_shown else found.pv)

    @property
    def model_name(self) -> str:
        """Which valve that is."""
        return (
            "good valve" if self.good_shown else "fitted valve" if self.valve_is_accepted else "likeliest sticky valve"
        )

    @cached_property
    def simulated(self) -> list[tuple[int, int]]:
        """First and one past the last sample of each stretch of the record with a simulated PV."""
        return runs(np.isfinite(self.model))

    @property
    def in_part(self) -> bool:
        """Whether the valve was simulated over part of the analysed stretch only."""
        (first, last), period = self.window, self.diagnosis.oscillation.period
        left = last - first - sum(stop - start for start, stop in self.simulated)
        beyond = IN_PART * period / self.diagnosis.record.dt if np.isfinite(period) else 0.0
        return bool(self.simulated) and left > beyond

    def span_of(self, first: int, last: int) -> str:
        """From when to when samples `first` to one before `last` were recorded, on the time axis."""
        start, end = float(self.time[first]), float(self.time[last - 1])
        return f"{labels.format_number(start)} to {labels.format_number(end, self.unit[0])}"

    @cached_property
    def partly_stored(self) -> dict[str, float]:
        """Those of OP and PV that were stored at a share of the samples, the others told by the controller's law."""
        stored = self.diagnosis.stored
        return stored.partial if stored is not None else {}

    def on_record_samples(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fitted signal on the samples of the record, shape (n_samples,); NaN where it was not computed."""
        n, (first, last) = len(self.diagnosis.record), self.window
        if len(values) == n:
            return values
        whole = np.full(n, np.nan)
        if len(values) == last - first:
            whole[first:last] = values
        return whole

    def trace(self, y: NDArray[np.float64], name: str, line: dict[str, Any], **more: Any) -> dict[str, Any]:
        """Trace of a signal over time, thinned."""
        keep = downsample(y)
        return style.trace(self.time[keep], y[keep], name, line) | more

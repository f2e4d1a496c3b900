"""What the figures of one loop share: time axis, analysed part, and fitted signals on the samples of the record."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.identification.identify import STICKY_SEGMENT
from stiction.report import labels, style
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.result import Segment
    from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = ["LoopView"]


@dataclass(frozen=True)
class LoopView:
    """A diagnosis with what its figures share."""

    diagnosis: Diagnosis
    """The diagnosis."""

    @cached_property
    def analysed(self) -> tuple[int, int]:
        """First and one past the last sample of the analysed part; the whole record when the valve was not judged."""
        n, quality = len(self.diagnosis.record), self.diagnosis.quality
        is_part = self.diagnosis.loop_state.in_control and quality.first < quality.last
        return (quality.first, quality.last) if is_part else (0, n)

    @property
    def is_analysed_whole(self) -> bool:
        """Whether the whole record was analysed."""
        return self.analysed == (0, len(self.diagnosis.record))

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
        return f"Time{f' since {labels.format_time(start)}' if start else ''} [{self.unit[0]}]"

    @property
    def pv_unit(self) -> str:
        """Unit of the PV as the source names it, for the title of an axis."""
        return labels.pv_unit(self.diagnosis)

    @property
    def op_unit(self) -> str:
        """Unit of OP, S and J, for the title of an axis."""
        return self.diagnosis.record.op_unit

    @property
    def op_unit_short(self) -> str:
        """Unit of OP, S and J after a number in a sentence."""
        return self.diagnosis.record.op_unit_short

    @property
    def valve_is_accepted(self) -> bool:
        """Whether the identified sticky valve may be the valve of the loop."""
        return self.diagnosis.verdict != "no_stiction"

    @cached_property
    def valve_position(self) -> NDArray[np.float64]:
        """Estimated valve position, shape (n_samples,) [% of span]; NaN without one."""
        identification = self.diagnosis.identification
        return self.on_record_samples(identification.mv if identification is not None else np.empty(0))

    @cached_property
    def model(self) -> NDArray[np.float64]:
        """Simulated PV, shape (n_samples,): with the sticky valve, or the good one when the verdict is no stiction."""
        identification = self.diagnosis.identification
        if identification is None:
            return self.on_record_samples(np.empty(0))
        return self.on_record_samples(identification.pv if self.valve_is_accepted else identification.pv_linear)

    @property
    def model_name(self) -> str:
        """Valve of the simulated PV."""
        return "sticky valve" if self.valve_is_accepted else "good valve"

    @property
    def segments(self) -> tuple[tuple[int, int, Segment], ...]:
        """First and one past the last sample in the record of each part that was judged by itself, and the part."""
        identification, first = self.diagnosis.identification, self.analysed[0]
        return tuple(
            (first + one.first, first + one.last, one) for one in (identification.segments if identification else ())
        )

    @property
    def sticky_segments(self) -> tuple[tuple[int, int, Segment], ...]:
        """Parts of the record in which the sticky valve is clearly more likely than a good one."""
        return tuple(part for part in self.segments if part[2].likelihood_ratio > STICKY_SEGMENT)

    def describe_range(self, first: int, last: int) -> str:
        """Return the times of samples `first` to `last` - 1 as text, in the unit of the time axis."""
        start, end = float(self.time[first]), float(self.time[last - 1])
        return f"{labels.format_number(start)} to {labels.format_number(end, self.unit[0])}"

    def on_record_samples(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a signal of the analysed part on all samples of the record, shape (n_samples,); NaN elsewhere."""
        n, (first, last) = len(self.diagnosis.record), self.analysed
        if len(values) == n:
            return values
        whole = np.full(n, np.nan)
        if len(values) == last - first:
            whole[first:last] = values
        return whole

    def trace(self, y: NDArray[np.float64], name: str, line: dict[str, Any], **more: Any) -> dict[str, Any]:
        """Return the trace of a signal over time, downsampled."""
        shown = downsample(y)
        return style.trace(self.time[shown], y[shown], name, line) | more

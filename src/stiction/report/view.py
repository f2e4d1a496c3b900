"""One diagnosis as its figures see it: time axis, analysed stretch, and fitted signals laid on the record."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look, words
from stiction.report.thin import MOST_POINTS, thin

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Diagnosis

__all__ = ["View"]

CYCLES = 6
"""Last periods shown in plots of one signal against another."""


@dataclass(frozen=True)
class View:
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
        return words.time_unit(self.diagnosis.record.duration)

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
        return words.pv_unit(self.diagnosis)

    @cached_property
    def op_unit(self) -> str:
        """Unit of OP, S and J, for the title of an axis."""
        return self.diagnosis.record.op_unit

    @cached_property
    def op_unit_short(self) -> str:
        """The same behind a number in a sentence."""
        return self.diagnosis.record.op_unit_short

    @cached_property
    def cycles(self) -> slice:
        """The last few periods of the analysed stretch."""
        first, last = self.window
        period = self.diagnosis.oscillation.period
        n = CYCLES * period / self.diagnosis.record.dt if np.isfinite(period) else MOST_POINTS
        return slice(max(first, last - int(min(max(n, 20), MOST_POINTS))), last)

    @cached_property
    def seldom(self) -> dict[str, float]:
        """Those of OP and PV that were stored at a share of the samples, the others told by the controller's law."""
        stored = self.diagnosis.stored
        return stored.seldom if stored is not None else {}

    def laid(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
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
        keep = thin(y)
        return look.trace(self.time[keep], y[keep], name, line) | more

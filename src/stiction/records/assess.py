"""Data quality: all data checks of a record, and whether it can be diagnosed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import require_positive
from stiction.records.check_result import MIN_CYCLES, MIN_SAMPLES
from stiction.records.conditioned import Conditioned, condition
from stiction.records.gaps import forward_fill, missing_mask
from stiction.records.quality.clock_jumps import check_clock_jumps
from stiction.records.quality.compression import check_compression, check_exception_reporting
from stiction.records.quality.copied_data import check_copied_data
from stiction.records.quality.frozen import check_frozen_pv, check_manual, check_outages
from stiction.records.quality.missing_values import check_missing_values, check_resampled
from stiction.records.quality.movement import check_op_movement, check_op_reversals, check_pv_movement
from stiction.records.quality.moving_average import check_moving_average
from stiction.records.quality.op_scale import check_op_scale
from stiction.records.quality.outliers import check_outliers
from stiction.records.quality.quantisation import check_resolution, quantisation_step, robust_range
from stiction.records.quality.sampling import check_averages, check_cycles, check_length, check_sampling
from stiction.records.quality.saturation import check_saturation
from stiction.records.quality.storage_rate import check_held_values, check_storage_rate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from stiction.records.check_result import CheckResult
    from stiction.records.record import LoopRecord

__all__ = ["CheckInput", "Quality", "assess_quality"]


@dataclass(frozen=True)
class CheckInput:
    """A record and what several checks compute from it."""

    conditioned: Conditioned
    """The record, ready for analysis."""
    period: float | None
    """Period of the oscillation [s], when it is known."""

    @cached_property
    def part(self) -> LoopRecord:
        """Its longest usable segment, with all gaps."""
        return self.conditioned.record.window(self.conditioned.first, self.conditioned.last)

    @cached_property
    def steps(self) -> tuple[float, float]:
        """Quantisation steps of OP and PV [units of the record]."""
        record = self.conditioned.record
        if len(self.part) == len(record):
            return self.conditioned.op_step, self.conditioned.pv_step
        pv = np.empty(0) if record.pv is None else forward_fill(record.pv)
        return quantisation_step(forward_fill(record.op)), quantisation_step(pv)

    @cached_property
    def op(self) -> NDArray[np.float64]:
        """OP of the segment without gaps [unit of the record], shape (n_samples,)."""
        return forward_fill(self.part.op)

    @cached_property
    def pv(self) -> NDArray[np.float64]:
        """PV of the segment without gaps [engineering units], shape (n_samples,); empty when it was not recorded."""
        return np.empty(0) if self.part.pv is None else forward_fill(self.part.pv)

    @cached_property
    def swings(self) -> tuple[float, float]:
        """98 % ranges of OP and PV of the segment [units of the record]."""
        known = self.conditioned
        if known.missing.size and not known.missing.any():
            return known.op_swing, known.pv_swing
        return robust_range(self.op), robust_range(self.pv)

    @cached_property
    def cycle(self) -> float | None:
        """Time of a cycle [s]: the period, else the mean time between upward crossings of OP's mean, if six or more."""
        if self.period is not None:
            return self.period
        record = self.conditioned.record
        op = forward_fill(record.op)
        above = op > np.nanmean(op) if np.isfinite(op).any() else np.zeros(2, bool)
        crossings = int(np.sum(above[1:] & ~above[:-1]))
        return record.duration / crossings if crossings >= 6 else None

    @cached_property
    def is_cut_too_short(self) -> bool:
        """Whether the segment is too short for a diagnosis and the whole record would not be."""
        record = self.conditioned.record
        needed = max(MIN_SAMPLES * record.dt, MIN_CYCLES * (self.cycle or 0.0))
        return self.part.duration < needed <= record.duration


@dataclass(frozen=True, slots=True)
class Quality(Result):
    """The data checks of a record."""

    _json_keys = ("usable", "rows", "duration as duration_s", "bad_percent", "first", "last", "checks as gates")

    checks: tuple[CheckResult, ...]
    """Every check that applies."""
    usable: bool
    """Whether no check rejects the record."""
    rows: int
    """Samples of the record [-]."""
    duration: float
    """Length of the record [s]."""
    bad_percent: float
    """Samples in which OP or PV is missing [%]."""
    first: int
    """First sample of the segment to analyse [-]."""
    last: int
    """One past the last sample of that segment [-]."""

    @property
    def rejections(self) -> tuple[CheckResult, ...]:
        """Checks that reject the record."""
        return tuple(check for check in self.checks if check.severity == "reject")

    @property
    def warnings(self) -> tuple[CheckResult, ...]:
        """Checks that make the result less certain."""
        return tuple(check for check in self.checks if check.severity == "warn")

    def summary(self) -> str:
        """Return the findings as text, the worst first."""
        analysed = f"samples {self.first} to {self.last - 1}" if self.last > self.first else "no samples"
        head = (
            f"{'usable' if self.usable else 'not usable'}: {self.rows} samples, {self.duration:.6g} s, "
            f"{self.bad_percent:.3g} % without OP or PV, {analysed} analysed"
        )
        checks = (f"{check.severity}: {check.why}" for check in (*self.rejections, *self.warnings))
        return "\n".join([head, *checks])


def assess_quality(record: LoopRecord | Conditioned, period: float | None = None) -> Quality:
    """Apply every data check to a record.

    Parameters
    ----------
    record : LoopRecord or Conditioned
        A record of one loop, or one that is ready for analysis.
    period : float, optional
        Period of the oscillation [s]; cycles and samples per cycle are checked when it is given.

    Returns
    -------
    Quality
        Each check with its value, limit and remedy, and the segment to analyse.

    Raises
    ------
    ParameterError
        When `period` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord, assess_quality
    >>> t = np.arange(400.0)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(t / 6.1), pv=3 + np.cos(t / 6.1))
    >>> assess_quality(record, period=38.3).usable, assess_quality(record, period=200.0).rejections[0].name
    (True, 'cycles')
    """
    conditioned = record if isinstance(record, Conditioned) else condition(record)
    if period is not None:
        period = require_positive("period", period, "s")
    record, data = conditioned.record, CheckInput(conditioned, period)
    checks = tuple(check for check in (*_check_loop(data), *_check_storage(data)) if check is not None)
    usable = not any(check.severity == "reject" for check in checks)
    first, last = conditioned.first, conditioned.last
    return Quality(checks, usable, len(record), record.duration, record.missing_percent, first, last)


def _check_loop(data: CheckInput) -> Iterator[CheckResult | None]:
    """What the loop did: enough samples, cycles and movement, in automatic, with OP inside its limits."""
    record, part, masks = data.conditioned.record, data.part, data.conditioned.masks
    cut = data.is_cut_too_short
    yield check_length(len(part), len(record))
    if data.period is not None:
        yield check_cycles(part.duration, data.period)
    yield check_sampling(data.op, data.pv, record.dt, data.period)
    yield check_op_movement(part.op if len(part) else record.op)
    yield check_op_reversals(data.op, data.swings[0])
    yield check_pv_movement(record.op, record.pv, part.pv if len(part) else None)
    yield check_saturation(masks.at_limit, masks.clipped, is_cut_too_short=cut)
    yield check_manual(
        masks.manual, has_mode=record.auto is not None, in_steps=bool(masks.manual_steps.any()), is_cut_too_short=cut
    )
    yield check_frozen_pv(masks.frozen, is_cut_too_short=cut)
    missing = missing_mask(record.op, record.pv), missing_mask(part.op, part.pv)
    yield check_missing_values(*missing, record.dt, cut)
    yield check_op_scale(record.op, record.provenance.op_unit)
    yield check_resolution("OP", data.op, data.steps[0], data.conditioned.op_values, data.swings[0])
    if record.pv is not None:
        yield check_resolution("PV", data.pv, data.steps[1], data.conditioned.pv_values, data.swings[1])


def _check_storage(data: CheckInput) -> Iterator[CheckResult | None]:
    """What the historian and the reader did to the signals."""
    record, op, pv = data.conditioned.record, data.op, data.pv
    per_cycle = None if data.period is None else data.period / record.dt
    if record.pv is not None:
        yield check_compression(op, pv, data.steps, (data.cycle or data.part.duration) / record.dt)
        # The whole record, because a long hold of OP counts as manual and is cut out.
        yield check_exception_reporting(record.op, record.pv, data.steps, data.conditioned.masks.at_limit)
        yield check_held_values(op, pv, per_cycle)
        yield check_storage_rate(op, pv)
        if data.part.pv is not None:
            yield check_outages(data.part.op, data.part.pv, record.dt)
        yield check_moving_average(op, pv, record.dt, data.period)
        yield check_copied_data(op, pv, data.steps)
    origin = record.provenance
    yield check_clock_jumps(record.op, record.pv, origin.clock_jumps, origin.summer_time)
    yield check_outliers(record.pv, origin.outliers, record.samples_per_stored_value)
    yield check_averages(origin.interval_spread)
    yield check_resampled(origin.held_samples - origin.unchanged_samples, len(record), per_cycle)

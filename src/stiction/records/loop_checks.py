"""Checks of what the loop did: enough samples, cycles and movement, in automatic, with OP inside its limits."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import MIN_CYCLES, MIN_SAMPLES, CheckInput, CheckResult, check_maximum, check_minimum
from stiction.records.gaps import missing_mask
from stiction.records.quality.movement import count_reversals, detect_op_scale, last_value_correlation
from stiction.records.quality.quantisation import count_levels, peak_to_peak, robust_range
from stiction.records.runs import run_bounds, run_lengths

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["LOOP_CHECKS"]


def _length(data: CheckInput) -> CheckResult:
    """Samples of the longest usable segment."""
    fields: dict[str, float | str] = {"samples": len(data.record)}
    n, remedy = len(data.part), "record_hundreds"
    return check_minimum("length", n, "samples", warn=300, reject=MIN_SAMPLES, remedy=remedy, fields=fields)


def _cycles(data: CheckInput) -> CheckResult | None:
    """Cycles of the oscillation in the usable segment."""
    if data.period is None:
        return None
    count = data.part.duration / data.period
    fields: dict[str, float | str] = {"period_s": data.period}
    return check_minimum("cycles", count, "-", warn=8, reject=MIN_CYCLES, remedy="record_cycles", fields=fields)


def _sampling(data: CheckInput) -> CheckResult | None:
    """Samples per cycle; without a known cycle, the resemblance of a sample to the one before."""
    dt = data.record.dt
    if data.period is not None:
        count, is_short = data.period / dt, len(data.part) < 200
        reject = 6 if is_short else 4
        finding = "sampling_short" if is_short and count < reject else "sampling"
        return check_minimum(
            "sampling", count, "samples per cycle", warn=12, reject=reject, finding=finding, remedy="record_fast",
            fields={"interval_s": data.period / 40},
        )  # fmt: skip
    if data.record.pv is None or len(data.part) < MIN_SAMPLES:
        return None
    memory = max(last_value_correlation(data.op), last_value_correlation(data.pv))
    if memory >= 0.1:
        return None
    if memory < -0.6:  # a cycle of three samples has cos(2 pi / 3) = -0.5
        finding, remedy, fields = "sampling_alternating", "record_ten_times_as_fast", {"fastest_s": 3 * dt}
    else:
        finding, remedy, fields = "sampling_noise", "record_faster", {"fastest_s": 4 * dt}
    return check_minimum(
        "sampling", memory, "-", warn=0.1, reject=-0.6, finding=finding, remedy=remedy, fields={**fields}
    )


def _op_movement(data: CheckInput) -> CheckResult:
    """A constant OP says nothing about the valve."""
    moved = peak_to_peak(data.part.op if len(data.part) else data.record.op)
    return _movement("op", moved, "op_constant", "record_in_automatic")


def _pv_movement(data: CheckInput) -> CheckResult:
    """PV must be recorded, move, and be another signal than OP."""
    record = data.record
    if record.pv is None:
        return _movement("pv", 0.0, "pv_not_recorded", "record_pv")
    if np.array_equal(record.pv, record.op, equal_nan=True) and peak_to_peak(data.op) > 0.0:
        return _movement("pv", 0.0, "pv_equals_op", "name_pv")
    moved = peak_to_peak(record.pv if not len(data.part) or data.part.pv is None else data.part.pv)
    return _movement("pv", moved, "pv_constant", "repair_pv")


def _movement(name: str, moved: float, finding: str, remedy: str) -> CheckResult:
    """Reject a signal that does not move."""
    unit, result = "% of span" if name == "op" else "PV units", f"{name} movement"
    if moved > 0.0:
        return CheckResult(result, "ok", moved, 0.0, unit, f"{name}_movement")
    return CheckResult(result, "reject", moved, 0.0, unit, finding, remedy=remedy)


def _op_reversals(data: CheckInput, *, min_share: float = 0.15) -> CheckResult | None:
    """Reversals of OP by `min_share` of its robust range [-] and more: friction shows nowhere else."""
    if not peak_to_peak(data.op) > 0.0:
        return None
    count = count_reversals(data.op, min_share * robust_range(data.op))
    return check_minimum(
        "op reversals", count, "-", warn=2 * MIN_CYCLES, remedy="record_movement", fields={"time_count": count}
    )


def _saturation(data: CheckInput) -> CheckResult:
    """Time of OP at a limit: no feedback there, and a clipped OP need not be the one that the valve received."""
    excluded = " (excluded)" if data.masks.clipped.any() else ""
    return _excluded("saturation", data.masks.at_limit, 80, "saturation", "check_sizing", data, excluded=excluded)


def _manual(data: CheckInput) -> CheckResult:
    """Time in manual: no feedback there."""
    if data.record.auto is not None:
        finding = "manual_mode"
    else:
        finding = "manual_steps" if data.masks.manual_steps.any() else "manual_constant"
    return _excluded("manual", data.masks.manual, 90, finding, "record_in_automatic", data)


def _frozen_pv(data: CheckInput) -> CheckResult:
    """Time of a constant PV that is never constant elsewhere."""
    return _excluded("frozen pv", data.masks.frozen, 80, "frozen_pv", "repair_transmitter", data)


def _excluded(
    name: str, mask: NDArray[np.bool_], reject: float, finding: str, remedy: str, data: CheckInput, **fields: str
) -> CheckResult:
    """Warn above 5 % of excluded samples; reject above a share [%], or when the rest is too short."""
    result = check_maximum(
        name,
        100.0 * _mean(mask),
        "%",
        warn=5,
        reject=reject,
        finding=finding,
        fields={"segment_count": len(run_bounds(mask)), **fields},
    )
    if result.severity == "warn" and data.is_cut_too_short:
        return replace(result, severity="reject", remedy="record_longer")
    return replace(result, remedy=remedy if result.severity == "reject" else "")


def _missing_values(data: CheckInput) -> CheckResult:
    """Missing samples, the longest gap, and the samples filled in the usable segment."""
    missing, filled = missing_mask(data.record.op, data.record.pv), missing_mask(data.part.op, data.part.pv)
    percent, filled_percent = 100.0 * _mean(missing), 100.0 * _mean(filled)
    longest = int(run_lengths(run_bounds(missing)).max(initial=0)) * data.record.dt
    fields: dict[str, float | str] = {"missing_percent": percent, "longest_s": longest, "filled": int(filled.sum())}
    name, finding = "missing values", "missing_values" if percent else "no_missing_values"
    if filled_percent > 40.0:
        return CheckResult(name, "reject", filled_percent, 40.0, "%", finding, fields, "repair_historian")
    if percent > 2 and data.is_cut_too_short:
        return CheckResult(name, "reject", percent, 2, "%", finding, fields, "record_longer")
    return check_maximum(name, percent, "%", warn=2, finding=finding, fields=fields)


def _op_scale(data: CheckInput) -> CheckResult | None:
    """An OP that is not in % of span."""
    op = data.record.op[np.isfinite(data.record.op)]
    if op.size == 0:
        return None
    low, high, op_unit = float(op.min()), float(op.max()), data.record.provenance.op_unit
    scale = "unit" if op_unit else detect_op_scale(low, high)
    value = high if abs(high) >= abs(low) else low
    fields: dict[str, float | str] = {"low": low, "high": high, "op_unit": op_unit}
    if scale == "percent":
        return CheckResult("op scale", "ok", value, 100.0, "% of span", "op_scale", fields)
    return CheckResult("op scale", "warn", value, 100.0, "% of span", f"op_scale_{scale}", fields, "give_op_range")


def _op_resolution(data: CheckInput) -> CheckResult | None:
    """Quantisation steps that OP covers."""
    return _resolution("OP", data.op, data.steps[0], data.conditioned.op_values, 6)


def _pv_resolution(data: CheckInput) -> CheckResult | None:
    """Quantisation steps that PV covers: few look like stick and slip."""
    if data.record.pv is None:
        return None
    return _resolution("PV", data.pv, data.steps[1], data.conditioned.pv_values, 3)


def _resolution(
    signal: str, x: NDArray[np.float64], step: float, values: NDArray[np.float64], reject: float
) -> CheckResult | None:
    levels = count_levels(x, step, values)
    if np.isnan(levels):
        return None
    return check_minimum(
        f"{signal.lower()} resolution", levels, "steps", warn=20, reject=reject, finding="resolution",
        remedy="record_finer", fields={"signal": signal, "levels": levels},
    )  # fmt: skip


def _mean(mask: NDArray[np.bool_]) -> float:
    return float(np.mean(mask)) if mask.size else 0.0


LOOP_CHECKS: tuple[Callable[[CheckInput], CheckResult | None], ...] = (
    *(_length, _cycles, _sampling, _op_movement, _op_reversals, _pv_movement, _saturation, _manual, _frozen_pv),
    *(_missing_values, _op_scale, _op_resolution, _pv_resolution),
)
"""The checks, in the order in which they are reported."""

"""Numbers of one loop beside its verdict: time in each mode, control error, valve wear, severity and priority."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import ParameterError, require_finite, require_not_negative, require_positive
from stiction.records.gaps import interpolate_gaps
from stiction.records.quality.movement import count_reversals
from stiction.records.quality.quantisation import robust_range
from stiction.records.quality.saturation import find_saturation
from stiction.records.record import require_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["LoopMetrics", "compute_priority", "loop_metrics"]

SECONDS_PER_DAY = 86400.0


@dataclass(frozen=True, slots=True)
class LoopMetrics(Result):
    """Numbers of one loop. NaN is unknown: no mode, no set point, or no span of the PV is given."""

    tag: str
    """Tag of the loop."""
    automatic_share: float
    """Time in automatic [-]."""
    manual_share: float
    """Time in manual [-]."""
    saturated_share: float
    """Time with OP at a limit [-]."""
    missing_share: float
    """Time in which OP or PV is missing [-]."""
    error_mean_absolute: float
    """Integral of the absolute control error per hour, over one hour and the span [% of span]."""
    variability: float
    """Variability index: standard deviation of the control error over the span [% of span]."""
    valve_travel_per_day: float
    """Path length of the valve position, or of OP where the position is not recorded [% of span per day]."""
    reversals_per_day: float
    """Reversals of OP larger than `min_move` and its noise [1/day]."""
    oscillation_index: float
    """Autocorrelation of the main oscillation one period later, 0 where the loop does not oscillate [-]."""
    severity: float
    """How bad the loop is, from 0 to 1 [-]."""
    severity_parts: dict[str, float]
    """Part -> its size from 0 to 1 [-]: "error", "oscillation", "wear", "not in automatic", "saturated"."""

    def summary(self) -> str:
        """The loop in a sentence."""
        part = max(self.severity_parts, key=lambda name: self.severity_parts[name])
        return f"{self.tag}: severity {self.severity:.2f}, mostly {part} ({self.severity_parts[part]:.2f})."


def loop_metrics(
    record: LoopRecord,
    *,
    span: tuple[float, float] | None = None,
    oscillation_index: float = 0.0,
    min_move: float = 0.5,
    noise_factor: float = 6.0,
    error_limit: float = 5.0,
    reversals_limit: float = 2000.0,
) -> LoopMetrics:
    """Compute the numbers of one loop.

    Parameters
    ----------
    record : LoopRecord
        The record of one loop.
    span : (float, float), optional
        Range of the transmitter [engineering units]. Without it the control error is not compared.
    oscillation_index : float
        Autocorrelation of the loop's main oscillation one period later, as `LoopOscillation.height` has it [-].
    min_move : float
        Smallest move of OP that counts before and after a reversal [% of span].
    noise_factor : float
        Such a move is also at least this many standard deviations of the noise of OP, but never more than half of its
        swing [-].
    error_limit : float
        Standard deviation of the control error at which the part "error" of the severity is 0.63 [% of span].
    reversals_limit : float
        Reversals at which the part "wear" of the severity is 0.63 [1/day].

    Returns
    -------
    LoopMetrics
        The numbers.

    Raises
    ------
    ParameterError
        When the span is empty or a limit is not positive.

    Notes
    -----
    Severity = 1 - product of (1 - part) over the parts. "error" is 1 - exp(-variability / error_limit), "wear" is
    1 - exp(-reversals / reversals_limit), "oscillation" is the oscillation index, "not in automatic" and "saturated"
    are the shares of time, counted half because a person may have chosen them. An unknown part is 0. The noise of OP
    is measured from its third differences, which hold little of a swing of ten samples and more.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> wave = np.sin(2 * np.pi * np.arange(3600) / 60)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + 2 * wave, pv=30 + wave, sp=np.full(3600, 30.0))
    >>> metrics = loop_metrics(record, span=(0.0, 100.0), oscillation_index=1.0)
    >>> round(metrics.variability, 2), round(metrics.valve_travel_per_day), round(metrics.reversals_per_day)
    (0.71, 11515, 2880)
    """
    require_record(record)
    for name, value in (("min_move", min_move), ("error_limit", error_limit), ("reversals_limit", reversals_limit)):
        require_positive(name, value)
    require_not_negative("noise_factor", noise_factor)
    if span is not None and not span[1] > span[0]:
        raise ParameterError(f"span = ({span[0]:g}, {span[1]:g}) is an empty range; give lowest < highest.")
    days = record.duration / SECONDS_PER_DAY
    op = _without_gaps(record.op)
    stem = op if record.mv is None else _without_gaps(record.mv)
    travel = float(np.abs(np.diff(stem)).sum()) / days if stem.size > 1 else 0.0
    swing = robust_range(op) if op.size else 0.0
    counted = max(min_move, min(noise_factor * _noise(op), 0.5 * swing))
    reversals = count_reversals(op, counted) / days if swing > 0.0 else 0.0
    automatic = float("nan") if record.auto is None else float(record.auto.mean())
    saturated = float(_at_limit(record).mean()) if len(record) else 0.0
    mean_absolute, variability = _error_over_span(record, span)
    index = min(1.0, max(0.0, require_finite("oscillation_index", oscillation_index)))
    parts = {
        "error": 0.0 if np.isnan(variability) else 1.0 - float(np.exp(-variability / error_limit)),
        "oscillation": index,
        "wear": 1.0 - float(np.exp(-reversals / reversals_limit)),
        "not in automatic": 0.0 if np.isnan(automatic) else 0.5 * (1.0 - automatic),
        "saturated": 0.5 * saturated,
    }
    severity = 1.0 - float(np.prod([1.0 - part for part in parts.values()]))
    return LoopMetrics(
        record.tag, automatic, 1.0 - automatic, saturated, record.missing_percent / 100.0, mean_absolute,
        variability=variability, valve_travel_per_day=travel, reversals_per_day=reversals, oscillation_index=index,
        severity=severity, severity_parts=parts,
    )  # fmt: skip


def compute_priority(severity: float, confidence: float, importance: float = 1.0) -> float:
    """Compute the priority by which loops are ranked: severity times confidence times importance.

    `severity`: severity of the loop, from 0 to 1 [-]. `confidence`: probability of the main finding, from 0 to 1 [-].
    `importance`: weight that the plant gives the loop [-]. Returns the priority [-]; from 0 to 1 where the importance
    is 1. Raises ParameterError when a number is outside its limits.

    Examples
    --------
    >>> compute_priority(0.5, 0.8, importance=2.0)
    0.8
    """
    for name, value in (("severity", severity), ("confidence", confidence)):
        if require_not_negative(name, value) > 1.0:
            raise ParameterError(f"{name} = {value:g} is above 1; give a value from 0 to 1.")
    return severity * confidence * require_not_negative("importance", importance)


def _at_limit(record: LoopRecord) -> NDArray[np.bool_]:
    """Where OP rests at a limit in automatic."""
    from stiction.diagnosis.loop_state import find_saturated

    mask = find_saturation(record.op, auto=record.auto)
    if record.op_in_percent:
        at_limit = find_saturated(record.op)
        mask |= at_limit if record.auto is None else at_limit & record.auto
    return mask


def _error_over_span(record: LoopRecord, span: tuple[float, float] | None) -> tuple[float, float]:
    """Mean absolute control error and its standard deviation over the span [% of span]; NaN where unknown."""
    if span is None or record.pv is None or record.sp is None:
        return float("nan"), float("nan")
    error = (record.sp - record.pv)[np.isfinite(record.sp - record.pv)] * 100.0 / (span[1] - span[0])
    return (float(np.abs(error).mean()), float(error.std())) if error.size else (float("nan"), float("nan"))


def _noise(x: NDArray[np.float64]) -> float:
    """Standard deviation of the white noise of a signal, from the median of its third differences [unit of `x`]."""
    differences = np.abs(np.diff(x, 3))
    return float(1.4826 * np.median(differences) / np.sqrt(20.0)) if differences.size else 0.0


def _without_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gaps bridged by straight lines; empty where nothing is known."""
    return interpolate_gaps(x) if np.isfinite(x).any() else np.empty(0)

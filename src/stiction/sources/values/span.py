"""Controller output and valve position in % of span: by unit, by a given range, or by the data; else in doubt."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.records.provenance import UNKNOWN_UNIT
from stiction.records.quality.op_scale import detect_op_scale
from stiction.records.quality.outliers import find_outliers
from stiction.sources.roles.vocabulary import FRACTION_UNITS, OTHER_OUTPUT_UNITS, PERCENT_UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Span = tuple[float, float]

__all__ = ["Percent", "op_to_percent", "position_to_percent"]

STANDARD_SIGNALS = {
    "MA": (4.0, 20.0),
    **dict.fromkeys(("PSI", "PSIG"), (3.0, 15.0)),
    **dict.fromkeys(("BAR", "BARG"), (0.2, 1.0)),
    "KPA": (20.0, 100.0),
    **dict.fromkeys(FRACTION_UNITS, (0.0, 1.0)),
}
"""Unit of a standard signal to a valve -> its value at 0 and at 100 % (IEC 60381-1 and -2) [unit]."""
FULL_COUNTS = (1000.0, 4095.0, 10000.0, 16383.0, 27648.0, 32000.0, 32767.0, 65535.0)
"""Counts at 100 % of usual converters; 0 is at 0 % [counts]."""
CURRENT_RANGE = 3.8, 20.5
"""Range of a current that is no fault signal, by NAMUR NE 43 [mA]."""
MAX_DISTANCE_RATIO = 0.25
"""How much nearer OP and position must come in one span than in any other, before the data show the span [-]."""
MIN_FRACTION = 0.05
"""Median from which an OP between 0 and 1 is a fraction of span; in %, the valve would be all but shut [-]."""
_LOOKS = {"fraction": "like a fraction of span", "normalised": "normalised", "other": "like no percentage"}


class Percent(NamedTuple):
    """A signal in % of span, as far as its range is known."""

    values: NDArray[np.float64]
    """The signal, shape (n_samples,): [% of span] when `unit` is empty, else as recorded [`unit`]."""
    unit: str
    """Empty when the values are in % of span; else their unit, or `UNKNOWN_UNIT`."""
    notes: list[str]
    """What was converted or is in doubt, a sentence each."""


def op_to_percent(
    op: NDArray[np.float64],
    unit: str = "",
    *,
    op_range: Span | None = None,
    position: NDArray[np.float64] | None = None,
    position_unit: str = "",
) -> Percent:
    """Convert OP [unit] to % of span by its range or a position in %; it keeps a unit when the range is in doubt."""
    if op_range is not None or not np.isfinite(op).any():
        return Percent(_scale_by_range(op, op_range or (0.0, 100.0)), "", [])
    if known := _by_unit(op, unit, "OP", "op_range"):
        return known
    low, high = _limits(op)
    lies, written = f"OP lies between {low:.4g} and {high:.4g}", unit.upper()
    left = "it is not converted, so S and J are in its unit; to convert it, give the range of OP (op_range), "
    if written in STANDARD_SIGNALS:
        zero, full = STANDARD_SIGNALS[written]
        unlike = f"unlike a signal of {zero:g} to {full:g} {unit}"
        return Percent(op, unit, [f"{lies}, {unlike}: {left}{zero:g} to {full:g}."])
    if written in ("", *OTHER_OUTPUT_UNITS) and (by_ends := _by_ends(op, unit, low, high)):
        return by_ends
    if written in OTHER_OUTPUT_UNITS:
        return Percent(op, unit, [f"OP is given in {unit}: {left}low to high."])
    scale = detect_op_scale(low, high)
    may_be_current = not written and low >= CURRENT_RANGE[0] and high <= CURRENT_RANGE[1]
    span = None if written else _span_by_position(op, position, position_unit)
    if scale == "fraction" and not written and not span and np.nanmedian(op) >= MIN_FRACTION:
        note = f"{lies} and is taken as a fraction of span; if it is in %, give the range of OP (op_range), 0 to 100."
        return Percent(_scale(op, (0.0, 1.0)), "", [note])
    if span and (may_be_current or scale in ("fraction", "other")):
        ends = f"{span[0]:g} is taken as 0 % and {span[1]:g} as 100 %"
        note = f"OP agrees with the valve position when {ends}; give the range of OP (op_range) if that is wrong."
        return Percent(_scale(op, span), "", [note] if span != (0.0, 100.0) else [])
    if scale in _LOOKS:
        hint = "0 to 1" if scale == "fraction" else "low to high"
        doubt = "" if written in PERCENT_UNITS else UNKNOWN_UNIT
        return Percent(op, doubt, [f"{lies} and looks {_LOOKS[scale]}: {left}{hint}."])
    if not may_be_current:
        return Percent(op, "", [])
    hint = "0 to 100 if it is in %, 4 to 20 if it is in mA."
    return Percent(op, UNKNOWN_UNIT, [f"{lies} without a unit and may be in % or mA: {left}{hint}"])


def position_to_percent(
    mv: NDArray[np.float64],
    unit: str,
    op: NDArray[np.float64],
    *,
    mv_range: Span | None = None,
    op_range: Span | None = None,
) -> Percent:
    """Convert the position [unit] to % of span by its range or OP's; without, it stays, and a note tells."""
    if mv_range is not None:
        return Percent(_scale(mv, mv_range), "", [])
    if not (np.isfinite(mv) & np.isfinite(op)).any():
        return Percent(mv, "", [])
    if known := _by_unit(mv, unit, "The valve position", "mv_range"):
        return known
    low, high = _limits(mv)
    spans = [span for span in (op_range, (4.0, 20.0), (0.0, 1.0)) if span]
    near = [span for span in spans if _distance(_scale(mv, span), op) < MAX_DISTANCE_RATIO * _distance(mv, op)]
    is_off = detect_op_scale(*_limits(op)) == "percent" and (low < -10.0 or high > 110.0)
    if not near and not is_off and unit.upper() not in OTHER_OUTPUT_UNITS:
        return Percent(mv, "", [])
    lies = f"The valve position lies between {low:.4g} and {high:.4g}"
    if near:
        ends = "{:g} to {:g}".format(*near[0])
        note = f"{lies} and agrees with OP as a signal of {ends}: it is converted; if that is wrong, give the range of "
        return Percent(_scale(mv, near[0]), "", [f"{note}the valve position (mv_range)."])
    note = f"{lies}; it is taken as % of span. To convert it, give the range of the valve position (mv_range)"
    return Percent(mv, "", [f"{note}, low to high."])


def _by_unit(
    values: NDArray[np.float64], unit: str, name: str, option: str, *, overrange: float = 0.1
) -> Percent | None:
    """Values in % of span by the unit of a standard signal; None when there is none, or they run over it too far."""
    span = STANDARD_SIGNALS.get(unit.upper())
    if span is None:
        return None
    percent = _scale(values, span)
    low, high = _limits(percent)
    if low < -100.0 * overrange or high > 100.0 * (1.0 + overrange):
        return None
    note = f"{name} is given in {unit}: {span[0]:g} {unit} are taken as 0 % and {span[1]:g} {unit} as 100 %; "
    note += f"give the range ({option}) if that is wrong."
    if unit.upper() in FRACTION_UNITS:
        note = f"{name} is given in {unit.lower()} and was multiplied by 100."
    return Percent(percent, "", [note])


def _scale_by_range(op: NDArray[np.float64], span: Span) -> NDArray[np.float64]:
    """Scale OP by a given range; refuse a range that OP leaves by more than a tenth."""
    percent = _scale(op, span)
    if not np.isfinite(op).any():
        return percent
    low, high = _limits(op)
    if _scale(np.array([low]), span)[0] < -10.0 or _scale(np.array([high]), span)[0] > 110.0:
        raise RecordError(
            "", Setting("op_range", span), f" does not fit OP, which lies between {low:.4g} and {high:.4g}",
            remedy="give OP at 0 % and at 100 % of span in the unit of the column",
        )  # fmt: skip
    return percent


def _by_ends(op: NDArray[np.float64], unit: str, low: float, high: float) -> Percent | None:
    """Values in % of span where OP rests at both ends of a current or of a converter's counts; else None."""
    for span, name in (((4.0, 20.0), "mA"), *(((0.0, full), "counts") for full in FULL_COUNTS)):
        near = 1e-3 * (span[1] - span[0])
        is_other = unit.upper() not in ("", name.upper()) or abs(low - span[0]) > 10 * near
        if (
            not is_other
            and abs(high - span[1]) < 30 * near
            and all(np.count_nonzero(np.abs(op - end) < near) >= 3 for end in span)
        ):
            note = (
                f"OP lies between {low:.4g} and {high:.4g} and rests at {span[0]:g} and at {span[1]:g}: it is taken as "
            )
            note += f"{name}; if that is wrong, give the range of OP (op_range)."
            return Percent(_scale(op, span), "", [note])
    return None


def _span_by_position(op: NDArray[np.float64], position: NDArray[np.float64] | None, position_unit: str) -> Span | None:
    """Span of OP by a position in %; None when the position does not show it."""
    if position is None or not (np.isfinite(position) & np.isfinite(op)).any():
        return None
    if position_unit.upper() not in PERCENT_UNITS and (position_unit or _limits(position)[1] <= CURRENT_RANGE[1]):
        return None
    spans = ((0.0, 100.0), (4.0, 20.0), (0.0, 1.0), *((0.0, full) for full in FULL_COUNTS))
    distances = {span: _distance(_scale(op, span), position) for span in spans}
    best, second = sorted(distances, key=lambda span: distances[span])[:2]
    return best if distances[best] < MAX_DISTANCE_RATIO * distances[second] else None


def _distance(x: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Median distance of two signals."""
    return float(np.nanmedian(np.abs(x - other)))


def _limits(values: NDArray[np.float64]) -> Span:
    """Smallest and largest value without those that stand alone far from all others."""
    usual = values[np.isfinite(values) & ~find_outliers(values)]
    return float(usual.min()), float(usual.max())


def _scale(values: NDArray[np.float64], span: Span) -> NDArray[np.float64]:
    return values if span == (0.0, 100.0) else (values - span[0]) * (100.0 / (span[1] - span[0]))

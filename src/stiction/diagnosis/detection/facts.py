"""The methods, what each needs and where it holds; and all of them asked at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.diagnosis.detection.damarla_regression import damarla_regression
from stiction.diagnosis.detection.haegglund_shape import haegglund_shape
from stiction.diagnosis.detection.he_curve_fit import he_curve_fit
from stiction.diagnosis.detection.horch_correlation import horch_correlation
from stiction.diagnosis.detection.horch_histogram import horch_histogram
from stiction.diagnosis.detection.kano_patterns import kano_patterns
from stiction.diagnosis.detection.nonlinearity import nonlinearity
from stiction.diagnosis.detection.rossi_scali import rossi_scali
from stiction.diagnosis.detection.singhal_salsbury import singhal_salsbury
from stiction.diagnosis.detection.yamashita import yamashita

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["FACTS", "MethodFacts", "detect_all"]


@dataclass(frozen=True, slots=True)
class MethodFacts:
    """What a method needs and where it holds."""

    function: Callable[[LoopRecord, Oscillation], Evidence]
    """The method."""
    signals: tuple[str, ...]
    """Signals it looks at."""
    holds_for: str
    """Processes or loops for which it is valid, in words."""
    asks: str
    """The question it answers, in words."""
    source: str
    """Key of the source in references.bib."""


_SELF_REGULATING = "self-regulating process"

FACTS: dict[str, MethodFacts] = {
    "he_curve_fit": MethodFacts(
        he_curve_fit, ("op", "pv"), "any process of known type", "Is OP (integrating: PV) a triangle?", source="he2007"
    ),
    "haegglund_shape": MethodFacts(
        haegglund_shape, ("pv",), _SELF_REGULATING, "Is the error a square?", source="haegglund2011"
    ),
    "horch_correlation": MethodFacts(
        horch_correlation,
        ("op", "pv"),
        f"PI control, {_SELF_REGULATING}",
        "Are OP and PV in quadrature?",
        source="horch1999",
    ),
    "yamashita": MethodFacts(
        yamashita, ("op", "pv"), "flow, pressure", "Does OP move while the flow is still?", source="yamashita2006"
    ),
    "rossi_scali": MethodFacts(
        rossi_scali, ("pv",), _SELF_REGULATING, "Is the error a relay's response?", source="rossi2005"
    ),
    "singhal_salsbury": MethodFacts(
        singhal_salsbury,
        ("pv",),
        _SELF_REGULATING,
        "Does the error build up slowly and fall at once?",
        source="singhal2005",
    ),
    "kano_patterns": MethodFacts(
        kano_patterns,
        ("op", "pv"),
        "flow, pressure, level",
        "How long is the valve still while OP moves?",
        source="kano2004",
    ),
    "damarla_regression": MethodFacts(
        damarla_regression, ("op", "pv"), _SELF_REGULATING, "How often does OP slope and PV not?", source="damarla2022"
    ),
    "horch_histogram": MethodFacts(
        horch_histogram, ("pv",), "integrating process", "Has PV's second derivative one hump?", source="horch2006"
    ),
    "nonlinearity": MethodFacts(
        nonlinearity, ("pv",), "any process", "Is anything in the loop nonlinear?", source="thornhill2005"
    ),
}
"""Method -> facts, in the order of the evidence table."""


def detect_all(record: LoopRecord, oscillation: Oscillation) -> tuple[Evidence, ...]:
    """Ask every method; one that cannot answer says so in its row.

    Parameters
    ----------
    record : LoopRecord
        The loop.
    oscillation : Oscillation
        What `find_oscillation` says of the record.

    Returns
    -------
    tuple of Evidence
        One row per method of `FACTS`, in that order; an index that cannot be computed is NaN and not valid.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.diagnosis.oscillation import find_oscillation
    >>> from stiction.records.record import LoopRecord
    >>> phase = np.arange(2000) % 50 / 50
    >>> op, pv = 4 * np.abs(phase - 0.5), np.where(phase < 0.5, 3.0, 1.0)
    >>> record = LoopRecord("FC1", 1.0, op=op, pv=pv, loop_type="flow")
    >>> rows = detect_all(record, find_oscillation(record))
    >>> {row.vote for row in rows if row.method in ("he_curve_fit", "haegglund_shape", "horch_correlation")}
    {'stiction'}
    """
    return tuple(facts.function(record, oscillation) for facts in FACTS.values())

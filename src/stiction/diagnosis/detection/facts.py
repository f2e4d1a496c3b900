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
    rule: str
    """Index and the limits from which it votes."""
    source: str
    """Key of the source in references.bib."""


_SELF_REGULATING = "self-regulating process"

FACTS: dict[str, MethodFacts] = {
    "he_curve_fit": MethodFacts(
        he_curve_fit, signals=("op", "pv"), holds_for="any process of known type",
        asks="Is OP (integrating: PV) a triangle?", rule="SI: stiction from 0.6, none to 0.4", source="he2007",
    ),
    "haegglund_shape": MethodFacts(
        haegglund_shape, signals=("pv",), holds_for=_SELF_REGULATING, asks="Is the error a square?",
        rule="I: stiction from 0, none below", source="haegglund2011",
    ),
    "horch_correlation": MethodFacts(
        horch_correlation, signals=("op", "pv"), holds_for=f"PI control, {_SELF_REGULATING}",
        asks="Are OP and PV in quadrature?",
        rule="smaller phase offset over 90 degrees: stiction from 2/3, none where both are to 1/3", source="horch1999",
    ),
    "yamashita": MethodFacts(
        yamashita, signals=("op", "pv", "mv"), holds_for="flow, pressure", asks="Does OP move while the flow is still?",
        rule="rho_3: stiction from 0.25, none below", source="yamashita2006",
    ),
    "rossi_scali": MethodFacts(
        rossi_scali, signals=("pv",), holds_for=_SELF_REGULATING, asks="Is the error a relay's response?",
        rule="S_I: stiction from 0.21, none to -0.21", source="rossi2005",
    ),
    "singhal_salsbury": MethodFacts(
        singhal_salsbury, signals=("pv",), holds_for=_SELF_REGULATING,
        asks="Does the error build up slowly and fall at once?",
        rule="R: stiction from 1 + delta, none to 1 + delta / 2, delta from the noise", source="singhal2005",
    ),
    "kano_patterns": MethodFacts(
        kano_patterns, signals=("op", "pv", "mv"), holds_for="flow, pressure, level",
        asks="How long is the valve still while OP moves?", rule="rho: stiction from 0.5, none to 0.41",
        source="kano2004",
    ),
    "damarla_regression": MethodFacts(
        damarla_regression, signals=("op", "pv"), holds_for=_SELF_REGULATING,
        asks="How often does OP have a slope and PV not?",
        rule="share of windows: stiction three standard errors above chance (0.126), none to chance",
        source="damarla2022",
    ),
    "horch_histogram": MethodFacts(
        horch_histogram, signals=("pv",), holds_for="integrating process", asks="Has PV's second derivative one hump?",
        rule="misfit of two humps over both: stiction from 0.55, none to 0.45", source="horch2006",
    ),
    "nonlinearity": MethodFacts(
        nonlinearity, signals=("pv",), holds_for="any process", asks="Is anything in the loop nonlinear?",
        rule="N: nonlinear from 1; a low N does not exclude stiction", source="thornhill2005",
    ),
}  # fmt: skip
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
    >>> from stiction.diagnosis.detection import detect_all
    >>> from stiction.diagnosis.oscillation import find_oscillation
    >>> from stiction.records import LoopRecord
    >>> phase = np.arange(2000) % 50 / 50
    >>> op, pv = 4 * np.abs(phase - 0.5), np.where(phase < 0.5, 3.0, 1.0)
    >>> record = LoopRecord("FC1", 1.0, op=op, pv=pv, loop_type="flow")
    >>> rows = detect_all(record, find_oscillation(record))
    >>> {row.vote for row in rows if row.method in ("he_curve_fit", "haegglund_shape", "horch_correlation")}
    {'stiction'}
    """
    return tuple(facts.function(record, oscillation) for facts in FACTS.values())

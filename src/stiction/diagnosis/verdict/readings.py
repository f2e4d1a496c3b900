"""One diagnosis of a record whose quality codes can be read in several ways."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.diagnosis.segment import NAME_CODES
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.display.number_format import format_probability

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["compare_readings"]


def compare_readings(found: Sequence[Diagnosis]) -> Diagnosis:
    """Give the first of several diagnoses where all verdicts are equal; else one that asks for the good codes.

    Each is the diagnosis of the same record, by one reading of its quality codes (`Provenance.quality_reading`).
    """
    first = found[0]
    if len(found) == 1:
        return first
    read = [one.record.provenance.quality_reading for one in found]
    if all(one.verdict == first.verdict for one in found):
        origin = first.record.provenance
        note = f"The verdict is the same with each reading of the quality codes: {' '.join(read[1:])}"
        origin = replace(origin, assumptions=(*origin.assumptions, note))
        return replace(first, segment=replace(first.segment, record=replace(first.record, provenance=origin)))
    given = " ".join(
        f"{text} Verdict: {one.verdict.replace('_', ' ')}, probability {format_probability(one.probability)}."
        for text, one in zip(read, found, strict=True)
    )
    why = f"The quality codes can be read in {len(found)} ways, with different verdicts; {NAME_CODES} {given}"
    state = replace(first.loop_state, state="bad_data", share=1.0, rejects=(why,))
    segment = replace(first.segment, loop_state=state)
    return Diagnosis(segment, "undecided", first.prior, prior=first.prior, costs=first.costs)

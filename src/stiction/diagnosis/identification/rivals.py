"""By how much the likeliest sticky valve beats good ones that have something a straight one has not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.diagnosis.identification.characteristic import bent_valve
from stiction.diagnosis.identification.contest import vuong
from stiction.diagnosis.identification.gated_past import gated_past
from stiction.diagnosis.identification.likelihood import stem_of
from stiction.diagnosis.identification.outside_wave import outside_wave
from stiction.diagnosis.identification.relaxation import relaxation

if TYPE_CHECKING:
    from stiction.diagnosis.identification.contest import Contest
    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["over_rivals"]


def over_rivals(prediction: Prediction, contest: Contest, period: float | None) -> dict[str, Any]:
    """Compare the likeliest valve with good ones: bent, told a gated past, or beside an oscillation from outside.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    contest : Contest
        The likeliest valve.
    period : float or None
        Period of the oscillation [samples of the PV], where there is one.

    Returns
    -------
    dict
        What `Identification` says of them, by its names; nothing of a wave where none can be told.
    """
    bent, rival = bent_valve(prediction)
    beats_bent, likelier_than_bent = contest.over(rival)
    beats_gated, likelier_than_gated = contest.over(gated_past(prediction))
    beats_relaxation, likelier_than_relaxation = contest.over(relaxation(prediction))
    said = {
        "bent": bent,
        "beats_bent": beats_bent,
        "likelier_than_bent": likelier_than_bent,
        "beats_gated": beats_gated,
        "likelier_than_gated": likelier_than_gated,
        "beats_relaxation": beats_relaxation,
        "likelier_than_relaxation": likelier_than_relaxation,
    }
    if period is None:
        return said
    wave = outside_wave(prediction, period, stem_of(prediction, contest.best))
    if wave is None:
        return said
    beats_wave, likelier_than_wave = contest.over(wave.good)
    variance = float(wave.sticky.sum()) / prediction.samples
    beats_beside_wave, likelier_beside_wave = vuong((wave.good.error - wave.sticky) / variance, -prediction.op_order)
    return said | {
        "beats_wave": beats_wave,
        "likelier_than_wave": likelier_than_wave,
        "beats_beside_wave": beats_beside_wave,
        "likelier_beside_wave": likelier_beside_wave,
    }

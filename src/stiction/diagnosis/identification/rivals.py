"""By how much the likeliest sticky valve beats good ones, straight or with something that makes them look like it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.diagnosis.identification.characteristic import bent_valve
from stiction.diagnosis.identification.contest import vuong
from stiction.diagnosis.identification.gated_past import gated_past
from stiction.diagnosis.identification.likelihood import stem_of
from stiction.diagnosis.identification.outside_wave import outside_wave
from stiction.diagnosis.identification.relaxation import relaxation
from stiction.diagnosis.identified import Rival

if TYPE_CHECKING:
    from stiction.diagnosis.identification.contest import Contest
    from stiction.diagnosis.identification.likelihood import Prediction
    from stiction.diagnosis.identified import Explanation

__all__ = ["over_rivals"]


def over_rivals(prediction: Prediction, contest: Contest, period: float | None) -> tuple[dict[Explanation, Rival], str]:
    """Compare the likeliest valve with good ones: straight, bent, told a gated past, or beside what is from outside.

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
    tuple of dict and str
        By how much it beats each, nothing of a wave where none can be told; and the likeliest bent characteristic.
    """
    bent, bent_one = bent_valve(prediction)
    rivals: dict[Explanation, Rival] = {
        "good": Rival(float(contest.worse[-1]), contest.likelier_than_good()),
        "bent": contest.over(bent_one),
        "gated": contest.over(gated_past(prediction)),
        "relaxation": contest.over(relaxation(prediction)),
    }
    wave = None if period is None else outside_wave(prediction, period, stem_of(prediction, contest.best))
    if wave is not None:
        variance = float(wave.sticky.sum()) / prediction.samples
        rivals["wave"] = contest.over(wave.good)
        rivals["beside_wave"] = vuong((wave.good.error - wave.sticky) / variance, -prediction.op_order)
    return rivals, bent

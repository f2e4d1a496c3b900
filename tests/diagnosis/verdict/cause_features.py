"""Candidates for what the verdict weighs when it names causes: one row of numbers for each record.

Not used by `diagnose` yet: a multinomial logistic regression on these rows names 0.83 of the simulated causes
(fivefold, 1 120 loops, seed 11), but 19 or 20 of the 23 real loops only.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.oscillation import control_error
from stiction.diagnosis.verdict.steadiness import amplitude_spread

from .own_cycle import own_cycle, ultimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Identification, Oscillation
    from stiction.records.quality import Quality
    from stiction.records.record import LoopRecord

__all__ = ["Features", "features"]

LEAST_FIT = 0.02
"""Share explained below which a comparison weighs no less [-]."""
PERIOD_WEIGHT = 3.0
"""How much more the comparison about the period of an oscillating loop weighs [-]."""
SPIKE = 6.0
"""Distance of a spike from its neighbours, in robust standard deviations of such distances [-]."""


class Features(NamedTuple):
    """What the probabilities are computed from."""

    band: float
    """S over the OP's swing, the average of the comparisons, held at 0.7 [-]."""
    floor: float
    """Lower end of S's interval over the swing, held at 0.5 [-]."""
    advantage: float
    """ln(error of a good valve / error of the sticky one), held at 0.7 each [-]."""
    grip: float
    """Band times the share of the PV that the sticky valve explains [-]."""
    fit: float
    """Share of the PV that the sticky valve explains, in the comparison that speaks [-]."""
    fit_linear: float
    """The same for a good valve [-]."""
    gain_in_fit: float
    """ln(error of a good valve / error of the sticky one) of the comparison that speaks, over 3, held at 1 [-]."""
    best_stretch: float
    """The largest of that over the stretches of the record [-]."""
    jump: float
    """J over S [-]."""
    integrating: float
    """1 where the process found integrates."""
    oscillating: float
    """1 where the loop oscillates."""
    regularity: float
    """Regularity of the oscillation over 10 [-]."""
    wander: float
    """Spread of its amplitude from period to period, beyond what noise explains, held at 1 [-]."""
    unknown_wander: float
    """1 where there are too few periods for that."""
    margin: float
    """1 / gain margin with a good valve, held at 1.5; 0 where it is not known [-]."""
    at_limit: float
    """How near the oscillation's period is to that at the limit of stability, 1 where they are equal [-]."""
    own_period: float
    """How near the period of the loop identified is to the record's, 1 where they are equal, 0 where it rests [-]."""
    own_amplitude: float
    """The same of the OP's amplitude [-]."""
    controller: float
    """Share of the OP that the controller found explains, held at 0 [-]."""
    saturated: float
    """Share of the samples with the OP at a limit [-]."""
    coarse: float
    """Steps of the PV's resolution to its swing, as 1 / steps [-]."""
    still: float
    """Share of the samples in which the PV repeats its last value while OP moves [-]."""
    spikes: float
    """Share of the samples in which the PV jumps away and back, times 20, held at 1 [-]."""
    set_point: float
    """Share of the PV's movement that the set point makes, held at 1 [-]."""
    shape_op: float
    """He's index where it is valid, else 0.5 [-]."""
    shape_pv: float
    """Haegglund's index, halved about 0.5, where it is valid, else 0.5 [-]."""
    votes: float
    """Share of the valid methods that vote for stiction, less that against [-]."""


def features(
    record: LoopRecord,
    found: Sequence[Identification],
    speaks: int,
    oscillation: Oscillation,
    evidence: Sequence[Evidence],
    quality: Quality,
) -> Features:
    """Put one record into a row.

    Parameters
    ----------
    record : LoopRecord
        The record as analysed.
    found : sequence of Identification
        One per comparison; where there are two, the first is the one about the period.
    speaks : int
        Which of them speaks.
    oscillation : Oscillation
        Whether and how the loop oscillates.
    evidence : sequence of Evidence
        What each method says.
    quality : Quality
        What the data are worth.

    Returns
    -------
    Features
        The row.
    """
    main = found[speaks]
    op = record.op[np.isfinite(record.op)]
    swing = float(np.ptp(op))
    band, advantage, fit, floor = _compared(found, swing, oscillating=oscillation.oscillating)
    spread, by_noise = amplitude_spread(record, oscillation) if oscillation.oscillating else (math.inf, 0.0)
    controller = fit_controller(record)
    limit = None if main.linear is None else ultimate(main.linear, controller, record.dt)
    period = oscillation.period if oscillation.oscillating else math.nan
    own = own_cycle(main, controller, period, record.dt) if math.isfinite(period) else None
    rows = {row.method: row for row in evidence if row.valid and math.isfinite(row.index)}
    votes = [(row.vote == "stiction") - (row.vote == "no_stiction") for row in evidence if row.valid]
    at_limit = [gate.value for gate in quality.gates if gate.name == "saturation"]
    coarse, still, spikes = _sensor(record)
    return Features(
        band=min(band, 0.7),
        floor=min(floor, 0.5),
        advantage=advantage,
        grip=band * fit,
        fit=max(main.fit / 100.0, 0.0),
        fit_linear=max(main.fit_linear / 100.0, 0.0),
        gain_in_fit=_better(main.fit, main.fit_linear),
        best_stretch=max((_better(one.fit, one.fit_linear) for one in main.stretches), default=0.0),
        jump=main.J / main.S if main.S > 0.0 else 0.0,
        integrating=float(main.process.integrating),
        oscillating=float(oscillation.oscillating),
        regularity=min(oscillation.regularity, 10.0) / 10.0 if math.isfinite(oscillation.regularity) else 0.0,
        wander=min(max(spread - 2.0 * by_noise, 0.0), 1.0) if math.isfinite(spread) else 0.0,
        unknown_wander=float(not math.isfinite(spread)),
        margin=0.0 if limit is None else min(1.0 / max(limit[0], 1e-3), 1.5),
        at_limit=_near(period, limit[1]) if limit is not None else 0.0,
        own_period=_near(period, own.period) if own is not None else 0.0,
        own_amplitude=_near(oscillation.amplitude_op, own.amplitude_op) if own is not None else 0.0,
        controller=min(max(controller.fit, 0.0), 1.0) if math.isfinite(controller.fit) else 0.0,
        saturated=at_limit[0] / 100.0 if at_limit else 0.0,
        coarse=coarse,
        still=still,
        spikes=spikes,
        set_point=_set_point(record),
        shape_op=rows["he_curve_fit"].index if "he_curve_fit" in rows else 0.5,
        shape_pv=0.5 + 0.5 * rows["haegglund_shape"].index if "haegglund_shape" in rows else 0.5,
        votes=sum(votes) / len(votes) if votes else 0.0,
    )


def _compared(found: Sequence[Identification], swing: float, *, oscillating: bool) -> tuple[float, ...]:
    """Band, advantage, fit and floor, averaged over the comparisons by the share that each explains."""
    weights = np.array([max(one.fit / 100.0, LEAST_FIT) for one in found])
    if oscillating and len(found) > 1:
        weights[0] *= PERIOD_WEIGHT
    rows = np.array(
        [
            (
                one.S / swing,
                min(3.0 * _better(one.fit, one.fit_linear), 0.7),
                max(one.fit / 100.0, 0.0),
                one.S_low / swing,
            )
            for one in found
        ]
    )
    return tuple(float(x) for x in weights @ rows / weights.sum())


def _better(fit: float, fit_linear: float) -> float:
    """Log of what a good valve leaves over what the sticky one does, over 3, between 0 and 1."""
    left, left_linear = (max(1.0 - share / 100.0, 1e-3) for share in (fit, fit_linear))
    return min(max(math.log(left_linear / left), 0.0) / 3.0, 1.0)


def _near(one: float, other: float) -> float:
    """1 where two positive numbers are equal, 0.37 where they are a factor of 1.4 apart."""
    if not (one > 0.0 and other > 0.0 and math.isfinite(one) and math.isfinite(other)):
        return 0.0
    return math.exp(-3.0 * abs(math.log(one / other)))


def _sensor(record: LoopRecord) -> tuple[float, float, float]:
    """Coarseness, stillness and spikes of the PV."""
    assert record.pv is not None
    pv, op = record.pv[np.isfinite(record.pv)], record.op
    if pv.size < 10:
        return 0.0, 0.0, 0.0
    values = np.unique(pv)
    swing = float(np.subtract(*np.percentile(pv, (99, 1)))) or float(np.ptp(pv))
    coarse = 0.0
    if 1 < values.size < 0.5 * pv.size and swing > 0.0:
        gaps = np.diff(values)
        coarse = min(float(np.percentile(gaps, 5)) / swing, 1.0)
    still = float(np.mean((np.diff(record.pv) == 0.0) & (np.diff(op) != 0.0)))
    away = pv[1:-1] - 0.5 * (pv[2:] + pv[:-2])
    size = 1.4826 * float(np.median(np.abs(away)))
    spikes = float(np.mean(np.abs(away) > SPIKE * size + 0.2 * swing)) if size > 0.0 else 0.0
    return coarse, still, min(20.0 * spikes, 1.0)


def _set_point(record: LoopRecord) -> float:
    """Movement of the set point over that of the error, squashed to 0..1."""
    error = control_error(record)
    if record.sp is None or error is None:
        return 0.0
    sp = record.sp[np.isfinite(record.sp)]
    moves: NDArray[np.float64] = sp - sp.mean()
    power, rest = float(np.mean(moves**2)), float(np.mean((error - error.mean()) ** 2))
    return power / (power + rest) if power + rest > 0.0 else 0.0

"""What one verdict is weighed from: the findings on one record as a row of numbers, most of them between 0 and 1."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.interval import CHI2_2
from stiction.diagnosis.verdict.held import held
from stiction.diagnosis.verdict.own_cycle import near, own_cycle, ultimate
from stiction.diagnosis.verdict.rhythm import rhythm_of
from stiction.diagnosis.verdict.scales import better, kept, logarithm, squashed
from stiction.diagnosis.verdict.sensor import sensor_of
from stiction.records.quality.saturation import find_saturation, find_shutdown, find_span_ends

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.identified import ControllerFit, Identification
    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["Features", "features"]

LEAST_FIT = 0.02
"""Share explained below which a comparison weighs no less [-]."""
PERIOD_WEIGHT = 3.0
"""How much more the comparison about the period of an oscillating loop weighs [-]."""
CLEAR_JUMP = 0.5
"""`likelier_than_play` beyond which a jump is clear [-]: half of the simulated loops that stick pass it, of the others
one in twenty, by chance (`simulation.population`, seed 101)."""
ENOUGH = 750
"""Samples that are not few [-]."""


class Features(NamedTuple):
    """One record in numbers; what does not apply is 0 unless it says otherwise."""

    band: float
    """S over the OP's swing, average of the comparisons, held at 0.7 [-]. A loop that cycles because of its valve
    moves its OP through the band and little more; noise and drift fit bands of a tenth of the swing."""
    floor: float
    """Lower end of S's interval over the swing, average, held at 0.5 [-]."""
    advantage: float
    """ln(error of a good valve / error of the sticky one), average, held at 0.7 [-]."""
    grip: float
    """Band times the share of the PV that the sticky valve explains [-]."""
    fit: float
    """Share of the PV that the sticky valve explains, in the comparison that speaks, as all that follow [-]."""
    fit_linear: float
    """The same for a good valve [-]."""
    better: float
    """ln(error of a good valve / error of the sticky one) over 3, held at 1 [-]."""
    better_by: float
    """Fit less the fit of a good valve [-]."""
    better_elsewhere: float
    """The same of the comparison that does not speak [-]."""
    better_best: float
    """The largest `better` of a stretch of the record [-]."""
    better_worst: float
    """The smallest [-]."""
    significance: float
    """ln(1 + n ln(error of a good valve / error of the sticky one)) over 5, n independent samples [-]."""
    band_here: float
    """S over the OP's swing in the comparison that speaks [-]."""
    S_low: float
    """Lower end of S's interval over S [-]."""
    S_high: float
    """Upper end of S's interval over S, over 3, held at 1 [-]."""
    S_spread: float
    """Standard deviation of S from stretch to stretch over its mean [-]; -1 with one stretch."""
    jump: float
    """J over S [-]."""
    jump_low: float
    """Lower end of J's interval over S [-]."""
    jump_high: float
    """Upper end of J's interval over S, held at 1.5 [-]."""
    better_with_jump: float
    """ln(error of the best valve without jump / error of the best valve), held at 3 [-]."""
    beats_good: float
    """Vuong's statistic x by which the sticky valve predicts the PV better than a good one, as x / (3 + |x|) [-]."""
    likelier_than_good: float
    """ln(1 + x) over 8, x twice the log likelihood by which the likeliest sticky valve beats a good one [-]; of a
    good one that is likelier the same below 0."""
    likelier_in_part: float
    """The same in the third of the record where it is largest [-]."""
    likelier_seen: float
    """The same of the whole record where it shows the controller's own samples, else 0 [-]."""
    beats_bent: float
    """`beats_good` over a good valve, be its characteristic straight or bent [-]."""
    likelier_than_bent: float
    """`likelier_than_good` over a good valve, be its characteristic straight or bent [-]."""
    beats_gated: float
    """`beats_good` over a good valve, be it told the past of the PV with its noise alone or without it as well [-]."""
    likelier_than_gated: float
    """`likelier_than_good` over such a good valve [-]."""
    beats_relaxation: float
    """`beats_good` over a good valve, be there a relaxation oscillation from outside or not [-]."""
    likelier_than_relaxation: float
    """`likelier_than_good` over a good valve, be there a relaxation oscillation from outside or not [-]."""
    keeps_over_bent: float
    """Share of twice the log likelihood by which the sticky valve beats a good one that it keeps over one whose
    characteristic is bent, held at -1 and 1 [-]; of less than `scales.CHANCE` as a share of that."""
    keeps_over_gated: float
    """The same over one told the past of the PV without its noise [-]."""
    keeps_over_relaxation: float
    """The same over one beside a relaxation oscillation from outside [-]."""
    keeps_over_wave: float
    """The same over one beside a wave from outside, 1 where no wave can be told [-]."""
    beats_wave: float
    """`beats_good` over a good valve, be there a wave from outside or not [-]."""
    likelier_than_wave: float
    """`likelier_than_good` over a good valve, be there a wave from outside or not [-]."""
    beats_beside_wave: float
    """`beats_good` with a wave from outside beside both, where there is one [-]."""
    likelier_beside_wave: float
    """`likelier_than_good` with a wave from outside beside both, where there is one [-]."""
    beats_any: float
    """`beats_good` over the good valve of all that comes nearest [-]."""
    likelier_than_any: float
    """`likelier_than_good` over the likeliest of all good valves [-]."""
    likelier_than_play: float
    """`likelier_than_good` over the likeliest valve that hardly jumps [-]."""
    likely_jump_clear: float
    """What of it is beyond `CLEAR_JUMP` [-]."""
    own_samples: float
    """1 where the record shows the controller's own samples."""
    likely_band: float
    """The likeliest S over the OP's swing, held at 1.5 [-]."""
    likely_S_low: float
    """Lower end of its interval over it [-]."""
    likely_S_high: float
    """Upper end of its interval over it, over 3, held at 1 [-]."""
    likely_jump: float
    """The likeliest J over S [-]."""
    likely_jump_low: float
    """Lower end of its interval over S [-]."""
    likely_jump_high: float
    """Upper end of its interval over S, held at 1.5 [-]."""
    likely_better_by: float
    """Fit less the fit of a good valve, the likeliest valve simulated [-]."""
    integrating: float
    """1 where the process found integrates."""
    time_constant: float
    """Time constant found over five periods, held at 1 [-]; -1 where it integrates or the loop does not oscillate."""
    time_constant_linear: float
    """The same of the process found behind a good valve [-]."""
    lag: float
    """Smaller time constant over the period, held at 2 [-]; -1 where the loop does not oscillate."""
    dead_time: float
    """Dead time over the period, held at 2 [-]; -1 where the loop does not oscillate."""
    margin: float
    """1 / gain margin with a good valve, held at 1.5; 0 where it is not known [-]."""
    own_limit: float
    """How near the oscillation's period is to that at the limit of stability, 1 where they are equal [-]."""
    own_period: float
    """How near the period of the loop identified is to the record's, 1 where they are equal, 0 where it rests [-]."""
    own_amplitude: float
    """The same of the OP's amplitude [-]."""
    controller: float
    """Share of the OP that the controller found explains, held at 0 [-]."""
    oscillating: float
    """1 where the loop oscillates."""
    regularity: float
    """Regularity of the oscillation over 10 [-]."""
    cycles: float
    """ln(1 + periods in the record) over 4, held at 1.5 [-]."""
    samples: float
    """ln(samples of a period) over 6, held at 1 [-]."""
    few: float
    """ln(`ENOUGH` / samples of the stretch analysed) over 2, 0 where there are as many [-]."""
    share: float
    """Share of the control error's variance that the oscillation carries [-]."""
    others: float
    """Share that further oscillations carry [-]."""
    wander: float
    """Spread of the amplitude from period to period, beyond what noise explains, held at 1 [-]."""
    unknown_wander: float
    """1 where there are too few periods for that."""
    decay: float
    """ln(amplitude in the first third / amplitude in the last), held at 2 either way [-]."""
    skew_pv: float
    """Size of the PV's third moment about the drift, in standard deviations [-]."""
    skew_op: float
    """The same of the OP [-]."""
    tails_pv: float
    """Fourth moment of the PV about the drift, in standard deviations, over 10, held at 1 [-]."""
    tails_op: float
    """The same of the OP [-]."""
    at_limit: float
    """Share of the whole record with the OP at 0 or 100 % twice running or more, and not shut down [-]."""
    saturated: float
    """Share of the whole record with the OP resting at any limit, and not shut down [-]."""
    coarse: float
    """Step of the PV's resolution over its swing, held at 1 [-]."""
    still: float
    """Share of the samples in which the PV repeats its last value while OP moves [-]."""
    spikes: float
    """Samples in which the PV jumps away and back, over 4, held at 1 [-]."""
    set_point: float
    """Share of the PV's movement that the set point makes [-]."""
    shape_op: float
    """He's index where it is valid, else 0.5 [-]."""
    shape_pv: float
    """Haegglund's index, halved about 0.5, where it is valid, else 0.5 [-]."""
    votes: float
    """Share of the valid methods that vote for stiction, less that against [-]."""


def features(
    whole: LoopRecord,
    part: LoopRecord,
    found: Sequence[Identification],
    speaks: int,
    controller: ControllerFit,
    oscillation: Oscillation,
    evidence: Sequence[Evidence],
) -> Features:
    """Put the findings on one record into a row.

    Parameters
    ----------
    whole : LoopRecord
        The record as it came.
    part : LoopRecord
        The stretch that was analysed.
    found : sequence of Identification
        One per comparison; where there are two, the first is the one about the period.
    speaks : int
        Which of them speaks.
    controller : ControllerFit
        The controller found.
    oscillation : Oscillation
        Whether and how the loop oscillates.
    evidence : sequence of Evidence
        What each method says.

    Returns
    -------
    Features
        The row.
    """
    close, searched = found[speaks], [one.rough or one for one in found]
    main = searched[speaks]
    swing = float(np.ptp(part.op[np.isfinite(part.op)]))
    band, advantage, fit, floor = _compared(searched, swing, oscillating=oscillation.oscillating)
    stretches = [better(one.fit, one.fit_linear) for one in main.stretches] or [0.0]
    sizes = np.array([one.S for one in main.stretches])
    S, likely_S = max(main.S, 1e-9), max(close.S, 1e-9)
    period = oscillation.period if oscillation.oscillating else math.nan
    slow, slow_linear, lag, dead_time = _process(main, period)
    limit = None if main.linear is None else ultimate(main.linear, controller, part.dt)
    own = own_cycle(main, controller, period, part.dt) if math.isfinite(period) else None
    good = close.over("good")
    bent, gated, relaxation, wave = (close.nearest("good", name) for name in ("bent", "gated", "relaxation", "wave"))
    beside_wave = close.rivals.get("beside_wave", good)
    likelier_than_play = logarithm(close.likelier_than_play)
    rhythm = rhythm_of(part, oscillation)
    sensor, runs = sensor_of(part), ~find_shutdown(whole.op, whole.auto)
    rows = {row.method: row for row in evidence if row.valid and math.isfinite(row.index)}
    votes = [(row.vote == "stiction") - (row.vote == "no_stiction") for row in evidence if row.valid]
    return Features(
        band=held("band", band),
        floor=held("floor", floor),
        advantage=advantage,
        grip=band * fit,
        fit=max(main.fit / 100.0, 0.0),
        fit_linear=max(main.fit_linear / 100.0, 0.0),
        better=better(main.fit, main.fit_linear),
        better_by=(main.fit - main.fit_linear) / 100.0,
        better_elsewhere=sum(one.fit - one.fit_linear for i, one in enumerate(searched) if i != speaks) / 100.0,
        better_best=max(stretches),
        better_worst=min(stretches),
        significance=_significance(main),
        band_here=main.S / swing,
        S_low=main.S_low / S,
        S_high=held("S_high", main.S_high / S / 3.0),
        S_spread=float(sizes.std() / max(sizes.mean(), 1e-9)) if sizes.size > 1 else -1.0,
        jump=main.J / S,
        jump_low=main.J_low / S,
        jump_high=held("jump_high", main.J_high / S),
        better_with_jump=_better_with_jump(main),
        beats_good=squashed(good.beats),
        likelier_than_good=logarithm(good.likelier),
        likelier_in_part=logarithm(close.likelier_in_part),
        likelier_seen=logarithm(good.likelier) if close.own_samples else 0.0,
        beats_bent=squashed(bent.beats),
        likelier_than_bent=logarithm(bent.likelier),
        beats_gated=squashed(gated.beats),
        likelier_than_gated=logarithm(gated.likelier),
        beats_relaxation=squashed(relaxation.beats),
        likelier_than_relaxation=logarithm(relaxation.likelier),
        keeps_over_bent=kept(close.over("bent").likelier, good.likelier),
        keeps_over_gated=kept(close.over("gated").likelier, good.likelier),
        keeps_over_relaxation=kept(close.over("relaxation").likelier, good.likelier),
        keeps_over_wave=kept(close.over("wave").likelier, good.likelier),
        beats_wave=squashed(wave.beats),
        likelier_than_wave=logarithm(wave.likelier),
        beats_beside_wave=squashed(beside_wave.beats),
        likelier_beside_wave=logarithm(beside_wave.likelier),
        beats_any=squashed(close.beats_any),
        likelier_than_any=logarithm(close.likelier_than_any),
        likelier_than_play=likelier_than_play,
        likely_jump_clear=max(likelier_than_play - CLEAR_JUMP, 0.0),
        own_samples=float(close.own_samples),
        likely_band=held("likely_band", close.S / swing),
        likely_S_low=close.S_low / likely_S,
        likely_S_high=held("likely_S_high", close.S_high / likely_S / 3.0),
        likely_jump=close.J / likely_S,
        likely_jump_low=close.J_low / likely_S,
        likely_jump_high=held("likely_jump_high", close.J_high / likely_S),
        likely_better_by=(close.fit - close.fit_linear) / 100.0,
        integrating=float(main.process.integrating),
        time_constant=slow,
        time_constant_linear=slow_linear,
        lag=lag,
        dead_time=dead_time,
        margin=0.0 if limit is None else held("margin", 1.0 / max(limit[0], 1e-3)),
        own_limit=near(period, limit[1]) if limit is not None else 0.0,
        own_period=near(period, own.period) if own is not None else 0.0,
        own_amplitude=near(oscillation.amplitude_op, own.amplitude_op) if own is not None else 0.0,
        controller=min(max(controller.explained, 0.0), 1.0) if math.isfinite(controller.explained) else 0.0,
        oscillating=float(oscillation.oscillating),
        regularity=min(oscillation.regularity, 10.0) / 10.0 if math.isfinite(oscillation.regularity) else 0.0,
        cycles=rhythm.cycles,
        samples=rhythm.samples,
        few=max(math.log(ENOUGH / len(part)) / 2.0, 0.0),
        share=oscillation.share if math.isfinite(oscillation.share) else 0.0,
        others=sum(other.share for other in oscillation.others),
        wander=rhythm.wander,
        unknown_wander=rhythm.unknown_wander,
        decay=rhythm.decay,
        skew_pv=rhythm.skew_pv,
        skew_op=rhythm.skew_op,
        tails_pv=rhythm.tails_pv,
        tails_op=rhythm.tails_op,
        at_limit=float(np.mean(find_span_ends(whole.op, whole.auto) & runs)),
        saturated=float(np.mean(find_saturation(whole.op, whole.pv, whole.auto) & runs)),
        coarse=sensor.coarse,
        still=sensor.still,
        spikes=sensor.spikes,
        set_point=sensor.set_point,
        shape_op=rows["he_curve_fit"].index if "he_curve_fit" in rows else 0.5,
        shape_pv=0.5 + 0.5 * rows["haegglund_shape"].index if "haegglund_shape" in rows else 0.5,
        votes=sum(votes) / len(votes) if votes else 0.0,
    )


def _compared(found: Sequence[Identification], swing: float, *, oscillating: bool) -> tuple[float, ...]:
    """Band, advantage, fit and floor, averaged over the comparisons by the share that each explains."""
    weights = np.array([max(one.fit / 100.0, LEAST_FIT) for one in found])
    if oscillating and len(found) > 1:
        weights[0] *= PERIOD_WEIGHT
    rows = [
        (
            one.S / swing,
            held("advantage", 3.0 * better(one.fit, one.fit_linear)),
            max(one.fit / 100.0, 0.0),
            one.S_low / swing,
        )
        for one in found
    ]
    return tuple(float(x) for x in weights @ np.array(rows) / weights.sum())


def _significance(found: Identification) -> float:
    """The likelihood ratio of sticky and good valve, squashed; the region's limit tells the independent samples."""
    least = float(found.surface.error.min())
    if not 0.0 < least < found.surface.limit:
        return 0.0
    samples = CHI2_2 / max(math.log(found.surface.limit / least), 1e-3)
    return math.log1p(samples * 3.0 * better(found.fit, found.fit_linear)) / 5.0


def _better_with_jump(found: Identification) -> float:
    """How much worse the best valve without a jump explains the PV than the best of all, on the error surface."""
    error = found.surface.error
    worse = math.log(max(float(error[:, 0].min()), 1e-4) / max(float(error.min()), 1e-4))
    return held("better_with_jump", worse)


def _process(found: Identification, period: float) -> tuple[float, float, float, float]:
    """Lags and dead time in periods; -1 where there is no period or no lag."""
    if not period > 0.0:
        return -1.0, -1.0, -1.0, -1.0
    lags = [math.nan if one is None else one.time_constant / period / 5.0 for one in (found.process, found.linear)]
    slow, slow_linear = (held("time_constant", one) if math.isfinite(one) else -1.0 for one in lags)
    lag, dead_time = found.process.lag / period, found.process.dead_time / period
    return slow, slow_linear, held("lag", lag), held("dead_time", dead_time)

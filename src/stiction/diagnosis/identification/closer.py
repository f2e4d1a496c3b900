"""The closer search: from the stretches searched densely to the valve that predicts the PV best."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.assembled import assembled, stretch_of
from stiction.diagnosis.identification.between import with_samples_between
from stiction.diagnosis.identification.contest import OWN, REBUILT, STANDS_OUT, UNSEEN, UNTOLD, contest, drift
from stiction.diagnosis.identification.controller import EXACT
from stiction.diagnosis.identification.detectable import detectable
from stiction.diagnosis.identification.likeliest import (
    most_likely,
    most_likely_between,
    tried_again,
    tried_recorded,
)
from stiction.diagnosis.identification.likelihood import prediction_of, stem_of
from stiction.diagnosis.identification.own_samples import are_own_samples
from stiction.diagnosis.identification.piece import with_stem
from stiction.diagnosis.identification.rivals import over_rivals
from stiction.diagnosis.identification.shocks import shocks_of
from stiction.diagnosis.identification.signals import prepare

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.contest import Contest, Known
    from stiction.diagnosis.identification.dense_search import Search
    from stiction.diagnosis.identification.likelihood import Prediction, Trial, Trials
    from stiction.diagnosis.identification.piece import Piece
    from stiction.diagnosis.identification.signals import Signals
    from stiction.diagnosis.identified import Identification
    from stiction.records.record import LoopRecord

__all__ = ["Closer", "closely"]

NOT_RECORDED, CANNOT_BE_TOLD, BY_INTEGRAL = (
    "OP between the samples is not recorded",
    "Whether OP moves between the samples cannot be told",
    "OP between the samples is rebuilt by the controller's integral",
)
"""Why S is known less well; the second where the moves that were recorded, rounded, are all explained, or what is left
of them may be a set point's that was not recorded."""
STARTS = np.linspace(-1.0, 1.0, 9)
"""Places at the start of a record of which only the middle is predicted [half bands]."""
ANOTHER = 0.1
"""How far off the record's S that of a stretch is beyond which its own valve is simulated in it, as a share [-]. S and
J do not depend on it."""


class Closer(NamedTuple):
    """What the closer search found."""

    recorded: Identification
    """By the samples that were recorded."""
    told: Identification
    """S and J by the samples between as well, where the controller's integral tells these; how far a sticky valve beats
    a good one is still by those recorded. The same where it does not."""


def closely(search: Search) -> Closer:
    """Search by likelihood.

    Parameters
    ----------
    search : Search
        What the dense search found.

    Returns
    -------
    Closer
        The finding.
    """
    record, swing = search.record, float(np.ptp(search.signals.op))
    own = are_own_samples(record, search.controller)
    rebuilt = None if own or _rounded(search) else with_samples_between(record)
    fine = _finely(record, search.period, search.signals)
    if rebuilt is None:
        coarse = prediction_of(search.signals)
        fine, tried = _without_shocks(fine, most_likely(coarse, fine, swing, own_samples=own), swing)
        known = OWN if own else UNSEEN if record.sp is not None else UNTOLD
        recorded, found = _recorded(search, fine, tried, known)
        return Closer(recorded, _limited(replace(recorded, S_bootstrap=found.bootstrap()), search, known))
    signals = prepare(rebuilt, search.period)
    coarse, whole = prediction_of(signals), _finely(rebuilt, search.period, signals)
    whole, between = _without_shocks(whole, most_likely_between(coarse, whole, swing), swing)
    fine, tried = _without_shocks(fine, tried_recorded(fine, between, swing), swing)
    recorded, _ = _recorded(search, fine, tried, UNSEEN)
    found = contest(whole, between, REBUILT)
    told = replace(_by_stretches(search, whole, signals.op, 2, found), S_bootstrap=found.bootstrap())
    return Closer(recorded, _limited(_weighed_as(recorded, told), search, REBUILT))


def _recorded(search: Search, fine: Prediction, tried: Trials, known: Known) -> tuple[Identification, Contest]:
    """What the recorded samples say, and the contest of S and J."""
    own = known is OWN
    # What OP does between samples that are not the controller's own passes for a lag, and S for less than it is: a lag
    # then only counts in how far a sticky valve beats a good one.
    found = contest(fine, tried if own else tried.without_lag(), known)
    clearest = found if own or tried.best.lag == 0.0 else contest(fine, tried, known)
    period = None if search.period is None else search.period / (search.record.dt * fine.width)
    rivals, bent = over_rivals(fine, clearest, period)
    result = _by_stretches(search, fine, search.signals.op, 1, found)
    assert result.linear is not None
    recorded = replace(
        result,
        S_detectable=detectable(fine, result.linear, search.record.dt * fine.width) if own else math.nan,
        rivals=rivals,
        bent=bent,
        likelier_in_part=clearest.likelier_than_good(3),
        likelier_than_play=clearest.likelier_than_play,
        left_out=fine.shocks.size * fine.width,
        own_samples=own,
    )
    return recorded, found


def _finely(record: LoopRecord, period: float | None, signals: Signals) -> Prediction:
    """What is predicted in the last searches; `signals` are those of the first ones."""
    if signals.thinned == 1:
        return prediction_of(signals)
    return prediction_of(prepare(record, period, fine=True), fine=True)


def _without_shocks(fine: Prediction, tried: Trials, swing: float) -> tuple[Prediction, Trials]:
    """Leave out what no valve predicts, and go on."""
    rows = shocks_of(fine, tried.best)
    if not rows.size:
        return fine, tried
    fine = fine._replace(shocks=rows)
    return fine, tried_again(fine, tried, swing)


def _weighed_as(recorded: Identification, told: Identification) -> Identification:
    """The valve `told`, with what the recorded samples say of how far it beats a good one."""
    stretches = (
        replace(one, likelier_than_good=other.likelier_than_good)
        for one, other in zip(told.stretches, recorded.stretches, strict=True)
    )
    return replace(
        told, stretches=tuple(stretches), rebuilt=True, rivals=recorded.rivals, bent=recorded.bent,
        likelier_in_part=recorded.likelier_in_part, likelier_than_play=recorded.likelier_than_play,
        left_out=recorded.left_out, S_detectable=recorded.S_detectable,
    )  # fmt: skip


def _rounded(search: Search) -> bool:
    """Whether the rounding of OP and PV explains all that the controller's law leaves, at the record's own rate."""
    return search.controller.exact and search.controller.left > EXACT


def _limited(found: Identification, search: Search, known: Known) -> Identification:
    """The finding, with what limits S in its reason."""
    if known is OWN:
        return found
    if known is REBUILT:
        why = f"{BY_INTEGRAL}."
    else:
        which = CANNOT_BE_TOLD if known is UNTOLD or search.controller.exact else NOT_RECORDED
        why = f"{which}: S is known to a factor of {known.wide:g} at best."
    return replace(found, reason=f"{why} {found.reason}".strip())


def _by_stretches(
    search: Search, fine: Prediction, op: NDArray[np.float64], per: int, found: Contest
) -> Identification:
    """What is found in the whole and in each stretch; the process is that of the stretch it explains best.

    `op` is that of the whole record, `per` samples of it to one of the record.
    """
    record, signals, searched, sign = search.record, search.signals, search.pieces, search.controller.action

    def stem(valve: Trial) -> NDArray[np.float64]:
        return _stem(fine, op, valve)[::per]

    def behind(one: Piece, valve: Trial) -> Piece:
        return with_stem(one, _part(stem(valve), one.signals), sign, record.integrating)

    S, ratio = found.best.S, found.best.ratio
    pieces = [behind(one, found.best) for one in searched]
    stretches, hours, bands = [], [], []
    halves, begin = (fine.first + fine.ends) * fine.width / per, fine.first * fine.width / per
    for one, piece in zip(searched, pieces, strict=True):
        first, last = piece.signals.first, piece.signals.first + piece.signals.target.size
        ends = np.searchsorted(halves, (first * signals.thinned, last * signals.thinned))
        if ends[1] == 0 or last * signals.thinned <= begin or ends[0] == halves.size:
            stretches.append(stretch_of(piece, len(record), *piece.valve))
            continue
        cycles = slice(int(ends[0]), max(int(ends[1]), int(ends[0]) + 1))
        own = found.best_in(cycles)
        size = own.S + found.beyond
        likelier = found.likelier_in(cycles)
        if likelier > STANDS_OUT and abs(own.S / S - 1.0) > ANOTHER:
            piece = min(piece, behind(one, own), key=lambda piece: piece.error)
        stretches.append(stretch_of(piece, len(record), size, own.S * own.ratio / size, likelier))
        if likelier > STANDS_OUT:
            hours.append(0.5 * (first + last) * signals.dt / 3600.0)
            bands.append(size)
    speaks = min(pieces, key=lambda piece: piece.error)
    valve, interval = (S + found.beyond, S * ratio), (*found.S_range, *found.J_range)
    result = assembled(record, signals, pieces, speaks, valve, interval, stretches)
    slope, error = drift(hours, bands)
    mv = stem(found.best)
    mv = mv[np.minimum(np.arange(len(record)), mv.size - 1)]
    return replace(
        result, mv=np.where(np.isfinite(result.mv), result.mv, mv), drift=slope, drift_error=error,
        actuator_lag=found.best.lag * record.dt / per, rough=search.rough,
    )  # fmt: skip


def _stem(fine: Prediction, op: NDArray[np.float64], valve: Trial) -> NDArray[np.float64]:
    """Stem over the whole `op`: from where it is predicted on as there, before that from a place that leads there.

    A stem that begins elsewhere may never be moved: a cycle is possible with an OP that swings over less than S + J.
    """
    begin = fine.first * fine.width
    after = stem_of(fine._replace(op=op[begin:]), valve)
    if begin == 0:
        return after
    starts = [stem_of(fine._replace(op=op[: begin + 1]), valve._replace(place=place)) for place in STARTS.tolist()]
    before = min(starts, key=lambda one: abs(one[-1] - after[0]))
    return np.concatenate([before[:-1], after])


def _part(stem: NDArray[np.float64], signals: Signals) -> NDArray[np.float64]:
    """The part of a stem that belongs to a stretch."""
    first, last = signals.first * signals.thinned, (signals.first + signals.target.size) * signals.thinned
    part = stem[first:last]
    return np.concatenate([part, np.full(last - first - part.size, stem[-1])])

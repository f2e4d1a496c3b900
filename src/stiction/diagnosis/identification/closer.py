"""The closer search: from the stretches searched densely to the valve that foretells the PV best."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.assembled import assembled, stretch_of
from stiction.diagnosis.identification.between import with_samples_between
from stiction.diagnosis.identification.contest import OWN, REBUILT, STANDS_OUT, UNSEEN, contest, drift
from stiction.diagnosis.identification.controller import EXACT
from stiction.diagnosis.identification.likeliest import most_likely, tried_again
from stiction.diagnosis.identification.likelihood import prediction_of, stem_of
from stiction.diagnosis.identification.own_samples import are_own_samples
from stiction.diagnosis.identification.piece import with_stem
from stiction.diagnosis.identification.rivals import over_rivals
from stiction.diagnosis.identification.shocks import shocks_of
from stiction.diagnosis.identification.signals import prepare

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.contest import Contest, Known
    from stiction.diagnosis.identification.identify import Search
    from stiction.diagnosis.identification.likelihood import Prediction, Trial
    from stiction.diagnosis.identification.piece import Piece
    from stiction.diagnosis.identification.signals import Signals
    from stiction.diagnosis.identified import Identification

__all__ = ["closely"]

NOT_RECORDED, CANNOT_BE_TOLD, BY_INTEGRAL = (
    "OP between the samples is not recorded",
    "Whether OP moves between the samples cannot be told",
    "OP between the samples is rebuilt by the controller's integral",
)
"""Why S is known less well; the second where the moves that were recorded, rounded, are all explained."""
ANOTHER = 0.1
"""How far off the record's S that of a stretch is beyond which its own valve is simulated in it, as a share [-]."""


class Foretold(NamedTuple):
    """What is foretold, and how its samples stand to those of the record."""

    coarse: Prediction
    """For the first searches."""
    fine: Prediction
    """For the last ones."""
    op: NDArray[np.float64]
    """OP of the whole record, also between its samples where it was rebuilt [% of span]."""
    per: int
    """Samples of `op` to one of the record."""
    known: Known
    """How well what OP does between the samples is known."""


def closely(search: Search) -> Identification:
    """Search by likelihood.

    Parameters
    ----------
    search : Search
        What the dense search found.

    Returns
    -------
    Identification
        The finding.
    """
    record, sign, swing = search.record, search.controller.action, float(np.ptp(search.signals.op))
    coarse, fine, op, per, known = _foretold(search)
    tried = most_likely(coarse, fine, swing)
    if (rows := shocks_of(fine, tried.best)).size:
        fine = fine._replace(shocks=rows)
        tried = tried_again(fine, tried, swing)
    # What OP does between samples that are not the controller's own passes for a lag, and S for less than it is: a lag
    # then only counts in how far a sticky valve beats a good one.
    own = known is OWN
    found = contest(fine, tried if own else tried.without_lag(), known)
    clearest = found if own or tried.best.lag == 0.0 else contest(fine, tried, known)
    whole = fine if fine.first == 0 else fine._replace(op=op)

    def stem(valve: Trial) -> NDArray[np.float64]:
        return stem_of(whole, valve)[::per]

    def behind(one: Piece, valve: Trial) -> Piece:
        return with_stem(one, _part(stem(valve), one.signals), sign, record.integrating)

    result = _by_stretches(search, fine, per, found, behind)
    mv = stem(found.best)
    mv = mv[np.minimum(np.arange(len(record)), mv.size - 1)]
    samples = None if search.period is None else search.period * per / (record.dt * fine.width)
    return replace(
        result,
        mv=np.where(np.isfinite(result.mv), result.mv, mv),
        S_bootstrap=found.bootstrap(),
        beats_good=float(clearest.worse[-1]),
        gain=clearest.gain(),
        gain_in_part=clearest.gain(3),
        jump_gain=clearest.jump_gain,
        left_out=fine.shocks.size * fine.width // per,
        own_samples=own,
        rebuilt=known is REBUILT,
        rough=search.rough,
        reason=f"{_limited(search, known)} {result.reason}".strip(),
        **over_rivals(fine, clearest, samples),
    )


def _foretold(search: Search) -> Foretold:
    """The record as it is, or with the samples between where these can be rebuilt."""
    record, signals, per, known = search.record, search.signals, 1, UNSEEN
    if are_own_samples(record, search.controller):
        known = OWN
    elif not _rounded(search) and (rebuilt := with_samples_between(record)) is not None:
        record, per, known = rebuilt, 2, REBUILT
        signals = prepare(record, search.period)
    coarse = fine = prediction_of(signals)
    if signals.thinned > 1:
        fine = prediction_of(prepare(record, search.period, fine=True), fine=True)
    return Foretold(coarse, fine, signals.op, per, known)


def _rounded(search: Search) -> bool:
    """Whether the rounding of OP and PV explains all that the controller's law leaves, at the record's own rate."""
    return search.controller.exact and search.controller.left > EXACT


def _limited(search: Search, known: Known) -> str:
    """What limits S, in a sentence; empty where nothing does."""
    if known is OWN:
        return ""
    if known is REBUILT:
        return f"{BY_INTEGRAL}."
    which = CANNOT_BE_TOLD if search.controller.exact else NOT_RECORDED
    return f"{which}: S is known to a factor of {known.wide:g} at best."


def _by_stretches(
    search: Search, fine: Prediction, per: int, found: Contest, behind: Callable[[Piece, Trial], Piece]
) -> Identification:
    """What is found in the whole and in each stretch; the process is that of the stretch it explains best.

    `per` samples are foretold from for each one of the record; `behind` puts a valve before a stretch.
    """
    record, signals, searched = search.record, search.signals, search.pieces
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
        gain = found.gain_in(cycles)
        if gain > STANDS_OUT and abs(own.S / S - 1.0) > ANOTHER:
            piece = min(piece, behind(one, own), key=lambda piece: piece.error)
        stretches.append(stretch_of(piece, len(record), size, own.S * own.ratio / size, gain))
        if gain > STANDS_OUT:
            hours.append(0.5 * (first + last) * signals.dt / 3600.0)
            bands.append(size)
    speaks = min(pieces, key=lambda piece: piece.error)
    valve, ends = (S + found.beyond, S * ratio), (*found.S_range, *found.J_range)
    result = assembled("kano", record, signals, pieces, speaks, valve, ends, stretches)
    slope, error = drift(hours, bands)
    return replace(result, drift=slope, drift_error=error, lag=found.best.lag * record.dt / per)


def _part(stem: NDArray[np.float64], signals: Signals) -> NDArray[np.float64]:
    """The part of a stem that belongs to a stretch."""
    first, last = signals.first * signals.thinned, (signals.first + signals.target.size) * signals.thinned
    part = stem[first:last]
    return np.concatenate([part, np.full(last - first - part.size, stem[-1])])

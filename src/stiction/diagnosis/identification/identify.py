"""From OP and PV to the sticky valve and the process behind it."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.contest import STANDS_OUT, WIDE, Contest, contest, drift
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.interval import CHI2_2, independent_samples, interval, limit
from stiction.diagnosis.identification.likeliest import most_likely, tried_again
from stiction.diagnosis.identification.likelihood import Prediction, Trial, prediction_of, stem_of
from stiction.diagnosis.identification.own_samples import are_own_samples
from stiction.diagnosis.identification.piece import Piece, search_piece, with_stem
from stiction.diagnosis.identification.rivals import over_rivals
from stiction.diagnosis.identification.shocks import shocks_of
from stiction.diagnosis.identification.signals import Signals, pieces_of, prepare
from stiction.diagnosis.identified import J_UNKNOWN, ErrorSurface, Identification, ProcessFit, Stretch
from stiction.errors import ParameterError, RecordError
from stiction.records.outliers import without_outliers

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.controller import ControllerFit
    from stiction.records.record import LoopRecord

__all__ = ["Search", "identify", "search"]

MODELS = ("kano", "stenman", "three_parameter")
"""Valve models that are identified."""
UNSEEN, MAYBE_UNSEEN = "OP between the samples is not recorded", "Whether OP moves between the samples cannot be told"
"""Why S is known less well; the second where the moves that were recorded, rounded, are all explained."""
ANOTHER = 0.1
"""How far off the record's S that of a stretch is beyond which its own valve is simulated in it, as a share [-]."""


def identify(
    record: LoopRecord, model: str = "kano", *, period: float | None = None, closer: bool = True
) -> Identification:
    """Identify stiction and process together by simulation error.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.
    model : str
        Valve model; "kano" fits (S, J), "stenman" d, "three_parameter" (sb, sj, r) of eq. 5 repaired. The last two
        go on from (S, J), and compare the stem itself where the record has MV.
    period : float, optional
        Period of the oscillation [s]; slow disturbances are then kept out by comparing deviations from the
        moving average over one period. Without it the record is compared about its mean.
    closer : bool
        Go on to the fine search; without it S and J are only as exact as the dense one.

    Returns
    -------
    Identification
        S and J with intervals, the process, both simulations and the error surface.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples with both OP and PV.
    ParameterError
        When `model` is unknown or `period` not positive.

    Notes
    -----
    Every (S, J / S) of a 30 x 30 grid up to the OP's swing (a limit cycle needs OP_pp >= S) is tried with 100
    processes, 10 lags (an integrator among them where the loop's kind is not known, behind one where it integrates) by
    10 dead times, by the error of the simulation. With a period
    this is done in stretches of about eight periods, at most eight. It gives the error surface and, without
    `closer`, S and J: those of the stretch that agrees best with the others, with the profile likelihood's interval.

    The closer search maximises the likelihood of the PV's prediction errors (see `likelihood`), which a disturbance
    that goes round the closed loop does not pull, over the whole record or, where more than 4 000 samples are left of
    it after thinning, over the 4 000 in its middle, without the samples that neither a sticky nor a good valve
    foretells (see `shocks`). The interval holds all valves that Vuong's test does not find worse from half cycle to
    half cycle (see `contest`). Where the record does not show the controller's own samples OP trips the valve unseen
    between them: S is then corrected for the noise on OP, and its interval is a factor of 1.3 either way or more. An
    actuator that lags is looked for too, and found where its likelihood stands out: by OP itself its valve would look
    stickier than it is. Of other than the controller's own samples that only counts in how far a sticky valve beats a
    good one: a straight one, the likeliest bent one (`characteristic`), one beside a wave from outside, and a good one
    while both have that wave (`outside_wave`). The process is the best behind that valve's stem, by simulation.

    References
    ----------
    srinivasan2005; jelali2008: search over the nonlinear block around a least-squares fit of the linear one.
    vuong1989.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> found = st.identify(st.simulate(loop, sp=10.0, duration=2000.0, seed=1), period=162.0)
    >>> abs(found.S - 3.0) < 0.3
    True
    """
    if model not in MODELS:
        raise ParameterError(f"model = {model!r} is not identified; use {', '.join(map(repr, MODELS))}.")
    if period is not None and not 0.0 < period < math.inf:
        raise ParameterError(f"period = {period} s is not a period; give the oscillation's or leave it out.")
    record = without_outliers(record)
    known = search(record, period)
    found = known.closer() if closer else known.rough
    if model == "stenman":
        from stiction.diagnosis.identification.stenman import identify_stenman

        return identify_stenman(record, found, period)
    if model == "three_parameter":
        from stiction.diagnosis.identification.three_parameter import identify_three_parameter

        return identify_three_parameter(record, found, period)
    return found


@dataclass(frozen=True, slots=True)
class Search:
    """The dense search of one comparison, from which the closer one goes on."""

    record: LoopRecord
    """The record."""
    period: float | None
    """Period about whose moving average it is compared [s]; None for the mean of the record."""
    signals: Signals
    """What was compared."""
    controller: ControllerFit
    """The controller found, which says which sign the process has."""
    pieces: list[Piece]
    """The stretches searched."""
    rough: Identification
    """What the dense search found."""

    def closer(self) -> Identification:
        """Go on by likelihood."""
        signals, sign = self.signals, self.controller.action
        coarse = fine = prediction_of(signals)
        if signals.thinned > 1:
            fine = prediction_of(prepare(self.record, self.period, fine=True), fine=True)
        seen = are_own_samples(self.record, self.controller)
        tried = most_likely(coarse, fine, float(np.ptp(signals.op)))
        if (rows := shocks_of(fine, tried.best)).size:
            fine = fine._replace(shocks=rows)
            tried = tried_again(fine, tried, float(np.ptp(signals.op)))
        # What OP does between samples that are not the controller's own passes for a lag, and S for less than it is: a
        # lag then only counts in how far a sticky valve beats a good one.
        found = contest(fine, tried if seen else tried.without_lag(), seen=seen)
        clearest = found if seen or tried.best.lag == 0.0 else contest(fine, tried, seen=seen)
        samples = None if self.period is None else self.period / (self.record.dt * fine.width)
        whole = fine if fine.first == 0 else fine._replace(op=signals.op)

        def behind(one: Piece, valve: Trial) -> Piece:
            return with_stem(one, _part(stem_of(whole, valve), one.signals), sign, self.record.integrating)

        closely = _closely("kano", self.record, signals, self.pieces, fine, found, behind)
        stem = stem_of(whole, found.best)
        at = np.minimum(np.arange(len(self.record)), stem.size - 1)
        which = MAYBE_UNSEEN if self.controller.exact else UNSEEN
        told = "" if seen else f"{which}: S is known to a factor of {WIDE:g} at best."
        return replace(
            closely,
            mv=np.where(np.isfinite(closely.mv), closely.mv, stem[at]),
            S_bootstrap=found.bootstrap(),
            beats_good=float(clearest.worse[-1]),
            gain=clearest.gain(),
            gain_in_part=clearest.gain(3),
            jump_gain=clearest.jump_gain,
            left_out=fine.shocks.size * fine.width,
            own_samples=seen,
            rough=self.rough,
            reason=f"{told} {closely.reason}".strip(),
            **over_rivals(fine, clearest, samples),
        )


def search(record: LoopRecord, period: float | None, controller: ControllerFit | None = None) -> Search:
    """Search each stretch of a record densely.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.
    period : float or None
        Period of the oscillation [s]; None compares about the mean of the record.
    controller : ControllerFit, optional
        The controller behind the record, which says which sign the process has; it is fitted where it is not given.

    Returns
    -------
    Search
        What was found, to be searched closer.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples with both OP and PV.
    """
    signals = prepare(record, period)
    swing = float(np.ptp(signals.op))
    for name, x in (("OP", signals.op), ("PV", signals.pv)):
        if not np.ptp(x) > 1e-9 * np.abs(x).max():
            raise RecordError(f"{record.tag}: {name} does not vary; nothing can be identified.")
    controller = fit_controller(record) if controller is None else controller
    action = controller.action
    stretches = pieces_of(signals)

    def searched(stretch: Signals) -> Piece:
        return search_piece(stretch, action, record.integrating, swing)

    if len(stretches) == 1:
        pieces = [searched(stretches[0])]
    else:
        with ThreadPoolExecutor(2) as pool:
            pieces = list(pool.map(searched, stretches))
    return Search(record, period, signals, controller, pieces, _roughly("kano", record, signals, pieces))


def _part(stem: NDArray[np.float64], signals: Signals) -> NDArray[np.float64]:
    """The part of a stem that belongs to a stretch."""
    first, last = signals.first * signals.thinned, (signals.first + signals.target.size) * signals.thinned
    part = stem[first:last]
    return np.concatenate([part, np.full(last - first - part.size, stem[-1])])


def _agreed(pieces: list[Piece]) -> int:
    """The stretch whose S is nearest to the others', each weighing by how little it leaves unexplained."""
    S = np.array([piece.valve[0] for piece in pieces])
    weight = np.array([1.0 / (piece.error + 1e-3) for piece in pieces])
    return int(np.argmin(np.abs(S[:, np.newaxis] - S) @ weight))


def _roughly(model: str, record: LoopRecord, signals: Signals, pieces: list[Piece]) -> Identification:
    """By the dense searches alone."""
    chosen = _agreed(pieces)
    S, ratio = pieces[chosen].valve
    ratio_low, ratio_high = interval(pieces, chosen, 1)
    ratio_high = min(ratio_high, 1.0)
    stretches = [_stretch(one, len(record), *one.valve) for one in pieces]
    ends = (*interval(pieces, chosen, 0), S * ratio_low, S * ratio_high)
    return _result(model, record, signals, pieces, pieces[chosen], (S, S * ratio), ends, stretches)


def _closely(
    model: str,
    record: LoopRecord,
    signals: Signals,
    searched: list[Piece],
    prediction: Prediction,
    found: Contest,
    behind: Callable[[Piece, Trial], Piece],
) -> Identification:
    """By likelihood; the process is that of the stretch it explains best, `behind` the valve."""
    S, ratio = found.best.S, found.best.ratio
    pieces = [behind(one, found.best) for one in searched]
    stretches, hours, bands = [], [], []
    for one, piece in zip(searched, pieces, strict=True):
        first, last = piece.signals.first, piece.signals.first + piece.signals.target.size
        halves = (prediction.first + prediction.ends) * prediction.width
        ends = np.searchsorted(halves, (first * signals.thinned, last * signals.thinned))
        if ends[1] == 0 or last * signals.thinned <= prediction.first * prediction.width or ends[0] == halves.size:
            stretches.append(_stretch(piece, len(record), *piece.valve))
            continue
        cycles = slice(int(ends[0]), max(int(ends[1]), int(ends[0]) + 1))
        own = found.best_in(cycles)
        size = own.S + found.beyond
        gain = found.gain_in(cycles)
        if gain > STANDS_OUT and abs(own.S / S - 1.0) > ANOTHER:
            piece = min(piece, behind(one, own), key=lambda piece: piece.error)
        stretches.append(_stretch(piece, len(record), size, own.S * own.ratio / size, gain))
        if gain > STANDS_OUT:
            hours.append(0.5 * (first + last) * signals.dt / 3600.0)
            bands.append(size)
    speaks = min(pieces, key=lambda piece: piece.error)
    result = _result(
        model,
        record,
        signals,
        pieces,
        speaks,
        (S + found.beyond, S * ratio),
        (*found.S_range, *found.J_range),
        stretches,
    )
    slope, error = drift(hours, bands)
    return replace(result, drift=slope, drift_error=error, lag=found.best.lag * record.dt)


def _result(
    model: str,
    record: LoopRecord,
    signals: Signals,
    pieces: list[Piece],
    speaks: Piece,
    valve: tuple[float, float],
    ends: tuple[float, float, float, float],
    stretches: list[Stretch],
) -> Identification:
    energy = np.array([float(np.sum(one.signals.target**2)) for one in pieces])
    weight = energy / energy.sum()
    mv, pv = _stitched(signals, pieces)
    at = np.minimum(np.arange(len(record)), signals.op.size - 1)
    S, J = valve
    S_low, S_high, J_low, J_high = ends
    return Identification(
        model=model,
        S=S,
        J=J,
        S_low=S_low,
        S_high=S_high,
        J_low=J_low,
        J_high=min(J_high, S_high),
        process=_process(speaks.process, signals),
        fit=100.0 * (1.0 - float(weight @ np.array([one.error for one in pieces]))),
        fit_linear=100.0 * (1.0 - float(weight @ np.array([one.linear.error[0, 0] for one in pieces]))),
        surface=_surface(signals, pieces, speaks, energy),
        mv=mv[at],
        pv=pv[at // signals.thinned],
        linear=_process(speaks.good, signals),
        stretches=tuple(stretches),
        reason=J_UNKNOWN if J_high - J_low > 0.6 * S else "",
    )


def _surface(signals: Signals, pieces: list[Piece], speaks: Piece, energy: NDArray[np.float64]) -> ErrorSurface:
    """The dense searches together, each stretch weighing by its energy; over dead times those that tried the same."""
    S, ratio, delays = speaks.dense.S, speaks.dense.ratio, speaks.dense.processes.delays
    error = np.average([one.dense.error for one in pieces], axis=0, weights=energy)
    alike = np.array([np.array_equal(one.dense.processes.delays, delays) for one in pieces])
    by_delay = [one.dense.by_delay for one, same in zip(pieces, alike, strict=True) if same]
    late = np.average(by_delay, axis=0, weights=energy[alike]).min(axis=1)
    samples = sum(independent_samples(one) for one in pieces)
    most = limit(float(error.min()), samples, CHI2_2)
    return ErrorSurface(S, ratio, error, most, np.maximum(delays + _late(signals), 0.0) * signals.dt, late)


def _late(signals: Signals) -> float:
    """What the answer to a mean over `thinned` samples, which speaks of their middle, is late by itself [samples]."""
    return 0.5 * (1.0 - 1.0 / signals.thinned)


def _process(found: tuple[float, float, float, float], signals: Signals) -> ProcessFit:
    """Gain, two lags and dead time in samples, as a process in seconds."""
    gain, first, second, delay = found
    integrating = bool(np.isinf(first))
    return ProcessFit(
        gain=gain / (signals.dt if integrating else 1.0),
        time_constant=(second if integrating else first + second) * signals.dt,
        dead_time=max(delay + _late(signals), 0.0) * signals.dt,
        integrating=integrating,
        lag=0.0 if integrating else min(first, second) * signals.dt,
    )


def _stretch(piece: Piece, samples: int, S: float, ratio: float, gain: float = math.nan) -> Stretch:
    """One stretch in the record's samples."""
    signals = piece.signals
    first, last = signals.first, signals.first + signals.target.size
    return Stretch(
        first=first * signals.thinned,
        last=min(last * signals.thinned, samples),
        S=S,
        J=S * ratio,
        fit=100.0 * (1.0 - piece.error),
        fit_linear=100.0 * (1.0 - float(piece.linear.error[0, 0])),
        gain=gain,
    )


def _stitched(signals: Signals, pieces: list[Piece]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stem, sample by sample of OP, and PV of each stretch's own valve and process, cut half way where two meet."""
    n, every = signals.target.size, signals.thinned
    mv, pv = np.full(n * every, np.nan), np.full(n, np.nan)
    starts = np.array([piece.signals.first for piece in pieces])
    ends = np.array([piece.signals.first + piece.signals.target.size for piece in pieces])
    cuts = np.concatenate([[0], (starts[1:] + ends[:-1]) // 2, [n]])
    for piece, low, high in zip(pieces, cuts[:-1], cuts[1:], strict=True):
        first, size = piece.signals.first, piece.signals.target.size
        low, high = max(low, first), min(high, first + size)
        answer = piece.simulated()
        mv[low * every : high * every] = piece.stem[(low - first) * every : (high - first) * every]
        a, b = max(low, first + signals.half), min(high, first + size - signals.half)
        pv[a:b] = (piece.signals.pv - piece.signals.target + answer)[a - first : b - first]
    return mv, pv

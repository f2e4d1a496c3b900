"""One identification out of the stretches that were searched: fit, process, stem and PV from end to end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.interval import CHI2_2, independent_samples, limit
from stiction.diagnosis.identification.processes import in_seconds, late_by_mean
from stiction.diagnosis.identified import ErrorSurface, Identification, Stretch, told_of_J

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.piece import Piece
    from stiction.diagnosis.identification.signals import Signals
    from stiction.records.record import LoopRecord

__all__ = ["assembled", "stretch_of"]


def assembled(
    record: LoopRecord,
    signals: Signals,
    pieces: list[Piece],
    speaks: Piece,
    valve: tuple[float, float],
    ends: tuple[float, float, float, float],
    stretches: list[Stretch],
) -> Identification:
    """Put one identification of Kano's valve together out of the stretches.

    Parameters
    ----------
    record : LoopRecord
        The record.
    signals : Signals
        What was compared.
    pieces : list of Piece
        The stretches, in order.
    speaks : Piece
        The one whose process is reported.
    valve : tuple of float
        S and J [% of span].
    ends : tuple of float
        Ends of the 95 % intervals of S and of J [% of span].
    stretches : list of Stretch
        What each says by itself.

    Returns
    -------
    Identification
        The finding.
    """
    energy = np.array([float(np.sum(one.signals.target**2)) for one in pieces])
    weight = energy / energy.sum()
    answers = [one.simulated() for one in pieces]
    mv, pv = _stitched(signals, pieces, answers)
    good = [one._replace(stem=one.signals.op, sticky=one.linear) for one in pieces]
    _, pv_linear = _stitched(signals, good, [one.simulated() for one in good])
    at = np.minimum(np.arange(len(record)), signals.op.size - 1)
    S, J = valve
    S_low, S_high, J_low, J_high = ends
    J_high = min(J_high, S_high)
    return Identification(
        model="kano",
        S=S,
        J=J,
        S_low=S_low,
        S_high=S_high,
        J_low=J_low,
        J_high=J_high,
        process=in_seconds(speaks.process, signals.dt, signals.thinned),
        fit=100.0 * (1.0 - float(weight @ np.array([one.error for one in pieces]))),
        fit_linear=100.0 * (1.0 - float(weight @ np.array([one.linear.error[0, 0] for one in pieces]))),
        surface=_surface(signals, pieces, speaks, energy, answers),
        mv=mv[at],
        pv=pv[at // signals.thinned],
        linear=in_seconds(speaks.good, signals.dt, signals.thinned),
        pv_linear=pv_linear[at // signals.thinned],
        stretches=tuple(stretches),
        reason=told_of_J(J_low, J_high, S),
    )


def _surface(
    signals: Signals,
    pieces: list[Piece],
    speaks: Piece,
    energy: NDArray[np.float64],
    answers: list[NDArray[np.float64]],
) -> ErrorSurface:
    """The dense searches together, each stretch weighing by its energy; over dead times those that tried the same."""
    S, ratio, delays = speaks.dense.S, speaks.dense.ratio, speaks.dense.processes.delays
    error = np.average([one.dense.error for one in pieces], axis=0, weights=energy)
    alike = np.array([np.array_equal(one.dense.processes.delays, delays) for one in pieces])
    by_delay = [one.dense.by_delay for one, same in zip(pieces, alike, strict=True) if same]
    late = np.average(by_delay, axis=0, weights=energy[alike]).min(axis=1)
    samples = sum(map(independent_samples, pieces, answers))
    most = limit(float(error.min()), samples, CHI2_2)
    dead_time = np.maximum(delays + late_by_mean(signals.thinned), 0.0) * signals.dt
    return ErrorSurface(S, ratio, error, most, dead_time, late)


def stretch_of(piece: Piece, samples: int, S: float, ratio: float, likelier: float = math.nan) -> Stretch:
    """Tell one stretch in the record's samples.

    Parameters
    ----------
    piece : Piece
        The stretch.
    samples : int
        Length of the record [samples].
    S : float
        Its S [% of span].
    ratio : float
        Its J / S [-].
    likelier : float
        Twice the log likelihood by which a sticky valve beats a good one in it [-].

    Returns
    -------
    Stretch
        The stretch.
    """
    signals = piece.signals
    first, last = signals.first, signals.first + signals.target.size
    return Stretch(
        first=first * signals.thinned,
        last=min(last * signals.thinned, samples),
        S=S,
        J=S * ratio,
        fit=100.0 * (1.0 - piece.error),
        fit_linear=100.0 * (1.0 - float(piece.linear.error[0, 0])),
        likelier_than_good=likelier,
    )


def _stitched(
    signals: Signals, pieces: list[Piece], answers: list[NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stem, sample by sample of OP, and PV of each stretch's own valve and process, cut half way where two meet."""
    n, every = signals.target.size, signals.thinned
    mv, pv = np.full(n * every, np.nan), np.full(n, np.nan)
    starts = np.array([piece.signals.first for piece in pieces])
    ends = np.array([piece.signals.first + piece.signals.target.size for piece in pieces])
    cuts = np.concatenate([[0], (starts[1:] + ends[:-1]) // 2, [n]])
    for piece, answer, low, high in zip(pieces, answers, cuts[:-1], cuts[1:], strict=True):
        first, size = piece.signals.first, piece.signals.target.size
        low, high = max(low, first), min(high, first + size)
        mv[low * every : high * every] = piece.stem[(low - first) * every : (high - first) * every]
        a, b = max(low, first + signals.half), min(high, first + size - signals.half)
        pv[a:b] = (piece.signals.pv - piece.signals.target + answer)[a - first : b - first]
    return mv, pv

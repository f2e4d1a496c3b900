"""What the model fits compare: the stem where it was recorded, else the PV, and which rates and beginnings they try."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.processes import LONGEST_DELAY, OF_RECORD, Processes
from stiction.diagnosis.identification.signals import hold_gaps, pieces_of, prepare, require_enough
from stiction.diagnosis.identification.valve_trials import Stretches
from stiction.errors import RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import ProcessFit
    from stiction.records.record import LoopRecord

__all__ = ["begins_of", "near_processes", "rates_of", "signals_of", "wide_processes"]


def signals_of(record: LoopRecord, period: float | None) -> Stretches:
    """The record as the search compares it: by the stem where it was recorded, else by the PV.

    Parameters
    ----------
    record : LoopRecord
        A record with OP, and with PV or MV.
    period : float or None
        Period of the oscillation [s].

    Returns
    -------
    Stretches
        Stem or PV in stretches; each begins with the stem at its recorded place, or else in the middle of its band.

    Raises
    ------
    RecordError
        When the record is too short, or OP, PV or MV does not vary.
    """
    by_stem = record.mv is not None
    if record.mv is not None:
        require_enough(record, "MV", record.mv)
    for name, x in (("OP", record.op), ("MV" if by_stem else "PV", record.mv if by_stem else record.pv)):
        if x is not None and not np.ptp(hold_gaps(x)) > 1e-9 * np.nanmax(np.abs(x)):
            raise RecordError(f"{record.tag}: {name} does not vary; nothing can be identified.")
    if record.mv is not None:
        op, mv = hold_gaps(record.op), hold_gaps(record.mv)
        n = op.size
        scale = period / record.dt if period is not None else n / 5.0
        return Stretches(
            op=op,
            target=mv - mv.mean(),
            width=1,
            half=0,
            dt=record.dt,
            scale=scale,
            bounds=np.array([0, n]),
            windows=np.array([[2, n]]),
            start=np.array([[0.0, 0.0, op[0] - mv[0]]]),
            by_stem=True,
            sign=1.0,
            first=np.zeros(1, dtype=np.int64),
        )
    whole = prepare(record, period)
    pieces = pieces_of(whole)
    sizes = np.array([piece.target.size for piece in pieces])
    windows = []
    for n in sizes:
        late = _longest(whole.scale, n) + 3
        begin = whole.half + late + (round(whole.scale) if n > 6.0 * whole.scale else 0)
        windows.append((min(begin, max(n // 3, whole.half + late)), n - whole.half))
    return Stretches(
        op=np.concatenate([piece.op for piece in pieces]),
        target=np.concatenate([piece.target for piece in pieces]),
        width=whole.thinned,
        half=whole.half,
        dt=record.dt,
        scale=whole.scale,
        bounds=np.concatenate([[0], np.cumsum(sizes)]),
        windows=np.array(windows),
        start=np.zeros((len(pieces), 3)),
        by_stem=False,
        sign=float(fit_controller(record).action),
        first=np.array([piece.first for piece in pieces]),
    )


def rates_of(record: LoopRecord) -> NDArray[np.float64]:
    """Rates at which r is tried: those at which OP moves in the record.

    Parameters
    ----------
    record : LoopRecord
        The record.

    Returns
    -------
    ndarray, shape (n_rates,)
        Zero, the rates at which OP moves, increasing, and infinity [% of span / s]. Between two neighbours no record
        can tell r.
    """
    moves = np.abs(np.diff(hold_gaps(record.op)))
    moves = moves[moves > 0.0] / record.dt
    return np.unique(np.concatenate([[0.0], moves, [np.inf]]))


def begins_of(alone: Stretches, n: int) -> NDArray[np.float64]:
    """Ways in which the stem may begin in a stretch that is alone.

    Where the stem stands is not recorded, and a valve that goes in stairs never forgets it. But a valve that moves
    its loop slips before OP turns, at the latest as it turns: once the sample of the slip is known, so is the stem.

    Parameters
    ----------
    alone : Stretches
        One stretch.
    n : int
        Samples tried before the turn of OP [-].

    Returns
    -------
    ndarray, shape (n_begins, 3)
        As `Stretches.start` has them: in the middle of the band, and moving at `n` samples up to half a period
        before OP turns.
    """
    period = alone.scale * alone.width
    part = alone.op[: round(1.25 * period)]
    turn, way = max((int(np.argmax(part)), 1.0), (int(np.argmin(part)), -1.0))
    slips = np.unique(np.round(np.linspace(max(turn - 0.5 * period, 0.0), turn, n)).astype(int))
    return np.array([[0.0, 0.0, 0.0], *([float(k), way, 0.0] for k in slips)])


def wide_processes(signals: Stretches, known: ProcessFit) -> Processes:
    """Processes for a first look: lags about those known and some shorter and longer ones, dead times far apart.

    Parameters
    ----------
    signals : Stretches
        What is compared.
    known : ProcessFit
        Process that another valve model found: its lags hold for all, its dead time trades with S.

    Returns
    -------
    Processes
        The candidates.
    """
    if signals.by_stem:
        return Processes(np.zeros(1), np.zeros(1), np.array([-1, 0]))
    scale, longest = signals.scale, _longest(signals.scale, int(np.diff(signals.bounds).min()))
    delays = np.unique(np.round(np.linspace(-1.0, longest, 10)).astype(np.int64))
    lag, slow = (time / (signals.dt * signals.width) for time in (known.lag, known.time_constant - known.lag))
    if known.integrating:
        second = np.unique(np.concatenate([[0.0, 0.05 * scale, 0.2 * scale], slow * np.array([0.7, 1.0, 1.4])]))
        return Processes(np.full(second.size, np.inf), second, delays)
    pairs = [(slow * factor, lag * factor) for factor in (0.8, 1.25)]
    pairs += [(share * scale, 0.0) for share in (0.08, 0.3)]
    return Processes(np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs]), delays)


def near_processes(process: NDArray[np.float64], signals: Stretches, spread: float) -> Processes:
    """Processes about one: lags within a factor, a second lag or none, neighbouring dead times.

    Parameters
    ----------
    process : ndarray, shape (4,)
        Gain, first and second lag and dead time, times in samples.
    signals : Stretches
        What is compared.
    spread : float
        Factor between neighbouring lags [-].

    Returns
    -------
    Processes
        The candidates.
    """
    if signals.by_stem:
        return Processes(np.zeros(1), np.zeros(1), np.array([-1, 0]))
    _, first, second, delay = process
    longest = _longest(signals.scale, int(np.diff(signals.bounds).min()))
    centre = min(int(np.floor(delay)), longest - 1)
    delays = np.arange(max(centre - 2, -1), min(centre + 3, longest + 1) + 1)
    factors = spread ** np.arange(-1.0, 2.0)
    if np.isinf(first):
        tails = np.concatenate([[0.0], max(second, 0.7) * factors])
        return Processes(np.full(tails.size, np.inf), tails, delays)
    share = second / first if first > 0.0 else 0.0
    shares = (0.0, 0.2) if share == 0.0 else (share / spread, min(share * spread, 1.0))
    pairs = [(lag, part * lag) for lag in max(first, 0.5) * factors for part in shares]
    if first < 0.7:
        pairs.append((0.0, 0.0))
    return Processes(np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs]), delays)


def _longest(scale: float, n: int) -> int:
    """Longest dead time tried [samples]."""
    return max(round(min(LONGEST_DELAY * scale, OF_RECORD * n)), 2)

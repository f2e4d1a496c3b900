"""The dense search: every stretch of a record, compared about one period, over a grid of valves and processes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.assembled import assembled, stretch_of
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.interval import interval
from stiction.diagnosis.identification.piece import Piece, search_piece
from stiction.diagnosis.identification.signals import Signals, pieces_of, prepare
from stiction.errors import RecordError

if TYPE_CHECKING:
    from stiction.diagnosis.identified import ControllerFit, Identification
    from stiction.records.record import LoopRecord

__all__ = ["Search", "search"]


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
    return Search(record, period, signals, controller, pieces, _roughly(record, signals, pieces))


def _agreed(pieces: list[Piece]) -> int:
    """The stretch whose S is nearest to the others', each weighing by how little it leaves unexplained."""
    S = np.array([piece.valve[0] for piece in pieces])
    weight = np.array([1.0 / (piece.error + 1e-3) for piece in pieces])
    return int(np.argmin(np.abs(S[:, np.newaxis] - S) @ weight))


def _roughly(record: LoopRecord, signals: Signals, pieces: list[Piece]) -> Identification:
    """By the dense searches alone."""
    chosen = _agreed(pieces)
    S, ratio = pieces[chosen].valve
    ratio_low, ratio_high = interval(pieces, chosen, 1)
    ratio_high = min(ratio_high, 1.0)
    stretches = [stretch_of(one, len(record), *one.valve) for one in pieces]
    ends = (*interval(pieces, chosen, 0), S * ratio_low, S * ratio_high)
    return assembled(record, signals, pieces, pieces[chosen], (S, S * ratio), ends, stretches)

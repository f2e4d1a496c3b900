"""Storage rate: at which samples OP and PV were stored, and whether one is stored less often than the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.check_result import CheckResult, check_maximum
from stiction.records.gaps import forward_fill
from stiction.records.quality.quantisation import is_coarse, peak_to_peak, quantisation_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "SlowerSignal",
    "StoredMasks",
    "check_held_values",
    "check_storage_rate",
    "find_repeated",
    "find_slower_signal",
    "find_stored_samples",
]


class SlowerSignal(NamedTuple):
    """Which of OP and PV is stored less often."""

    name: str
    """OP or PV."""
    every: int
    """Samples from one stored value to the next [-]."""
    first: int
    """First sample with a new value [-]."""


class StoredMasks(NamedTuple):
    """At which samples OP and PV were stored."""

    op: NDArray[np.bool_]
    """Where OP was, shape (n_samples,)."""
    pv: NDArray[np.bool_]
    """Where PV was, shape (n_samples,)."""

    @property
    def partial(self) -> dict[str, float]:
        """Signals that were stored at fewer than 98 % of the samples, with that share [-]."""
        shares = {"OP": self.op.sum() / max(self.op.size, 1), "PV": self.pv.sum() / max(self.pv.size, 1)}
        return {name: float(share) for name, share in shares.items() if share < 0.98}


def find_repeated(op: NDArray[np.float64], pv: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark where OP and PV both repeat their last value: the historian stored less often than it was asked.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units], without NaN.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where both are repeated; the first sample is not.

    Examples
    --------
    >>> find_repeated(np.array([1.0, 1.0, 2.0, 2.0]), np.array([5.0, 5.0, 5.0, 6.0])).tolist()
    [False, True, False, False]
    """
    return np.concatenate([[False], (np.diff(op) == 0.0) & (np.diff(pv) == 0.0)])[: op.size]


def find_slower_signal(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    *,
    min_changes: int = 21,
    min_even_share: float = 0.8,
    min_other_share: float = 0.5,
) -> SlowerSignal | None:
    """Find the one of OP and PV that is held for several samples while the other moves.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    min_changes : int
        Fewest changes of the held signal [-].
    min_even_share : float
        Share of its changes that must come a multiple of the interval apart [-].
    min_other_share : float
        Share of the held samples in which the other signal must move [-].

    Returns
    -------
    SlowerSignal or None
        None when both are stored equally often.

    Examples
    --------
    >>> k = np.arange(200)
    >>> find_slower_signal(np.sin(k / 9.0), np.cos((k - k % 4) / 9.0))
    SlowerSignal(name='PV', every=4, first=0)
    """
    moved = {name: np.diff(forward_fill(x)) != 0.0 for name, x in (("OP", op), ("PV", pv))}
    for name, other in (("PV", "OP"), ("OP", "PV")):
        new, held = np.flatnonzero(moved[name]) + 1, ~moved[name]
        other_moves = np.count_nonzero(moved[other] & held) > min_other_share * np.count_nonzero(held)
        if new.size < min_changes or not other_moves:
            continue
        intervals = np.diff(new)
        if 2 * np.count_nonzero(intervals == 1) > intervals.size:  # the median is 1
            continue
        # A coarse value is often stored again unchanged: the interval is then a part of the median one.
        for every in range(int(np.median(intervals)), 1, -1):
            counts = np.bincount(new % every)
            if counts.max() >= min_even_share * new.size:
                return SlowerSignal(name, every, int(counts.argmax()))
    return None


def find_stored_samples(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    *,
    min_left_out: float = 0.02,
    min_move: float = 10.0,
    max_shared: float = 0.98,
    min_pv_left_out: float = 0.03,
) -> StoredMasks:
    """Find the samples at which OP and PV were stored: with a new value, or off the line between their neighbours.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    min_left_out : float
        Share of the samples that must be constant, or on lines, for any to be left out [-].
    min_move : float
        Smallest median move between stored values [quantisation steps]; a coarse signal is constant by itself.
    max_shared : float
        Share of the samples left out of one signal that may be left out of the other too [-]; above it the rows were
        only repeated.
    min_pv_left_out : float
        Share of PV that must be left out for a constant OP to be one that was not stored [-].

    Returns
    -------
    StoredMasks
        The first value counts as stored. All values count when a signal is coarse, when both were only repeated, and
        for an OP that is constant beside a PV stored at every sample: its controller may write no small moves.

    Examples
    --------
    >>> k = np.arange(200)
    >>> stored = find_stored_samples(np.sin(k / 9.0), np.interp(k, [0, 90, 96, 150, 199], [0.0, 5.0, 3.0, 3.5, 1.0]))
    >>> stored.op.all(), np.flatnonzero(stored.pv).tolist()
    (np.True_, [0, 90, 96, 150, 199])
    """
    finite, slower = StoredMasks(np.isfinite(op), np.isfinite(pv)), find_slower_signal(op, pv)
    if slower is not None:
        new = np.arange(op.size) % slower.every == slower.first
        return finite._replace(op=finite.op & new) if slower.name == "OP" else finite._replace(pv=finite.pv & new)
    (op_stored, op_is_held), (pv_stored, _) = (_stored(x, min_left_out, min_move) for x in (op, pv))
    op_left_out, pv_left_out = finite.op & ~op_stored, finite.pv & ~pv_stored
    shared, fewer = (op_left_out & pv_left_out).sum(), min(op_left_out.sum(), pv_left_out.sum())
    repeated = shared > max_shared * fewer > 0.0
    by_itself = op_is_held and op_left_out.any() and pv_left_out.mean() < min_pv_left_out
    return finite if repeated or by_itself else StoredMasks(op_stored, pv_stored)


def check_held_values(
    op: NDArray[np.float64], pv: NDArray[np.float64], samples_per_cycle: float | None
) -> CheckResult | None:
    """OP and PV repeated together: the historian stored less often than it was asked."""
    if len(op) < 2:
        return None
    moves = len(op) - 1
    new = moves - int(find_repeated(op, pv).sum())
    percent = 100.0 * (moves - new) / moves
    finding = f"OP and PV both repeat their last value at {percent:.3g} % of the samples"
    remedy = "export raw values at the rate of the controller"
    # Rounding repeats values too, but not those of OP and PV together; a slow historian renews both at once.
    is_rounded = is_coarse(op) and is_coarse(pv) and 2 * np.sum((np.diff(op) != 0.0) & (np.diff(pv) != 0.0)) < new
    if percent > 20.0 and samples_per_cycle is not None and not is_rounded:
        points = new / moves * samples_per_cycle
        finding += f", and a cycle has {points:.1f} new values"
        if points < 4:
            return CheckResult("held values", "reject", points, 4, "values per cycle", finding, remedy)
    return check_maximum("held values", percent, "%", warn=20.0, finding=finding, remedy=remedy)


def check_storage_rate(op: NDArray[np.float64], pv: NDArray[np.float64]) -> CheckResult | None:
    """One of OP and PV is held for several samples while the other moves."""
    if len(op) < 2:
        return None
    slower = find_slower_signal(op, pv)
    if slower is None:
        return CheckResult("storage rate", "ok", 1.0, 1.0, "samples", finding="OP and PV are stored equally often")
    other = "OP" if slower.name == "PV" else "PV"
    finding = f"{slower.name} is updated only every {slower.every} samples, {other} more often"
    remedy = "export both at the rate of the controller"
    return CheckResult("storage rate", "warn", float(slower.every), 1.0, "samples", finding, remedy)


def _stored(x: NDArray[np.float64], min_left_out: float, min_move: float) -> tuple[NDArray[np.bool_], bool]:
    """Where a signal was stored, gaps' neighbours left out, and whether it is held between (else drawn as lines)."""
    finite = np.isfinite(x)
    known = x[finite]
    step, width = (quantisation_step(known), peak_to_peak(known)) if known.size else (0.0, 0.0)
    pairs = finite[1:] & finite[:-1]
    held, triples = pairs & (np.diff(x) == 0.0), finite[1:-1] & pairs[1:] & pairs[:-1]
    lines = triples & (np.abs(np.diff(x, 2)) <= max(1e-9 * width, 2.5 * step))
    is_held = held.sum() >= lines.sum()
    if max(held.sum(), lines.sum()) <= min_left_out * x.size or (known.size and is_coarse(known)):
        return finite, is_held
    stored = np.ones(x.size, dtype=bool)
    if is_held:
        stored[1:] = pairs & ~held
    else:
        stored[1:-1] = triples & ~lines
    stored &= finite
    moves = np.abs(np.diff(x[stored]))
    return (stored, is_held) if moves.size and np.median(moves) >= min_move * step else (finite, is_held)

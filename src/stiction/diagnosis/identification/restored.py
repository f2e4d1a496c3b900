r"""What a historian left out of OP and PV, told by what it stored and the controller's law.

The controller made every move of OP from what it saw of the PV. Where its law is known, an OP at every sample and a PV
stored by exception are all that there was, and so are two signals that both lack some samples, as long as a sample
lacks no more than the law tells:

.. math:: u_j - u_{j-1} = a_0\,y_j + a_1\,y_{j-1} + a_2\,y_{j-2} + s_j, \qquad j = 1 \dots n - 1

with :math:`s` of the set point and the drift (`lawful.Moves`). These equations, the stored values and, so that what
they do not tell is not made up, what stands in the place of the others, known to about the distance between stored
ones, are solved by least squares: the unknowns of neighbouring samples are joined, so that the matrix is a narrow band,
and all takes some milliseconds. What moves with what stood there is not told by the law, and stays as it was.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.controller import at_limit
from stiction.diagnosis.identification.lawful import FEWEST, moves_of
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.records.gaps import interpolate_gaps
from stiction.records.quality.frozen import find_manual
from stiction.records.quality.storage_rate import StoredMasks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.lawful import Moves
    from stiction.records.record import LoopRecord

__all__ = ["Restored", "restored"]

UNTOLD = 0.1
"""Share of the samples of a signal that were not stored, are not missing, and may be left untold [-]."""
LIMITED = 0.02
"""Share of the samples at a limit of OP beyond which nothing is restored [-]: what is left out there is not told, and
would be the finding."""
SAME = 1e-3
"""Mean square of what the law makes of samples that were not stored, less what stands there, over that of the moves
between stored ones, up to which nothing was left out [-]: an analyser held the PV, and the controller saw it so."""
BUMPS, ROUNDS = 6.0, 3
"""Robust deviations of what an equation leaves beyond which it does not hold, and how often these are found again [-]:
set points that were not recorded, changes of the mode."""
AWAY = 10.0
"""How many times as far as it may be from what stood there a sample comes out where the equations do not tell it but
bend it [-]: where a hand moved OP, a PV that is missing takes that up."""
NO_BUMP = 1e-4
"""Share of the largest move up to which what is left is none [-]: where the law is exact only rounding is left."""
EXACT = 1e-6
"""Standard deviation of what an exact law leaves, over the moves [-]: that of the rounding of the computation."""
SHIFTS, FOLLOWS = 4, 0.02
"""How often what stood there is shifted at random by as much as it may be off, and the share of that by which a sample
may follow and be told by the law [-]."""


class Restored(NamedTuple):
    """A record with what was left out of it."""

    record: LoopRecord
    """As many samples; those that the law does not tell as they were recorded."""
    untold: float
    """The larger share of the samples of OP and PV that are so and not missing [-]."""


def restored(record: LoopRecord, stored: StoredMasks) -> Restored | None:
    """The record with what was left out of OP and PV.

    Parameters
    ----------
    record : LoopRecord
        A record with PV; without SP, a constant one is assumed.
    stored : StoredMasks
        At which samples OP and PV were stored, as `records.quality.find_stored_samples` finds them.

    Returns
    -------
    Restored or None
        None where no law is seen, it leaves too much untold, or nothing was left out: the controller held its OP, or
        saw the PV as it is.

    Notes
    -----
    Derived above. What it brings is counted in ``docs/verdict-measured.md``.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> from stiction.records.quality.storage_rate import find_stored_samples
    >>> from stiction.simulation.historian import exception_reported
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> seldom = exception_reported(run, 0.02)
    >>> kept = find_stored_samples(seldom.op, seldom.pv)
    >>> found = restored(seldom, kept)
    >>> round(float(kept.op.mean()), 2), bool(np.abs(found.record.pv - run.pv).max() < 1e-6)
    (0.92, True)
    """
    assert record.pv is not None
    op, pv = record.op, record.pv
    if min(stored.op.sum(), stored.pv.sum()) < FEWEST:
        return None
    sp = record.sp if record.sp is not None and np.isfinite(record.sp).any() else np.full_like(pv, np.nanmean(pv))
    middle = float(np.nanmean(sp))
    limited = at_limit(hold_gaps(op))
    if limited.mean() > LIMITED:
        return None
    resting = limited | find_manual(record.op, record.pv, record.auto)
    usable = np.isfinite(sp) & ~resting
    kept = stored._replace(op=(stored.op | resting) & np.isfinite(op))
    u, y, r = (np.nan_to_num(x) for x in (op, pv - middle, sp - middle))
    law = moves_of(u, y, r, kept, usable)
    if law is None:
        return None
    usable[1:] &= usable[:-1]
    try:
        whole = _solved(u, y, kept, [np.isfinite(op), np.isfinite(pv)], law, usable)
    except np.linalg.LinAlgError:  # scales so far apart that the rounding is larger than what is looked for
        return None
    untold = 0.0
    for signal, was, own in ((whole.op, op, kept.op), (whole.pv, pv - middle, kept.pv)):
        as_it_was = own | np.isnan(signal)
        signal[as_it_was] = was[as_it_was]
        untold = max(untold, float(np.mean(as_it_was & ~own & np.isfinite(was))))
    if untold > UNTOLD:
        return None
    if _same(whole.op, op, kept.op) and _same(whole.pv, pv - middle, kept.pv):
        return None
    return Restored(replace(record, op=whole.op, pv=whole.pv + middle), untold)


class _Whole(NamedTuple):
    """Both signals, NaN where they are not told."""

    op: NDArray[np.float64]
    pv: NDArray[np.float64]


def _solved(
    u: NDArray[np.float64],
    y: NDArray[np.float64],
    kept: StoredMasks,
    there: list[NDArray[np.bool_]],
    law: Moves,
    usable: NDArray[np.bool_],
) -> _Whole:
    """Solve for what was not stored; again without the equations that do not hold.

    The unknowns are u_0, y_0, u_1, y_1, ...; the equation of a move joins the five from y_{j-2} to y_j. The first
    sample stands before itself, for the first move.
    """
    from scipy.linalg import solveh_banded

    u, y, of_law = (np.concatenate([x[:1], x]) for x in (u, y, law.drive))
    usable, *masks = (np.concatenate([own[:1], own]) for own in (usable, *kept, *there))
    kept, there = StoredMasks(*masks[:2]), masks[2:]
    n = u.size
    free = ~np.stack(kept, axis=1).ravel()
    lines, rooms = zip(*map(_between, (u, y), kept, there), strict=True)
    line, room = (np.stack(both, axis=1).ravel() for both in (lines, rooms))
    shifts = (free * room)[:, np.newaxis] * np.random.default_rng(0).choice([-1.0, 1.0], (2 * n, SHIFTS))
    lines = line[:, np.newaxis] + np.column_stack([np.zeros(2 * n), shifts])
    at = [slice(1 + k, 2 * n - 4 + k, 2) for k in range(5)]
    joins = (-law.past[2], -1.0, -law.past[1], 1.0, -law.past[0])
    unknown = [join * free[part] for join, part in zip(joins, at, strict=True)]
    told = sum(np.where(free[part], 0.0, join * line[part]) for join, part in zip(joins, at, strict=True))
    drive, holds, found = of_law[2:] - told, usable[2:], lines
    least = max(law.variance, EXACT**2 * law.moved)
    for _ in range(ROUNDS):
        precision = np.where(holds, 1.0 / least, 0.0)
        band, right = np.zeros((5, 2 * n)), lines / room[:, np.newaxis] ** 2
        band[4] = room**-2.0
        for i in range(5):
            right[at[i]] += (precision * unknown[i] * drive)[:, np.newaxis]
            for k in range(i, 5):
                band[4 - (k - i), at[k]] += precision * unknown[i] * unknown[k]
        found = solveh_banded(band, right)
        left = np.abs(sum(join * found[part, 0] for join, part in zip(unknown, at, strict=True)) - drive) * holds
        usual = max(np.sqrt(least), 1.4826 * float(np.median(left[holds]))) if holds.any() else 0.0
        off = np.maximum.reduce([left, *(_together(left, own) for own in kept)])
        away = free & (np.abs(found[:, 0] - line) > AWAY * room)
        strays = np.logical_or.reduce([away[part] for part in at])
        broken = holds & (strays | (off > max(BUMPS * usual, NO_BUMP * law.largest)))
        if not broken.any():
            break
        holds = holds & ~broken
    follows = np.sqrt(np.mean((found[:, 1:] - found[:, :1]) ** 2, axis=1))
    x = np.where(free & (follows > FOLLOWS * room), np.nan, found[:, 0])
    return _Whole(x[2::2].copy(), x[3::2].copy())


def _together(left: NDArray[np.float64], own: NDArray[np.bool_]) -> NDArray[np.float64]:
    """What the equations between two stored values leave together, shape of `left`, which begins two samples late.

    What does not fit at the end of a stretch is shared out among its equations.
    """
    stretch = np.cumsum(own)[1:-1]
    return np.sqrt(np.bincount(stretch, left**2))[stretch]


def _between(
    x: NDArray[np.float64], own: NDArray[np.bool_], there: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What was recorded, or the line over what is missing, and by how much what was left out may be off it."""
    value = x[own]
    steps = np.abs(np.diff(value))
    usual = float(np.median(steps)) or float(np.std(value)) or 1.0
    stretch = np.clip(np.cumsum(own) - 1, 0, steps.size - 1)
    line = interpolate_gaps(np.where(own, x, np.nan))
    on_line = there & (x != value[stretch])  # a held value may be as far off as the next one is
    return np.where(there, x, line), np.where(on_line, usual, np.maximum(usual, steps[stretch]))


def _same(whole: NDArray[np.float64], recorded: NDArray[np.float64], own: NDArray[np.bool_]) -> bool:
    """Whether a signal comes out as it was recorded; nothing is said of what was not."""
    changed = (whole - recorded)[~own]
    if not changed.size:
        return True
    return bool(
        np.isfinite(recorded[~own]).all() and np.nanmean(changed**2) <= SAME * np.mean(np.diff(recorded[own]) ** 2)
    )

"""Stiction that comes and goes: which windows of a record stick, and which do not.

A packing that is tightened, a valve that warms up or a positioner that is knocked sticks for part of a record only.
The identification searches stretches of about eight periods by themselves; here each is judged by itself:

- it `sticks` where the band found takes `BAND` of the OP's swing in it, as a cycle of the valve's own must have
  (OP_pp >= S), and the sticky valve explains the PV better than a good one;
- it does not stick (`no_stiction`) where it fails either (`undecided` where only the latter, but a sticky valve
  predicts the PV better: S may have changed in its midst), and wherever a good valve explains most of a PV that
  answers an OP smaller than the record's S: a valve that sticks would have rested;
- otherwise such a window is `undecided`: OP moves too little to free the valve, and nothing shows. So is one in which
  the band fits but explains less than half of the PV.

Windows tell when a valve sticks that is known to stick; they are no verdict of their own. A load that is a triangle
or a square fits a band in one window as well, which the evidence of the whole record must rule out.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.contest import STANDS_OUT
from stiction.diagnosis.result import Window

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.identified import Identification, Stretch
    from stiction.diagnosis.result import Verdict
    from stiction.records.record import LoopRecord

__all__ = ["Window", "changes", "said", "windows"]

BAND = 0.25
"""S over the OP's swing above which a window sticks [-], set on intermittent loops of `simulation.population` (seed
21). On others (seeds 5 and 6) 42 of the 53 windows are found in which the valve stuck for 70 % of the time or more, and
none of the 25 in which it did for 15 % or less. Where the set point moves OP by more than the valve does, it hides the
band."""
STILL = 0.5
"""OP's swing in a window over the record's S below which a stuck valve would not be freed [-]."""
PLAINLY, MUCH = 3.0, 0.1
"""Standard errors by which a drift of S is told [-], and the least change over the record, as a share of S [-]."""
HALF = 50.0
"""Share of a window's PV that a valve must explain to show that it sticks, or in a still window that it follows [%]."""


def windows(part: LoopRecord, found: Identification, start: int = 0) -> tuple[Window, ...]:
    """Judge each stretch of an identification by itself.

    Parameters
    ----------
    part : LoopRecord
        The record as analysed, the one that was identified.
    found : Identification
        What was found in it, about the period of its oscillation.
    start : int
        Sample of the whole record at which `part` begins [-].

    Returns
    -------
    tuple of Window
        In order, their overlaps cut half way, in samples of the whole record; none where the record was searched
        as one stretch.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    >>> record = st.simulate(loop, 70.0, 900.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    >>> [window.verdict for window in windows(record, st.identify(record, period=30.0))]
    ['stiction', 'stiction', 'stiction', 'stiction']
    """
    pieces = found.stretches
    if len(pieces) < 2:
        return ()
    largest = np.sort([piece.S for piece in pieces])[len(pieces) // 2 :]
    usual = float(np.median(largest))  # of the stretches that may stick
    cuts = [(one.last + other.first) // 2 for one, other in pairwise(pieces)]
    ends = [*cuts, pieces[-1].last]
    starts = [pieces[0].first, *cuts]
    judged = []
    for piece, first, last in zip(pieces, starts, ends, strict=True):
        op = part.op[piece.first : piece.last]
        swing = float(np.ptp(op[np.isfinite(op)])) if np.isfinite(op).any() else 0.0
        verdict = _verdict(piece, swing, usual)
        judged.append(Window(start + first, start + last, verdict, piece.S, piece.J, piece.fit, piece.fit_linear))
    return tuple(judged)


def _verdict(piece: Stretch, swing: float, usual: float) -> Verdict:
    if swing < STILL * usual:
        return "no_stiction" if piece.fit_linear > HALF else "undecided"
    if swing * BAND > piece.S:
        return "no_stiction"
    if piece.fit <= piece.fit_linear:
        return "undecided" if piece.likelier_than_good > STANDS_OUT else "no_stiction"
    return "stiction" if piece.fit > HALF else "undecided"


def said(found: Sequence[Window], dt: float) -> str:
    """Say in how many windows the valve sticks, and when.

    Parameters
    ----------
    found : sequence of Window
        The windows of a record.
    dt : float
        Sampling period of the record [s].

    Returns
    -------
    str
        A sentence; empty where there is no window, or where all stick.

    Examples
    --------
    >>> rows = [Window(0, 100, "no_stiction", 0.1, 0.1, 50.0, 50.0), Window(100, 200, "stiction", 3.0, 1.0, 90.0, 80.0)]
    >>> said(rows, dt=2.0)
    'The valve sticks in 1 of 2 windows, from 200 s to 400 s; in the other it follows.'
    """
    sticky = [window for window in found if window.verdict == "stiction"]
    if not found or len(sticky) == len(found):
        return ""
    if not sticky:
        return f"In none of {len(found)} windows by itself is the valve seen to stick."
    spans: list[list[int]] = []
    for window in sticky:
        if spans and spans[-1][1] == window.first:
            spans[-1][1] = window.last
        else:
            spans.append([window.first, window.last])
    when = " and ".join(f"from {first * dt:.6g} s to {last * dt:.6g} s" for first, last in spans)
    others = "the other" if len(found) - len(sticky) == 1 else "the others"
    words = {"no_stiction": "follows", "undecided": "cannot be told"}
    rest = " or ".join(word for verdict, word in words.items() if any(window.verdict == verdict for window in found))
    return f"The valve sticks in {len(sticky)} of {len(found)} windows, {when}; in {others} it {rest}."


def changes(found: Identification, duration: float, unit: str = "%") -> str:
    """Say that S grows or falls over the record, where it plainly does.

    Parameters
    ----------
    found : Identification
        What was found.
    duration : float
        Length of what was analysed [s].
    unit : str
        Unit of S, as it stands behind a number.

    Returns
    -------
    str
        A sentence; empty where the drift is less than `PLAINLY` standard errors or `MUCH` of S, or so large that it
        would begin or end below nothing.
    """
    by = found.drift * duration / 3600.0
    if not (abs(found.drift) > PLAINLY * found.drift_error and MUCH * found.S < abs(by) < 2.0 * found.S):
        return ""
    way = "grows" if by > 0.0 else "falls"
    return f"S {way} by {abs(by):.2g} {unit} over the record ({found.drift:+.2g} {unit} per hour)."

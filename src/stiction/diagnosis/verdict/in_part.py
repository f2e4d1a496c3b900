"""A valve that sticks in part of a record only: the stretch that looks most like it is judged by itself.

All of a record is compared with one valve, and of a long one at most the middle is weighed (`likelihood.MOST_SAMPLES`,
`position.LONGEST`): a valve that stuck for the last hours of a week is a good one by such a comparison. So of a record
that is not called surely sticky one part is diagnosed like a record of its own:

- where a valve position was recorded, the stretch in which it is off that of a good valve by more than `LOOSE` times
  what is usual, and no other;
- in a record of `LONG` samples or more, the one of `PARTS` parts in which some sticky valve predicts the PV best at a
  glance (`identification.glance`), which is cut again if it is long;
- in one that is not called sticky, the longest stretch of windows in each of which the valve sticks by itself
  (`verdict.windows`): where it sticks for a quarter of the time the rest says most.

The verdict on the part is told for the record where it says that the valve sticks, and says so surely. Without a
position it is held at `doubt.MOST`, since the part was picked for what it looks like.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.glance import glance
from stiction.diagnosis.identification.likelihood import kept
from stiction.diagnosis.identification.prediction import behind_lag
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.diagnosis.result import Window
from stiction.diagnosis.verdict.doubt import MOST
from stiction.records.runs import runs

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.position import Watched
    from stiction.diagnosis.result import Diagnosis
    from stiction.diagnosis.verdict.stem import Shown
    from stiction.records.record import LoopRecord

__all__ = ["suspects", "told_of_part"]

PARTS = 4
"""Parts that a long record is cut into [-]."""
PIECES, FEWEST = 32, 100
"""Pieces in which it is seen how far a position is off, at most, and fewest samples of one [-]."""
USUAL = 0.25
"""Share of the pieces in which the valve is taken to follow [-]."""
LONG = 8000
"""Samples from which a record is cut up without a position that asks for it [-]: twice what is weighed at most."""
SHORTEST = 300
"""Samples below which no stretch is cut out [-]."""
OVER = 0.1
"""Share of the record after the part from which it may be that the valve was repaired since [-]."""
IN_PART = "in part of the record"
"""What a reason holds that says so."""
PICKED = f"The part was picked for its looks, so that it allows no more than {MOST:.2f}."
"""What is told of a probability that is held back for it."""
AFTER = "If the valve was repaired since, diagnose what came after by itself."
"""What is told of a part that is over."""
LOOSE = 4.0
"""Mean square by which a position is off a good valve's where it is, over what is usual [-]. In quarters of records
whose valve stuck at the end it was 1.3 to 2.2 there and 0.0004 to 0.0008 before (three records, noise of 0.05 %); what
is cut out for nothing costs a diagnosis, and is told only if that is sure."""


def suspects(part: LoopRecord, stem: Shown | None, shown: Sequence[Window] = ()) -> Iterator[slice]:
    """Pick the parts of a record that look most as if the valve stuck in them.

    Parameters
    ----------
    part : LoopRecord
        The stretch that was analysed.
    stem : Shown or None
        What its valve position shows; None where none was recorded.
    shown : sequence of Window
        The windows of the stretch; none where they are not to be looked at.

    Yields
    ------
    slice
        Samples of the stretch; nothing where no part is worth a look of its own.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> from stiction.diagnosis.verdict.stem import stem_shown
    >>> op, noise = 50.0 + 4.0 * np.sin(np.arange(4000.0) / 15.0), np.random.default_rng(0).normal(0.0, 0.1, 4000)
    >>> stem = np.concatenate([op[:3200], st.stroke(st.Kano(2.0, 1.0), op[3200:], dt=1.0).mv])
    >>> record = st.LoopRecord("FIC-101", 1.0, op=op, pv=stem, mv=stem + noise)
    >>> cut = next(suspects(record, stem_shown(record)))
    >>> abs(cut.start - 3200) <= 130, cut.stop
    (True, 4000)
    """
    if stem is not None and stem.watching is not None:
        loose = _loose(_off(part, stem.watching.good))
        if loose is not None:
            yield loose
            return
    if len(part) >= LONG:
        parts = _cut(len(part), PARTS)
        likelier = [glance(part.window(cut.start, cut.stop)) for cut in parts]
        if max(likelier) > 0.0:
            yield parts[int(np.argmax(likelier))]
    sticks = np.array([window.verdict == "stiction" for window in shown], dtype=bool)
    longest = _longest([slice(shown[first].first, shown[last - 1].last) for first, last in runs(sticks)])
    if SHORTEST <= longest.stop - longest.start < len(part):
        yield longest


def told_of_part(whole: Diagnosis, part: Diagnosis, first: int, start: int = 0) -> Diagnosis:
    """The verdict on a record whose valve sticks in a part of it.

    Parameters
    ----------
    whole : Diagnosis
        The verdict on the whole record.
    part : Diagnosis
        The verdict on a part of it.
    first : int
        First sample of the part.
    start : int
        Samples by which the record itself begins after the one that times are told of.

    Returns
    -------
    Diagnosis
        That of the part where it is that the valve sticks, and surely so; else that of the whole.
    """
    if part.verdict != "stiction" or part.probability < MOST:
        return whole
    seen = any(row.method == "stem" and row.valid for row in part.evidence)
    probability = part.probability if seen else min(part.probability, MOST)
    rest = (1.0 - probability) / max(1.0 - part.probability, 1e-12)
    causes = {name: probability if name == "stiction" else rest * share for name, share in part.causes.items()}
    dt, quality, found = whole.record.dt, part.quality, part.identification
    assert found is not None
    begin, end = first + quality.first, first + quality.last
    one = Window(start + begin, start + end, "stiction", found.S, found.J, found.fit, found.fit_linear)
    when = f"from {one.first * dt:.6g} s to {one.last * dt:.6g} s"
    held = f" {PICKED}" if probability < part.probability else ""
    where = "" if IN_PART in part.reason else f"The valve sticks in part of the record, {when}."
    over = end < (1.0 - OVER) * whole.quality.last and AFTER not in part.action
    return replace(
        part, record=whole.record, stored=whole.stored, probability=probability, causes=causes,
        reason=f"{where} {part.reason}{held}".strip(),
        action=f"{part.action} {AFTER}" if over else part.action, windows=part.windows or (one,),
        quality=replace(
            quality, rows=whole.quality.rows, duration=whole.quality.duration, bad_percent=whole.quality.bad_percent,
            first=begin, last=end,
        ),
    )  # fmt: skip


def _cut(n: int, parts: int) -> list[slice]:
    """Cut so many samples into parts."""
    ends = np.linspace(0, n, parts + 1).astype(int).tolist()
    return [slice(first, last) for first, last in pairwise(ends)]


def _loose(off: NDArray[np.float64]) -> slice | None:
    """The longest stretch in which a position is off a good valve's, of those long enough; None where it never is."""
    parts = _cut(off.size, min(off.size // FEWEST, PIECES))
    if len(parts) < PARTS:
        return None
    mean = np.array([float(np.nanmean(off[cut])) if np.isfinite(off[cut]).any() else 0.0 for cut in parts])
    beyond = mean > LOOSE * np.quantile(mean, USUAL)
    stretches = [slice(parts[first].start, parts[last - 1].stop) for first, last in runs(beyond)]
    longest = _longest(stretches)
    return longest if SHORTEST <= longest.stop - longest.start < off.size else None


def _longest(stretches: list[slice]) -> slice:
    """The longest of some stretches; an empty one of none."""
    return max(stretches, key=lambda cut: cut.stop - cut.start, default=slice(0, 0))


def _off(part: LoopRecord, good: Watched) -> NDArray[np.float64]:
    """Square of how far the position is off that of a good valve, sample by sample [% of span squared]."""
    sent = part.op if part.valve_signal is None else part.valve_signal
    op, air = np.ascontiguousarray(hold_gaps(sent)), np.empty(len(part))
    behind_lag(op, float(kept(np.array([good.lag]))[0]), air)
    assert part.mv is not None
    off = np.full(len(part), np.nan)
    off[good.late :] = part.mv[good.late :] / good.slope - air[: len(part) - good.late]
    off[~np.isfinite(sent)] = np.nan
    return (off - np.nanmedian(off)) ** 2

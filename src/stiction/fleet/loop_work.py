"""The work on one loop of an audit: the screen, which gives its place in the queue, and the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.fleet.block_means import BlockMeans, Clock, make_block_means
from stiction.fleet.loop_metrics import loop_metrics
from stiction.fleet.loop_oscillations import find_loop_oscillations
from stiction.fleet.loop_row import LoopRow
from stiction.fleet.rank import rank_row
from stiction.fleet.source_parts import LoopPlace, read_loop

if TYPE_CHECKING:
    from stiction.diagnosis.evidence.further import StoredWindow
    from stiction.fleet.stored_windows import KnownWindows
    from stiction.records.record import LoopRecord

__all__ = ["WorkSettings", "cut_time", "diagnose_loop", "screen_loop"]


@dataclass(frozen=True)
class WorkSettings:
    """What the work on each loop depends on."""

    clock: Clock
    """Blocks that all loops share."""
    since: datetime | None = None
    """First time."""
    until: datetime | None = None
    """Time before which the samples end."""
    prior: float = 0.25
    """Share of sticky valves in the plant [-]."""
    costs: tuple[float, float, float] = (1.0, 1.0, 0.3)
    """Costs of a false alarm, a missed sticky valve, and an open question."""
    smallest_S: float = 1.0
    """Smallest S that matters [% of span]."""
    time_limit: float = 60.0
    """Longest processor time for one loop [s]."""


def screen_loop(place: LoopPlace, settings: WorkSettings) -> tuple[LoopRow, BlockMeans | None]:
    """Screen one loop: block means for the groups, and oscillation and severity, which give its place in the queue.

    It leaves no loop out, except where OP or PV has no value.

    Raises
    ------
    RecordError
        When the loop cannot be read.
    """
    from stiction.sources.signal_values import EmptySignalError

    row = LoopRow.of_place(place)
    try:
        record = cut_time(read_loop(place), settings.since, settings.until)
    except EmptySignalError as error:
        return _skip(row, settings, str(error)), None
    for name, x in (("OP", record.op), ("PV", record.pv)):
        if x is None or not np.isfinite(x).any():
            reason = f"The record has no {name}." if x is None else f"The record has no value of {name} in this time."
            return _skip(row, settings, reason), None
    means = make_block_means(record, settings.clock)
    oscillations = find_loop_oscillations(means)
    index = max((one.height for one in oscillations if one.regular), default=0.0)
    metrics = loop_metrics(record, span=place.span, oscillation_index=index)
    row = row.with_record(record, metrics, is_secondary=bool(place.master))
    return rank_row(replace(row, oscillations=oscillations)), means


def diagnose_loop(
    place: LoopPlace, settings: WorkSettings, screened: LoopRow, known: KnownWindows | None = None
) -> tuple[LoopRow, tuple[StoredWindow, ...]]:
    """Diagnose one loop as `stiction.diagnose` does, with the windows that are known, and complete its row.

    Returns the row, and the windows that are new or changed. Windows of other models are judged again where the source
    still holds them.

    Raises
    ------
    RecordError
        When the loop cannot be read.
    """
    from stiction.diagnosis.pipeline import diagnose_new
    from stiction.diagnosis.verdict.decision import Costs

    record = read_loop(place)
    windows = known.windows if known else []
    since = settings.since
    if since is not None and known and record.start is not None:
        begins = [one.begin for one in windows] + [datetime.fromisoformat(text) for text in known.others]
        since = min([since, *begins], key=lambda moment: moment.replace(tzinfo=None))
    record = cut_time(record, since, settings.until)
    judgement = {"prior": settings.prior, "costs": Costs(*settings.costs), "smallest_S": settings.smallest_S}
    found, new = diagnose_new(record, windows, known.length if known else None, **judgement)
    row = screened.with_diagnosis(found)
    if known:
        judged = {one.begin.isoformat() for one in (*windows, *new)}
        row = replace(row, windows_left_out=len(known.others - judged))
    return rank_row(row), tuple(new)


def cut_time(record: LoopRecord, since: datetime | None, until: datetime | None) -> LoopRecord:
    """Cut the samples from `since` on and before `until`; a time without a zone is in the zone of the record.

    Raises
    ------
    RecordError
        When the record has no times.
    """
    if since is None and until is None:
        return record
    if record.start is None:
        raise RecordError(f"{record.tag} has no times, so since and until cannot be used; leave them out.")
    ends = [0, len(record)]
    for k, moment in enumerate((since, until)):
        if moment is not None:
            start = record.start
            if start.tzinfo is not None and moment.tzinfo is None:
                moment = moment.replace(tzinfo=start.tzinfo)
            elif start.tzinfo is None and moment.tzinfo is not None:
                start = start.replace(tzinfo=moment.tzinfo)
            ends[k] = max(0, min(len(record), int(np.ceil((moment - start).total_seconds() / record.dt - 1e-9))))
    return record.window(ends[0], max(ends))


def _skip(row: LoopRow, settings: WorkSettings, reason: str) -> LoopRow:
    """Row of a loop without a signal."""
    about = {"status": "skipped", "loop_state": "bad_data", "probability": settings.prior}
    return rank_row(replace(row, **about, reason=reason, action="Record PV and OP."))

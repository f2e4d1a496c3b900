"""The records of a window, one Parquet file for each loop: of collected samples, or of what a source keeps itself."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.atomic_write import safe_file_name
from stiction.errors import RecordError, StictionError
from stiction.fleet.find_loops import area_of_tag
from stiction.fleet.loop_work import cut_time
from stiction.foreign_errors import failure_of
from stiction.records.parquet_writer import to_parquet
from stiction.records.record import LoopRecord, Provenance
from stiction.sources import open_loops
from stiction.sources.historians.address import is_historian_url
from stiction.sources.historians.historian_loops import make_loops
from stiction.sources.historians.opc_ua_history import quality_word
from stiction.sources.historians.tag_history import HistorianTag, TagHistory, make_history
from stiction.sources.options import ReadOptions
from stiction.watch.samples import window_name

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from stiction.sources.loops import Loops
    from stiction.watch.configuration import SourceSettings
    from stiction.watch.samples import SampleFiles
    from stiction.watch.store import WatchStore

__all__ = ["WindowRecords", "write_window"]


class WindowRecords(NamedTuple):
    """What was written for a window."""

    folder: Path
    """Folder of the files."""
    loops: int
    """Loops written [-]."""
    failures: dict[str, str]
    """Source or loop that could not be read -> why."""
    doubles: int
    """Collected samples that had come twice [-]."""


def write_window(
    folder: Path, sources: Sequence[SourceSettings], samples: SampleFiles, store: WatchStore, start: int, finish: int
) -> WindowRecords:
    """Write the records of all sources from `start` to before `finish` [microseconds since 1970]."""
    target = folder / "parts" / window_name(start)
    span = tuple(datetime.fromtimestamp(one / 1e6, UTC) for one in (start, finish))
    rows, doubles = samples.read(start)
    failures: dict[str, str] = {}
    written: set[str] = set()
    for source in sources:
        try:
            loops = _collected(source, store, rows, span) if source.is_live else _stored(source, span)
        except StictionError as error:
            failures[source.address] = str(error)
            continue
        for number, tag in enumerate(loops.tags):
            try:
                record = cut_time(loops.read_one(number), *span)
            except BaseException as error:
                failures[tag] = str(failure_of(error, tag))
                record = _empty_record(tag, span, failures[tag])
            name = tag if tag not in written else f"{tag} ({source.address})"
            written.add(name)
            area = (loops.roles[number].area if number < len(loops.roles) else "") or area_of_tag(tag)
            _write(record, target / safe_file_name(area or "plant"), name)
    _keep_last_values(store, rows, start)
    return WindowRecords(target, len(written), failures, doubles)


def _write(record: LoopRecord, folder: Path, tag: str) -> None:
    from dataclasses import replace

    folder.mkdir(parents=True, exist_ok=True)
    to_parquet(replace(record, tag=tag, other_readings=()), folder / f"{safe_file_name(tag)}.parquet")


def _empty_record(tag: str, span: tuple[Any, ...], reason: str) -> LoopRecord:
    """Record of a loop without values, which an audit lists with its reason."""
    nothing = np.full(2, np.nan)
    step = (span[1] - span[0]).total_seconds() / 2.0
    return LoopRecord(tag, step, op=nothing, pv=nothing, start=span[0], provenance=Provenance(assumptions=(reason,)))


def _stored(source: SourceSettings, span: tuple[Any, ...]) -> Loops:
    """Loops of a source that keeps its values itself."""
    options: dict[str, Any] = {"map": source.map or None, **source.reading}
    if is_historian_url(source.address):
        options |= {"tags": list(source.tags) or None}
    if is_historian_url(source.address) or "time" in options:
        options |= {"since": span[0].isoformat(), "until": span[1].isoformat()}
    return open_loops(source.address, **options)


def _collected(source: SourceSettings, store: WatchStore, rows: NDArray, span: tuple[Any, ...]) -> Loops:
    """Loops of a live source, whose values were collected."""
    tags: dict[int, HistorianTag] = {}
    for number, body in store.tags(source.address).items():
        body["span"] = body["span"] and tuple(body["span"])
        tags[number] = HistorianTag(**body)
    if not tags:
        raise RecordError("was never reached, so its loops are not known.", where=source.address)
    map_rows = None
    if source.map:
        from stiction.sources.roles.map_file import read_map

        map_rows = read_map(source.map)
    options = ReadOptions(**{"map": source.map or None, **source.reading})
    client = _SampledTags(tags, rows, store, span[0].timestamp())
    return make_loops(client, list(tags.values()), source.address, (span[0], span[1]), options, map_rows)


class _SampledTags:
    """The samples of a window as a historian gives them."""

    def __init__(self, tags: dict[int, HistorianTag], rows: NDArray, store: WatchStore, begin: float) -> None:
        self.numbers = {tag.name: number for number, tag in tags.items()}
        self.rows, self.begin, self.texts = rows, begin, store.texts()
        self.before = _values_before(store, round(1e6 * begin))

    def find_tags(self, wanted: Sequence[str], *, exact: bool) -> list[HistorianTag]:
        """Not asked for: the tags are known."""
        raise NotImplementedError

    def read(
        self, tags: Sequence[HistorianTag], since: datetime, until: datetime
    ) -> dict[str, TagHistory | StictionError]:
        """Samples of tags; each begins with the value that stood before the window, where there is one."""
        del since, until  # the samples are those of one window
        return {tag.name: self._history(self.numbers[tag.name]) for tag in tags}

    def _history(self, number: int) -> TagHistory:
        first, last = np.searchsorted(self.rows["tag"], [number, number + 1])
        mine = self.rows[first:last]
        seconds, status = (mine["stamp"] / 1e6).tolist(), mine["status"].tolist()
        values: list[Any] = [
            self.texts.get(text) if text >= 0 else None if value != value else value
            for text, value in zip(mine["text"].tolist(), mine["value"].tolist(), strict=True)
        ]
        before = self.before.get(str(number))
        if before and (not seconds or seconds[0] > self.begin):
            text, code, value = before
            seconds, status = [self.begin, *seconds], [code, *status]
            values = [self.texts.get(text) if text >= 0 else value, *values]
        words = {code: quality_word(code) for code in set(status)}
        return make_history(seconds, values, [words[code] for code in status])


LAST_VALUES = "last values "


def _values_before(store: WatchStore, start: int) -> dict[str, list[Any]]:
    """Number of a tag -> text, status and value that stood before a window."""
    query = "SELECT name FROM fact WHERE name LIKE ? AND name < ? ORDER BY name DESC LIMIT 1"
    found = store.query(query, f"{LAST_VALUES}%", f"{LAST_VALUES}{start:020d}")
    return store.fact(found[0]["name"], {}) if found else {}


def _keep_last_values(store: WatchStore, rows: NDArray, start: int) -> None:
    """Keep the last value of each tag for the next window, which may have none of a tag that does not change."""
    known = _values_before(store, start)
    for one in rows[np.append(rows["tag"][1:] != rows["tag"][:-1], True)[: rows.size]]:
        value = None if np.isnan(one["value"]) else float(one["value"])
        known[str(one["tag"])] = [int(one["text"]), int(one["status"]), value]
    with store.transaction():
        store.set_fact(f"{LAST_VALUES}{start:020d}", known)
        names = [row["name"] for row in store.query("SELECT name FROM fact WHERE name LIKE ?", f"{LAST_VALUES}%")]
        for name in sorted(names)[:-3]:
            store.change("DELETE FROM fact WHERE name = ?", name)

"""Where a loop is: the part of the source that holds it, and how it is read from there."""

from __future__ import annotations

import hashlib
import json
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, Setting
from stiction.fleet.database_parts import find_table_state

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.records.record import LoopRecord
    from stiction.sources.loops import Loops

__all__ = ["LoopPlace", "SourcePart", "place_from_dict", "place_to_dict", "read_loop"]

MAX_OPEN_PARTS = 4
"""Parts that a process keeps open [-]."""
_open_parts: OrderedDict[tuple[SourcePart, Any], Loops] = OrderedDict()


@dataclass(frozen=True)
class SourcePart:
    """A part of the source that is opened by itself: one file, several files of one table, or a database."""

    names: tuple[str, ...]
    """Files or database URL."""
    options: str = "{}"
    """Options of `stiction.read`, as JSON."""

    @property
    def display_name(self) -> str:
        """Name for messages and tables, without a password."""
        from stiction.sources.database_url import is_database_url, show_url
        from stiction.sources.historians.address import is_historian_url

        is_url = is_database_url(self.names[0]) or is_historian_url(self.names[0])
        first = show_url(self.names[0]) if is_url else Path(self.names[0]).name
        first = first.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
        return first if len(self.names) == 1 else f"{first} and {len(self.names) - 1} more"

    def open(self) -> Loops:
        """Open the part, or give it as it was opened before in this process."""
        from stiction.sources import open_loops

        key = self, self._file_states()
        if key not in _open_parts:
            while len(_open_parts) >= MAX_OPEN_PARTS:
                _open_parts.popitem(last=False)
            source = self.names[0] if len(self.names) == 1 else list(self.names)
            _open_parts[key] = open_loops(source, **json.loads(self.options))
        _open_parts.move_to_end(key)
        return _open_parts[key]

    def fingerprint(self, states: dict[str, str]) -> str:
        """Digest of names, sizes and times of the files: a change means that the loops are audited again.

        Of a database it is the newest time in the table, unless the audited time ends; `states` keeps it for the other
        parts of the same table. Of a historian it is the time that is read.
        """
        from stiction.sources.database_url import is_database_url, show_url
        from stiction.sources.historians.address import is_historian_url

        state = repr(self._file_states())
        if is_historian_url(self.names[0]):
            return hashlib.sha256(repr((self.names, self.options)).encode()).hexdigest()[:16]
        if is_database_url(self.names[0]):
            options = {name: value for name, value in json.loads(self.options).items() if name != "tags"}
            key = repr((self.names[0], options))
            if key not in states:
                states[key] = find_table_state(self.names[0], options)
            state = states[key]
        return hashlib.sha256(repr(([show_url(name) for name in self.names], state)).encode()).hexdigest()[:16]

    def _file_states(self) -> tuple[tuple[int, int] | None, ...]:
        """Size and time of each file; None of what is no file."""
        stats = [path.stat() if (path := Path(name)).is_file() else None for name in self.names]
        return tuple(stat and (stat.st_size, stat.st_mtime_ns) for stat in stats)


@dataclass(frozen=True)
class LoopPlace:
    """Where one loop is, and what the source says of it."""

    tag: str
    """Tag of the loop, unique in the audit."""
    part: SourcePart
    """The part of the source."""
    number: int
    """Number of the loop in the part, from 0; -1 where it is found by its tag."""
    area: str = ""
    """Area of the plant."""
    importance: float = 1.0
    """Weight that the plant gives the loop [-]."""
    span: tuple[float, float] | None = None
    """Range of the transmitter, by the map [engineering units]."""
    master: str = ""
    """Tag of the loop whose OP is the set point of this one, by the map."""
    secondary: str = ""
    """Tag of the loop whose set point is the OP of this one, by the map."""
    failure: str = ""
    """Why no loop could be read from the part; then the tag is the name of the file."""


def read_loop(place: LoopPlace) -> LoopRecord:
    """Read the record of one loop, under its tag of the audit; good codes that its file does not have do not count.

    Raises
    ------
    RecordError
        When it cannot be read.
    """
    if place.failure:
        raise RecordError(place.failure)
    try:
        record = _read(place)
    except RecordError as error:
        options = json.loads(place.part.options)
        codes = options.pop("good_codes", None)
        if codes is None or not any(isinstance(part, Setting) and part.name == "good_codes" for part in error.args):
            raise
        note = f"None of the good codes {codes} is in {place.part.display_name}: read without them."
        record = _read(replace(place, part=replace(place.part, options=json.dumps(options))))
        origin = record.provenance
        record = replace(record, provenance=replace(origin, assumptions=(*origin.assumptions, note)))
    if place.secondary:
        record = replace(record, provenance=replace(record.provenance, secondary_tag=place.secondary))
    return record if record.tag == place.tag else replace(record, tag=place.tag)


def _read(place: LoopPlace) -> LoopRecord:
    """Read the record of one loop, under the tag that its source gives it."""
    loops = place.part.open()
    return loops.read_one(place.number if place.number >= 0 else _find_tag(loops, place))


def place_to_dict(place: LoopPlace) -> dict[str, Any]:
    """JSON-ready form of a place, without a password."""
    from stiction.sources.database_url import show_url

    part = {"names": [show_url(name) for name in place.part.names], "options": json.loads(place.part.options)}
    return {**vars(place), "part": part}


def place_from_dict(stored: Mapping[str, Any]) -> LoopPlace:
    """Place from its JSON-ready form."""
    part = SourcePart(tuple(stored["part"]["names"]), json.dumps(stored["part"]["options"]))
    span = stored["span"] and tuple(stored["span"])
    return LoopPlace(**{**stored, "part": part, "span": span})


def _find_tag(loops: Loops, place: LoopPlace) -> int:
    """Number of a loop in its part, by its tag."""
    for number, tag in enumerate(loops.tags):
        if tag.casefold() == place.tag.casefold():
            return number
    raise RecordError(
        f"{place.part.display_name} has no OP and PV of this loop in this time range; check the map.", where=place.tag
    )

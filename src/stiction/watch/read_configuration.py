"""Read the configuration of a watch; an error names file, line, key, value and remedy."""

from __future__ import annotations

import difflib
import re
import tomllib
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_origin, get_type_hints

from stiction.errors import RecordError, StictionError
from stiction.watch.configuration import AlarmSettings, ChannelSettings, MetricsSettings, SourceSettings, WatchConfig

if TYPE_CHECKING:
    import os

__all__ = ["read_configuration"]

SECTIONS = {"source": SourceSettings, "channel": ChannelSettings, "alarms": AlarmSettings, "metrics": MetricsSettings}
REPEATED = ("source", "channel")
KINDS = {str: "a text in quotes", int: "a whole number", float: "a number", bool: "true or false", tuple: "a list"}


def read_configuration(path: str | os.PathLike[str]) -> WatchConfig:
    """Read and check a configuration.

    Raises
    ------
    RecordError
        When the file cannot be read, a key is unknown, or a value is of another type or outside its limits; the
        message names the line.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8-sig")
        given = tomllib.loads(text)
    except OSError as error:
        remedy = "check the path, or write one with stiction watch --init SOURCE"
        raise RecordError(f"cannot be read ({error.strerror})", remedy=remedy, where=file) from None
    except UnicodeDecodeError:
        raise RecordError("is not UTF-8 text; save it in UTF-8.", where=file) from None
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        reason = re.sub(r" \(at .*", "", str(error))
        where = f"{file}, line {line[1]}" if line else str(file)
        raise RecordError(f"is not TOML: {reason}; correct it.", where=where) from None
    lines = _Lines(file, text)
    about: dict[str, Any] = {}
    for name, value in given.items():
        if name in SECTIONS:
            about[name] = _sections(lines, name, value)
    plain = {name: value for name, value in given.items() if name not in SECTIONS}
    return _make(lines, WatchConfig, plain, about, "")


def _sections(lines: _Lines, name: str, value: Any) -> Any:
    """Values of the sections of one name."""
    kind = SECTIONS[name]
    if name in REPEATED:
        if not (isinstance(value, list) and all(isinstance(one, dict) for one in value)):
            raise RecordError(f"{name} is not a section; write [[{name}]].", where=lines.of(name))
        return tuple(_make(lines, kind, one, {}, f"{name} {k}") for k, one in enumerate(value))
    if not isinstance(value, dict):
        raise RecordError(f"{name} is not a section; write [{name}].", where=lines.of(name))
    return _make(lines, kind, value, {}, name)


def _make(lines: _Lines, kind: type, given: dict[str, Any], about: dict[str, Any], section: str) -> Any:
    """Make a part of the configuration, each key checked for its name and its type."""
    hints = get_type_hints(kind)
    names = [one.name for one in fields(kind) if not is_dataclass(hints[one.name])]
    for name, value in given.items():
        if name not in names:
            close = difflib.get_close_matches(name, [*names, *(SECTIONS if not section else ())], 1)
            remedy = f"did you mean {close[0]}?" if close else f"use one of {', '.join(names)}."
            if SECRET.search(name):
                remedy = "set STICTION_HISTORIAN_USER and STICTION_HISTORIAN_PASSWORD, or write credentials.toml."
                raise RecordError(f"{name}: credentials do not stand here; {remedy}", where=lines.of(name, section))
            raise RecordError(f"{name} = {value!r}: the key is unknown; {remedy}", where=lines.of(name, section))
        about[name] = _value(lines, name, value, hints[name], section)
    missing = [one.name for one in fields(kind) if one.default is MISSING and one.default_factory is MISSING]
    for name in missing:
        if name not in about:
            place = f"[[{name}]]" if name in REPEATED else name
            raise RecordError(f"{place} is missing; write it.", where=lines.of(None, section))
    try:
        return kind(**about)
    except RecordError:
        raise
    except StictionError as error:
        named = re.match(r"\w+", str(error))
        key = named[0] if named and named[0] in about else None
        raise RecordError(str(error), where=lines.of(key, section)) from None


def _value(lines: _Lines, name: str, value: Any, hint: Any, section: str) -> Any:
    """A value in the type of its field."""
    wanted = get_origin(hint) or hint
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if wanted is tuple:
        listed = [value] if isinstance(value, str) else value
        if isinstance(listed, list) and all(isinstance(one, str) for one in listed):
            return tuple(listed)
    elif wanted not in KINDS:
        if isinstance(value, dict):
            return value
    elif type(value) is wanted:
        return value
    what = "a list of texts" if wanted is tuple else KINDS.get(wanted, "a table {key = value}")
    raise RecordError(f"{name} = {value!r} is of the wrong type; give {what}.", where=lines.of(name, section))


SECRET = re.compile("pass|secret|token|credential|^user$", re.I)
"""Keys whose values no message shows."""


class _Lines:
    """Where keys stand in the text."""

    def __init__(self, file: Path, text: str) -> None:
        self.file = file
        self.first: dict[tuple[str, str | None], int] = {}
        counts: dict[str, int] = {}
        section = ""
        for number, line in enumerate(text.splitlines(), 1):
            if header := re.match(r"\s*(\[\[?)\s*([\w.-]+)\s*\]", line):
                name = header[2].split(".")[0]
                if header[1] == "[[":
                    counts[name] = counts.get(name, -1) + 1
                section = f"{name} {counts[name]}" if name in REPEATED and name in counts else name
                self.first.setdefault((section, None), number)
                self.first.setdefault(("", name), number)
            elif key := re.match(r"\s*([\w-]+)\s*=", line):
                self.first.setdefault((section, key[1]), number)

    def of(self, key: str | None, section: str = "") -> str:
        """File and line of a key, else of its section, else the file."""
        number = self.first.get((section, key)) or self.first.get((section, None))
        return f"{self.file}, line {number}" if number else str(self.file)

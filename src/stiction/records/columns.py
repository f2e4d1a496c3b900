"""Which column is which: header names to signals of loops, by the words of `stiction.records.dialects`."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.records.dialects import (
    INDEX_WORDS,
    OUTPUT_WHEN_ALONE,
    SIGNAL_WORDS,
    TIME_UNITS,
    TIME_WORDS,
    UNIT_WORDS,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["Assignment", "assign", "choose_names", "unit_of"]

SIGNALS = ("pv", "sp", "op", "mv", "valve_signal", "mode", "bad", "quality")
_WORD_TO_SIGNAL = {word: signal for signal, words in SIGNAL_WORDS.items() for word in words}
_BY_LENGTH = sorted(_WORD_TO_SIGNAL, key=len, reverse=True)
_WORDS = "|".join(re.escape(word) for word in _BY_LENGTH)
_BEHIND = re.compile(rf"(.*?[^./\\:|_\s-])\s*[./\\:|_\s-]+({_WORDS})")
_BEFORE = re.compile(rf"({_WORDS})(?:[._\s:-]+(?=.*\d)(.+)|(\d+))")
_UNIT = re.compile(r"\s*[\[(]([^\])]*)[\])]\s*$")
_MEASURED = "|".join(re.escape(word) for word in _BY_LENGTH if _WORD_TO_SIGNAL[word] in ("pv", "sp", "op", "mv"))
_UNITS = "|".join(map(re.escape, UNIT_WORDS))
_UNIT_BEHIND = re.compile(
    rf"\s*[\"']?((?:.*[^./\\:|_\s-][./\\:|_-]+)?(?:{_MEASURED}))[_\s]+({_UNITS})[\"']?\s*", re.IGNORECASE
)
_BLOCK = re.compile(r"/P?ID\w*$|/PID_\w+$", re.IGNORECASE)


@dataclass
class Assignment:
    """Columns of the source, by what they hold."""

    time: list[int] = field(default_factory=list)
    """One column, or a date and a time of day."""
    index: int | None = None
    """A column that only counts the samples."""
    loops: dict[str, dict[str, int]] = field(default_factory=dict)
    """Tag ("" when the header has none) -> signal -> column."""
    ignored: list[str] = field(default_factory=list)
    guesses: list[str] = field(default_factory=list)


def unit_of(name: str) -> str:
    """Return the unit at the end of a column name, in brackets or behind the word of a signal, as it is written."""
    found = _UNIT.search(_bracketed(name))
    return found.group(1).strip() if found else ""


def _bracketed(name: str) -> str:
    """A signal with its unit behind it as one with the unit in brackets: ``FIC-1.OP_mA`` -> ``FIC-1.OP [mA]``."""
    found = _UNIT_BEHIND.fullmatch(name)
    return f"{found.group(1)} [{found.group(2)}]" if found else name


def _word(name: str) -> str:
    return " ".join(_UNIT.sub("", _bracketed(name)).strip().strip("\"'").upper().split())


def time_unit(name: str, unit: str) -> float | None:
    """Return the seconds per unit of a time column: `time_ms`, `Time [min]` or a units row."""
    tail = _word(name).replace("_", " ").rsplit(" ", 1)[-1]
    for text in (unit_of(name).upper(), unit.upper(), tail):
        if text in TIME_UNITS:
            return TIME_UNITS[text]
    return None


def _is_time(name: str) -> bool:
    word = _word(name).lstrip("_")
    head, _, tail = word.replace("_", " ").rpartition(" ")
    return word in TIME_WORDS or word.replace("_", " ") in TIME_WORDS or (head in TIME_WORDS and tail in TIME_UNITS)


def signal_of(name: str) -> tuple[str, str] | None:
    """Return tag and word of a column name: ``FIC-101/PID1/PV.CV`` -> ``("FIC-101/PID1", "PV.CV")``.

    Examples
    --------
    >>> signal_of("FIC-101.PV"), signal_of("Set point [t/h]"), signal_of("FIC-1.OP_mA"), signal_of("FLOW")
    (('FIC-101', 'PV'), ('', 'SET POINT'), ('FIC-1', 'OP'), None)
    """
    word = _word(name)
    if word in _WORD_TO_SIGNAL:
        return "", word
    if (spaced := word.replace("_", " ")) in _WORD_TO_SIGNAL:
        return "", spaced
    plain = " ".join(_UNIT.sub("", name).strip().strip("\"'").split())
    if found := _BEHIND.fullmatch(word):
        return plain[: len(found.group(1))].rsplit("\\", 1)[-1], found.group(2)
    if found := _BEFORE.fullmatch(word):
        return plain[found.start(2) :] if found.group(2) else found.group(3), found.group(1)
    return None


def choose_names(header: list[list[str]]) -> tuple[list[str], list[str]]:
    """Choose column names and units out of up to three header rows.

    A header may be names, units, description in any order, or the tag in one row and the signal in the next.
    """
    if not header:
        return [], []

    def found(names: list[str]) -> int:
        known = [signal_of(name) for name in names]
        pairs = Counter(pair for pair in known if pair)
        return len(pairs) + sum(_is_time(name) for name in names) - 2 * sum(n - 1 for n in pairs.values())

    candidates = list(header)
    for upper, lower in itertools.pairwise(header):
        tag, joined = "", []
        for above, below in zip(upper, lower, strict=True):
            tag = above or tag
            known = signal_of(below)
            joined.append(f"{tag}.{below}" if known and known[0] == "" and not _is_time(tag) else above or below)
        candidates.append(joined)
    names = max(candidates, key=found)
    units = next((row for row in header if row is not names and _are_units(row)), [""] * len(names))
    return names, [unit_of(name) or unit for name, unit in zip(names, units, strict=True)]


def _are_units(row: list[str]) -> bool:
    filled = [cell for cell in row if cell]
    return bool(filled) and all(len(cell) <= 12 for cell in filled) and not any(signal_of(cell) for cell in filled)


def assign(names: list[str], width: int, columns: Mapping[str, str | int] | None, name: str) -> Assignment:
    """Give each column its signal.

    Parameters
    ----------
    names : list of str
        Column names; empty when the file has no header.
    width : int
        Number of columns.
    columns : mapping, optional
        Signal -> column name or index (from 0), given by the user; then nothing but the time column is guessed.
    name : str
        File name, for messages.

    Raises
    ------
    RecordError
        When a named column does not exist, or a signal has two columns.
    """
    given = Assignment()
    taken = {signal.lower(): _find(signal, column, names, width, name) for signal, column in (columns or {}).items()}
    if "time" in taken:
        given.time = [taken.pop("time")]
    else:
        given.time = [i for i, text in enumerate(names) if _is_time(text) and i not in taken.values()]
    for i, text in enumerate(names):
        if not given.time and given.index is None and i == 0 and _word(text) in INDEX_WORDS and i not in taken.values():
            given.index = i
    if columns:
        given.loops[""] = taken
        return given
    for i, text in enumerate(names):
        pair = signal_of(text)
        if pair is None:
            if i not in given.time and i != given.index and text:
                given.ignored.append(text)
            continue
        tag, word = pair
        signals = given.loops.setdefault(tag, {})
        signal = _WORD_TO_SIGNAL[word]
        if signal in signals:
            raise RecordError(
                f"{name}: columns {names[signals[signal]]!r} and {text!r} are both the {signal.upper()} of one loop; "
                f"say which with columns={{'{signal}': ...}} (--columns)."
            )
        signals[signal] = i
    _shorten_blocks(given)
    _output_when_alone(given, names)
    return given


def _find(signal: str, column: str | int, names: Sequence[str], width: int, name: str) -> int:
    if signal.lower() not in (*SIGNALS, "time"):
        raise RecordError(f"{signal!r} is no signal; name columns for time, {', '.join(SIGNALS)}.")
    if isinstance(column, str):
        matches = [i for i, text in enumerate(names) if text.strip().upper() == column.strip().upper()]
        if matches:
            return matches[0]
        if not column.lstrip("-").isdigit():
            shown = ", ".join(names[:20]) if names else "none, as the file has no header: give a number from 0"
            raise RecordError(f"{name}: has no column {column!r} for {signal.upper()}; its columns are {shown}.")
        column = int(column)
    if not 0 <= column < width:
        raise RecordError(f"{name}: has no column {column} for {signal.upper()}; they are numbered 0 to {width - 1}.")
    return int(column)


def _shorten_blocks(given: Assignment) -> None:
    """``FIC-101/PID1`` is the loop FIC-101 unless the module has two control blocks."""
    short = {tag: _BLOCK.sub("", tag) for tag in given.loops}
    counts = Counter(short.values())
    given.loops = {short[tag] if counts[short[tag]] == 1 else tag: signals for tag, signals in given.loops.items()}


def _output_when_alone(given: Assignment, names: list[str]) -> None:
    for signals in given.loops.values():
        column = signals.get("mv")
        if column is None or "op" in signals:
            continue
        pair = signal_of(names[column])
        if pair and pair[1] in OUTPUT_WHEN_ALONE:
            signals["op"] = signals.pop("mv")
            given.guesses.append(
                f"Column {names[column]} is taken as the controller output (OP), as there is no other; "
                "if it is the valve position, name the OP column."
            )

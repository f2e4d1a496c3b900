"""Which column is which: header names to signals of loops, by the words of `stiction.records.dialects`."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, RecordError
from stiction.records.dialects import (
    BLOCK_PAIRS,
    INDEX_WORDS,
    OUTPUT_WHEN_ALONE,
    SIGNAL_WORDS,
    SPARE_WORDS,
    TAG_WORDS,
    TIME_UNITS,
    TIME_WORDS,
    UNIT_WORDS,
    VALUE_WORDS,
    loop_type_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["NUMBERS", "Assignment", "assign", "choose_names", "is_time", "signal_of", "unit_of"]

NUMBERS = ("pv", "sp", "op", "mv", "valve_signal")
"""Signals that are numbers."""
FLAGS = ("bad", "quality")
"""Columns that say which rows count; as ``pv quality`` they say it of one signal alone."""
SIGNALS = (*NUMBERS, "mode", *FLAGS)
_WORD_TO_SIGNAL = {word: signal for signal, words in SIGNAL_WORDS.items() for word in words}
_WORD_TO_SIGNAL |= {word: f"spare {signal}" for word, signal in SPARE_WORDS.items()}
# A word of several is written with underscores as well: ``FC101_PROCESS_VALUE``.
_WORD_TO_SIGNAL |= {word.replace(" ", "_"): signal for word, signal in _WORD_TO_SIGNAL.items()}
_BY_LENGTH = sorted(_WORD_TO_SIGNAL, key=len, reverse=True)
_WORDS = "|".join(re.escape(word) for word in _BY_LENGTH)
_BEHIND = re.compile(rf"(.*?[^,./\\:|_\s-])\s*[,./\\:|_\s-]+({_WORDS})")
_OF_VALUE = re.compile(r"(.*\S)\s*([#,])\s*VALUE", re.IGNORECASE)
"""What stands before the value of an item: of a signal behind # (PCS 7), of a loop's PV behind a comma (800xA)."""
_BEFORE = re.compile(rf"({_WORDS})(?:[._\s:-]+(?=.*\d)(.+)|(\d+))")
_UNIT = re.compile(r"\s*[\[(]([^\])]*)[\])]\s*$")
_MEASURED = "|".join(re.escape(word) for word in _BY_LENGTH if _WORD_TO_SIGNAL[word] in ("pv", "sp", "op", "mv"))
_UNITS = "|".join(map(re.escape, UNIT_WORDS))
_UNIT_BEHIND = re.compile(
    rf"\s*[\"']?((?:.*[^./\\:|_\s-](?:[./\\:|_-]+|[./\\:|_\s-]+(?!CO\b)))?(?:{_MEASURED}))[_\s]+({_UNITS})[\"']?\s*",
    re.IGNORECASE,
)  # behind a space CO may be a gas: `Stack CO %`
_DATE_FORM = re.compile(r"[dmyhsfapDMYHSFAPTZ:./ -]+")
_BLOCK = re.compile(r"/P?ID\w*$|/PID_\w+$|\.PIDA$", re.IGNORECASE)


@dataclass
class Assignment:
    """Columns of the source, by what they hold."""

    time: list[int] = field(default_factory=list)
    """One column, or a date and a time of day."""
    index: int | None = None
    """A column that only counts the samples."""
    tag: int | None = None
    """A column that says whose row it is."""
    loops: dict[str, dict[str, int]] = field(default_factory=dict)
    """Tag ("" when the header has none) -> signal -> column."""
    chosen: str | None = None
    """Tag of the loop that the user named columns of."""
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


def is_time(name: str) -> bool:
    """Whether a column name is one of time.

    Examples
    --------
    >>> is_time("Time [s]"), is_time("time_ms"), is_time("FIC-1.PV")
    (True, True, False)
    """
    word = _word(name).lstrip("_")
    head, _, tail = word.replace("_", " ").rpartition(" ")
    return word in TIME_WORDS or word.replace("_", " ") in TIME_WORDS or (head in TIME_WORDS and tail in TIME_UNITS)


def signal_of(name: str) -> tuple[str, str] | None:
    """Return tag and word of a column name: ``FIC-101/PID1/PV.CV`` -> ``("FIC-101/PID1", "PV.CV")``.

    Examples
    --------
    >>> signal_of("FIC-101.PV"), signal_of("Set point [t/h]"), signal_of("Tank level OP mA"), signal_of("FLOW")
    (('FIC-101', 'PV'), ('', 'SET POINT'), ('Tank level', 'OP'), None)
    >>> signal_of("FIC-101/SP#Value"), signal_of("FIC-101,Value")
    (('FIC-101', 'SP'), ('FIC-101', 'PV'))
    """
    if item := _OF_VALUE.fullmatch(_UNIT.sub("", name).strip().strip("\"'")):
        return signal_of(item.group(1)) or ((item.group(1), "PV") if item.group(2) == "," else None)
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
    """Choose column names and units out of the header rows.

    A header may be names, units, description in any order, or the tag in one row and the signal in the next.
    """
    if not header:
        return [], []

    def found(names: list[str]) -> int:
        known = [signal_of(name) for name in names]
        pairs = Counter(pair for pair in known if pair)
        return len(pairs) + sum(is_time(name) for name in names) - 2 * sum(n - 1 for n in pairs.values())

    candidates = [(found(row), False, row, row) for row in header]
    for upper, lower in itertools.pairwise(header):
        tag, joined = "", []
        for above, below in zip(upper, lower, strict=True):
            tag = above or tag
            known = signal_of(below)
            if known and known[0] == "" and not is_time(tag):
                joined.append(f"{tag}.{below}")
            elif _word(below) in VALUE_WORDS and signal_of(tag):
                joined.append(tag)
            else:
                joined.append(below if is_time(below) else above or below)
        candidates.append((found(joined), _is_of_tags(upper, lower), joined, upper))
    *_, names, used = max(candidates, key=lambda row: row[:2])
    rows = [row for row in header if row is not used and _are_units(row)]
    units = max(rows, key=lambda row: sum(_is_unit(cell) for cell in row), default=[""] * len(names))
    return names, [unit_of(name) or unit for name, unit in zip(names, units, strict=True)]


def _is_of_tags(upper: list[str], lower: list[str]) -> bool:
    """Whether a row names the one loop whose signals are below: in a merged cell, or by letters and number of a tag."""
    texts = [cell for cell in upper if cell]
    signals = [i for i, cell in enumerate(lower) if (pair := signal_of(cell)) and not pair[0]]
    if len(signals) < 2 or len(set(texts)) != 1 or _is_unit(texts[0]):
        return False
    merged = len(texts) == 1 and 0 < upper.index(texts[0]) <= signals[0]
    return merged or loop_type_of(texts[0], numbered=True) != "other"


def _is_unit(cell: str) -> bool:
    return cell.upper() in UNIT_WORDS or cell.upper() in TIME_UNITS


def _are_units(row: list[str]) -> bool:
    """No cell is long but the form of the dates, and none a signal but a unit that is a word for one as well (mA)."""
    filled = [cell for cell in row if cell and not _DATE_FORM.fullmatch(cell)]
    return bool(filled) and all(len(cell) <= 12 and (_is_unit(cell) or not signal_of(cell)) for cell in filled)


def assign(names: list[str], width: int, columns: Mapping[str, str | int] | None, name: str) -> Assignment:
    """Give each column its signal.

    Parameters
    ----------
    names : list of str
        Column names; empty when the file has no header.
    width : int
        Number of columns.
    columns : mapping, optional
        Signal -> column name or index (from 0), given by the user. The other columns are guessed; where the user
        names a PV, an OP or another number, only its loop is kept.
    name : str
        File name, for messages.

    Raises
    ------
    RecordError
        When a named column does not exist, or a signal has two columns.
    """
    given = Assignment()
    taken = {signal.lower(): _find(signal, column, names, width, name) for signal, column in (columns or {}).items()}
    free = [i for i in range(len(names)) if i not in taken.values()]
    if "time" in taken:
        given.time = [taken.pop("time")]
    else:
        given.time = [i for i in free if is_time(names[i])]
    if not given.time and 0 in free and _word(names[0]) in INDEX_WORDS:
        given.index = 0
    found: dict[str, dict[str, list[int]]] = {}
    for i in free:
        if i in given.time or i == given.index:
            continue
        if pair := signal_of(names[i]):
            found.setdefault(pair[0], {}).setdefault(_WORD_TO_SIGNAL[pair[1]], []).append(i)
        elif given.tag is None and _word(names[i]) in TAG_WORDS:
            given.tag = i
    _flags_of_signals(found)
    _pair_blocks(found)
    if taken:
        given.chosen = _put_in(taken, found, names)
    for tag, signals in found.items():
        _spare(signals, names, given)
        _output_beside_position(signals, names, given)
        for signal, cols in signals.items():
            if len(cols) > 1:
                raise RecordError(
                    f"{name}: columns {names[cols[0]]!r} and {names[cols[1]]!r} are both the {signal.upper()} of one "
                    f"loop; say which with columns={{'{signal.split()[-1]}': ...}} (--columns)."
                )
        given.loops[tag] = {signal: cols[0] for signal, cols in signals.items()}
    _shorten_blocks(given)
    return given


def _flags_of_signals(found: dict[str, dict[str, list[int]]]) -> None:
    """Give a flag that is one signal's to that signal: ``FIC-1.PV.Quality``, or one behind each of several signals."""
    place = {i: (tag, role) for tag, signals in found.items() for role in NUMBERS for i in signals.get(role, ())}
    for tag in list(found):
        owner = signal_of(tag) if set(found[tag]) <= set(FLAGS) else None
        role = _WORD_TO_SIGNAL[owner[1]] if owner else ""
        if owner and role in found.get(owner[0], {}):
            for flag, cols in found.pop(tag).items():
                found[owner[0]][f"{role} {flag}"] = cols
            continue
        for flag in FLAGS:
            cols = found[tag].get(flag, [])
            if len(cols) > 1 and all(i - 1 in place for i in cols):
                for i in found[tag].pop(flag):
                    owner_tag, role = place[i - 1]
                    found[owner_tag][f"{role} {flag}"] = [i]


def _pair_blocks(found: dict[str, dict[str, list[int]]]) -> None:
    """Give what one block of a point measures to the block that controls it, where that has none of its own."""
    for measures, controls in BLOCK_PAIRS:
        for tag in [tag for tag in found if tag.upper().endswith(measures)]:
            others = [other for other in found if other.upper() == tag[: -len(measures)].upper() + controls]
            if len(others) == 1:
                found[others[0]] = {**found.pop(tag), **found[others[0]]}


def _put_in(taken: dict[str, int], found: dict[str, dict[str, list[int]]], names: list[str]) -> str | None:
    """Put the columns that the user named where they belong; the tag of their loop, None where they make none."""
    pairs = [signal_of(names[i]) for i in taken.values()] if names else []
    tags = {pair[0] for pair in pairs if pair and pair[0] in found}
    others = [tag for tag, signals in found.items() if set(signals) & set(NUMBERS)]
    if len(tags) == 1:
        tag = tags.pop()
    elif not tags and len(others) == 1:
        tag = others[0]
    else:
        tag = ""
        if tags:
            found.pop("", None)
    found.setdefault(tag, {}).update({signal: [i] for signal, i in taken.items()})
    return tag if set(taken) & set(NUMBERS) else None


def _spare(signals: dict[str, list[int]], names: list[str], given: Assignment) -> None:
    """Columns of `SPARE_WORDS` where the loop has no plainer one."""
    for role in dict.fromkeys(SPARE_WORDS.values()):
        cols = signals.pop(f"spare {role}", [])
        fits = {"sp": True, "op": "pv" in signals and "mv" not in signals, "pv": "op" in signals}[role]
        if role not in signals and len(cols) == 1 and fits:
            signals[role] = cols
            said = {"sp": "set point (SP)", "op": "controller output (OP)", "pv": "process variable (PV)"}[role]
            given.guesses.append(f"Column {names[cols[0]]} is taken as the {said}, as there is no other.")


def _output_beside_position(signals: dict[str, list[int]], names: list[str], given: Assignment) -> None:
    """A column MV is the controller output where the loop has no other, also beside a valve position."""
    outputs = [i for i in signals.get("mv", ()) if (pair := signal_of(names[i])) and pair[1] in OUTPUT_WHEN_ALONE]
    if outputs and "op" in signals and "sp" in signals and "pv" not in signals:
        given.guesses.append(
            f"Column {names[outputs[0]]} is taken as the valve position (MV); if it is the measured value (ABB), name "
            f"it with columns={{'pv': {names[outputs[0]]!r}}} (--columns)."
        )
    if "op" in signals or len(outputs) != 1:
        return
    signals["op"] = outputs
    signals["mv"].remove(outputs[0])
    if not signals["mv"]:
        del signals["mv"]
    given.guesses.append(
        f"Column {names[outputs[0]]} is taken as the controller output (OP), as there is no other; "
        "if it is the valve position, name the OP column."
    )


def _find(signal: str, column: str | int, names: Sequence[str], width: int, name: str) -> int:
    if signal.lower() not in (*SIGNALS, "time"):
        raise ParameterError(f"{signal!r} is no signal; name columns for time, {', '.join(SIGNALS)}.")
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
    named = {tag: short[tag] if counts[short[tag]] == 1 else tag for tag in given.loops}
    given.loops = {named[tag]: signals for tag, signals in given.loops.items()}
    given.chosen = named.get(given.chosen, given.chosen) if given.chosen is not None else None

"""Column names to tag, signal and unit, by the words of `stiction.sources.roles.vocabulary`."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from stiction.sources.roles import vocabulary

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = [
    "HeaderNames",
    "header_names",
    "is_unit",
    "normalise_name",
    "parse_column_name",
    "role_of",
    "split_aggregate",
    "unit_in_name",
]

_ROLE_OF_WORD = {word: role for role, words in vocabulary.SIGNAL_WORDS.items() for word in words}
_ROLE_OF_WORD |= {
    word: f"fallback {role}" for role, words in vocabulary.FALLBACK_SIGNAL_WORDS.items() for word in words
}
# A word of several is written with underscores as well: ``FC101_PROCESS_VALUE``.
_ROLE_OF_WORD |= {word.replace(" ", "_"): role for word, role in _ROLE_OF_WORD.items()}


def _any_of(words: Iterable[str]) -> str:
    return "|".join(sorted(map(re.escape, words), key=len, reverse=True))


_TAG_WORD = re.compile(rf"(.*?[^,./\\:|_\s-])\s*[,./\\:|_\s-]+({_any_of(_ROLE_OF_WORD)})")
# A weak word of quality stands after a tag only: ST 4101 measures a speed.
_LEADING = [word for word, role in _ROLE_OF_WORD.items() if role != "fallback quality"]
_WORD_TAG = re.compile(rf"({_any_of(_LEADING)})(?:[._\s:-]+(?=.*\d)(.+)|(\d+))")
# The value of an item: of a signal after # (PCS 7), of the PV of a loop after a comma (800xA).
_ITEM_VALUE = re.compile(r"(.*\S)\s*([#,])\s*VALUE", re.IGNORECASE)
_MEASURED = _any_of(word for word, role in _ROLE_OF_WORD.items() if role in ("pv", "sp", "op", "mv"))
# After a space CO may be a gas: `Stack CO %`.
_WORD_UNIT = re.compile(
    rf"\s*[\"']?((?:.*[^./\\:|_\s-](?:[./\\:|_-]+|[./\\:|_\s-]+(?!CO\b)))?(?:{_MEASURED}))[_\s]+"
    rf"({_any_of(vocabulary.UNIT_WORDS)})[\"']?\s*",
    re.IGNORECASE,
)
_AGGREGATE = re.compile(
    rf"(.*?)[\s._:/-]*[(\[]?(?<![a-z0-9])({_any_of(vocabulary.AGGREGATES)})[)\]]?"
    rf"|({_any_of(vocabulary.AGGREGATES)})[\s_.(]+(.*?)\)?",
    re.IGNORECASE,
)
_DATE_FORMAT = re.compile(r"[dmyhsfapDMYHSFAPTZ:./ -]+")


class HeaderNames(NamedTuple):
    """What the header rows of a table say of each column; three lists of the same length."""

    names: list[str]
    """Name of each column; a tag above and a signal below are joined by a dot. Empty when there is no header."""
    units: list[str]
    """Unit as written, "" where none is named."""
    descriptions: list[str]
    """Description as written, "" where there is none."""


def role_of(word: str) -> str:
    """Give the role that a word of `parse_column_name` names, such as "sp" or "fallback sp"."""
    return _ROLE_OF_WORD[word]


def is_unit(cell: str) -> bool:
    """Whether a cell is a known unit, of a signal or of time."""
    return cell.upper() in vocabulary.UNIT_WORDS or cell.upper() in vocabulary.TIME_UNITS


def unit_in_name(name: str) -> str:
    """Give the unit at the end of a column name, in brackets or after the word of a signal, as written."""
    if match := vocabulary.UNIT_IN_BRACKETS.search(name):
        return match[1].strip()
    match = _match_word_and_unit(name)
    return match[2] if match else ""


@lru_cache(maxsize=4096)
def _match_word_and_unit(name: str) -> re.Match[str] | None:
    """Match a name that ends in the word of a signal and a unit; the blank between them is looked for first."""
    return _WORD_UNIT.fullmatch(name) if "_" in name or len(name.split(maxsplit=1)) > 1 else None


@lru_cache(maxsize=4096)
def normalise_name(name: str) -> str:
    """Give a column name in capitals, without its unit, quotes and repeated blanks."""
    match = _match_word_and_unit(name)
    return vocabulary.without_unit(match[1] if match else name).upper()


@lru_cache(maxsize=4096)
def parse_column_name(name: str) -> tuple[str, str] | None:
    """Split a column name into tag ("" for a signal alone) and signal word in capitals; None when it holds none.

    >>> parse_column_name("FIC-101/PID1/PV.CV"), parse_column_name("Set point [t/h]"), parse_column_name("FLOW")
    (('FIC-101/PID1', 'PV.CV'), ('', 'SET POINT'), None)
    >>> parse_column_name("FIC-101/SP#Value"), parse_column_name("FIC-101,Value"), parse_column_name("Tank level OP mA")
    (('FIC-101', 'SP'), ('FIC-101', 'PV'), ('Tank level', 'OP'))
    """
    plain, word = vocabulary.without_unit(name), normalise_name(name)
    if item := _ITEM_VALUE.fullmatch(plain):
        return parse_column_name(item[1]) or ((item[1], "PV") if item[2] == "," else None)
    for whole in (word, word.replace("_", " ")):
        if whole in _ROLE_OF_WORD:
            return "", whole
    if match := _TAG_WORD.fullmatch(word):
        return plain[: len(match[1])].rsplit("\\", 1)[-1], match[2]
    if match := _WORD_TAG.fullmatch(word):
        return plain[match.start(2) :] if match[2] else match[3], match[1]
    return None


@lru_cache(maxsize=4096)
def split_aggregate(name: str) -> tuple[str, str]:
    """Split a column name into the name of a signal and average, minimum, maximum or other; "" where it names none.

    >>> split_aggregate("FIC-101.PV (Avg) [t/h]"), split_aggregate("min(FIC-101.PV)"), split_aggregate("FIC-101.PV")
    (('FIC-101.PV [t/h]', 'average'), ('FIC-101.PV', 'minimum'), ('FIC-101.PV', ''))
    """
    plain, unit = name.strip(), ""
    match, bracketed = _AGGREGATE.fullmatch(plain), vocabulary.UNIT_IN_BRACKETS.search(plain)
    if not match and bracketed:
        match, unit = _AGGREGATE.fullmatch(plain[: bracketed.start()]), f" {bracketed[0].strip()}"
    if not match:
        return name, ""
    base, word = (match[1], match[2]) if match[2] else (match[4], match[3])
    return f"{base}{unit}".strip(), vocabulary.AGGREGATES[word.upper()]


def header_names(header: Sequence[Sequence[str]]) -> HeaderNames:
    """Choose names, units and descriptions out of header rows in any order; tag and signal may be in two."""
    from stiction.sources.time.time_columns import is_time_heading

    if not header:
        return HeaderNames([], [], [])

    def score(names: Sequence[str]) -> int:
        split = map(split_aggregate, names)
        pairs = Counter((pair, kind) for base, kind in split if (pair := parse_column_name(base)))
        return len(pairs) + sum(map(is_time_heading, names)) - 2 * (pairs.total() - len(pairs))

    candidates = [(score(row), False, list(row), [row]) for row in header]
    for upper, lower in itertools.pairwise(header):
        tag, joined = "", []
        for above, below in zip(upper, lower, strict=True):
            tag = above or tag
            pair = parse_column_name(below)
            if (pair and pair[0] == "" and not is_time_heading(tag)) or (
                below.strip().upper() in vocabulary.AGGREGATES and parse_column_name(tag)
            ):
                joined.append(f"{tag}.{below}")
            elif normalise_name(below) in vocabulary.VALUE_WORDS and parse_column_name(tag):
                joined.append(tag)
            else:
                joined.append(below if is_time_heading(below) else above or below)
        candidates.append((score(joined), _names_one_loop(upper, lower), joined, [upper, lower]))
    *_, names, used = max(candidates, key=lambda candidate: candidate[:2])
    others = [row for row in header if row is not used[0]]  # of two joined rows the lower one may be the units
    blank = [""] * len(names)
    units = max(filter(_is_unit_row, others), key=lambda row: sum(map(is_unit, row)), default=blank)
    texts = [row for row in others if row not in used and row is not units]
    descriptions = max(texts, key=lambda row: sum(map(len, row)), default=blank)
    units = [unit_in_name(name) or unit for name, unit in zip(names, units, strict=True)]
    return HeaderNames(names, units, list(descriptions))


def _names_one_loop(upper: Sequence[str], lower: Sequence[str]) -> bool:
    """Whether a row names the one loop of the signals below: in a merged cell, or by letters and number of a tag."""
    texts = [cell for cell in upper if cell]
    signals = [i for i, cell in enumerate(lower) if (pair := parse_column_name(cell)) and not pair[0]]
    if len(signals) < 2 or len(set(texts)) != 1 or is_unit(texts[0]):
        return False
    is_merged = len(texts) == 1 and 0 < list(upper).index(texts[0]) <= signals[0]
    return is_merged or vocabulary.loop_type_of(texts[0], numbered=True) != "other"


def _is_unit_row(row: Sequence[str]) -> bool:
    """Whether a row can hold units: short cells, none of them a signal unless a unit is written alike (mA)."""
    filled = [cell for cell in row if cell and not _DATE_FORMAT.fullmatch(cell)]
    if any(" " in cell for cell in filled) and not any(map(is_unit, filled)):
        return False  # cells of several words are a description
    if any(len(cell) > 12 or normalise_name(cell) in vocabulary.VALUE_WORDS for cell in filled):
        return False
    return bool(filled) and all(is_unit(cell) or not parse_column_name(cell) for cell in filled)

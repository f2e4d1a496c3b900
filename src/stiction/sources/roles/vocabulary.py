"""The words that plants use, from `vocabulary.toml` beside this page, and what the text of a heading says alone."""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from pathlib import Path

_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_UNITS, _CELLS = _TABLE["units"], _TABLE["cells"]

# What each list means stands in the table.
SIGNAL_WORDS: dict[str, list[str]] = _TABLE["signals"]
FALLBACK_SIGNAL_WORDS: dict[str, list[str]] = _TABLE["fallback_signals"]
COLUMN_WORDS: dict[str, list[str]] = _TABLE["columns"]
TAG_WORDS: list[str] = COLUMN_WORDS["tag"]
VALUE_WORDS: list[str] = COLUMN_WORDS["value"]
UNIT_HEADINGS: list[str] = COLUMN_WORDS["unit"]
INDEX_WORDS: list[str] = COLUMN_WORDS["index"]
TIME_WORDS = frozenset(COLUMN_WORDS["time"])
PERCENT_UNITS: list[str] = _UNITS["percent"]
UNIT_WORDS: list[str] = [*PERCENT_UNITS, *_UNITS["signal"]]
CELL_UNITS: list[str] = [*UNIT_WORDS, *_UNITS["cell"]]
FRACTION_UNITS: list[str] = _UNITS["fraction"]
OTHER_OUTPUT_UNITS = {*UNIT_WORDS, *_UNITS["output"]} - {*PERCENT_UNITS, "MA"}
AGGREGATES = {word: kind for kind, words in _TABLE["aggregates"].items() for word in words}
TIME_UNITS = {unit: float(seconds) for seconds, units in _TABLE["seconds"].items() for unit in units}
MONTHS: list[list[str]] = [names.split() for names in _TABLE["months"]["names"]]
MISSING_WORDS = frozenset(_CELLS["missing"])
STATUS_TEXTS: list[str] = _CELLS["status"]
MODES = {mode: kind == "automatic" for kind, modes in _TABLE["modes"].items() for mode in modes}
GENERIC_WORDS = frozenset(_TABLE["places"]["generic"])

_LOOP_TYPES = {"F": "flow", "L": "level", "P": "pressure", "T": "temperature", "A": "analyser"}
UNIT_IN_BRACKETS = re.compile(r"\s*[\[(]([^\])]*)[\])]\s*$")
"""A unit at the end of a heading."""
# First letter, then difference/ratio/totalise, then what the instrument does, then alarm/safety/valve.
_FUNCTION_LETTERS = re.compile(r"(?<![A-Z])([FLPTA])[DFQ]?[ICRTY]{1,3}[AQSVZ]?(?![A-Z])")
_NUMBERED = re.compile(_FUNCTION_LETTERS.pattern + r"[-_ ]?[0-9]")
_TYPES_IN_WORDS = re.compile(r"(?<![A-Z])(FLOW|LEVEL|PRESSURE|TEMPERATURE)(?![A-Z])")


@lru_cache(maxsize=4096)
def without_unit(name: str) -> str:
    """Give a heading without its unit in brackets, quotes and repeated blanks."""
    return " ".join(UNIT_IN_BRACKETS.sub("", name).strip().strip("\"'").split())


def loop_type_of(tag: str, *, numbered: bool = False) -> str:
    """Loop type by ISA-5.1 letters (`numbered`: only before a number) or one plain word, else "other"."""
    if match := (_NUMBERED if numbered else _FUNCTION_LETTERS).search(tag.upper()):
        return _LOOP_TYPES[match.group(1)]
    words = set(_TYPES_IN_WORDS.findall(tag.upper()))
    return words.pop().lower() if len(words) == 1 else "other"

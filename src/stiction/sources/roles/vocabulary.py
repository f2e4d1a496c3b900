"""The words that plants use, from `vocabulary.toml` beside this page, and the loop type that a tag names."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_COLUMNS, _UNITS, _CELLS = _TABLE["columns"], _TABLE["units"], _TABLE["cells"]

SIGNAL_WORDS: dict[str, list[str]] = _TABLE["signals"]
"""Signal -> its names, alone or after a tag."""
FALLBACK_SIGNAL_WORDS: dict[str, list[str]] = _TABLE["fallback_signals"]
"""Signal -> words that count only where the loop has no plainer one."""
TAG_WORDS: list[str] = _COLUMNS["tag"]
"""Headings of a column that names the tag of each row."""
LOOP_NAME_WORDS: list[str] = [*TAG_WORDS, *_COLUMNS["loop_name"]]
"""Headings of a column that names the loop, where the tag of the row is only PV or OP."""
ATTRIBUTE_WORDS: list[str] = _COLUMNS["attribute"]
"""Headings of a column that names the signal of the loop in another column."""
VALUE_WORDS: list[str] = _COLUMNS["value"]
"""Headings of a column of values of the tag that the row or another heading names."""
UNIT_HEADINGS: list[str] = _COLUMNS["unit"]
"""Words before a unit, or above a column of units."""
DESCRIPTION_WORDS: list[str] = _COLUMNS["description"]
"""Headings of a column of descriptions."""
TYPE_WORDS: list[str] = _COLUMNS["types"]
"""Types of columns, in a row of the header."""
INDEX_WORDS: list[str] = _COLUMNS["index"]
"""Headings of a column that counts the rows; the first is blank."""
TIME_WORDS = frozenset(_COLUMNS["time"])
"""Headings of time."""
PERCENT_UNITS: list[str] = _UNITS["percent"]
"""Percent of span."""
UNIT_WORDS: list[str] = [*PERCENT_UNITS, *_UNITS["signal"]]
"""Units that stand after a signal without brackets."""
CELL_UNITS: list[str] = [*UNIT_WORDS, *_UNITS["cell"]]
"""Units that stand after the number in each cell."""
FRACTION_UNITS: list[str] = _UNITS["fraction"]
"""Units that say that OP is a fraction of span."""
OTHER_OUTPUT_UNITS = {*UNIT_WORDS, "PSIG", "V", "VDC", "HZ", "COUNTS"} - {*PERCENT_UNITS, "MA"}
"""Units of a controller output that is not in % of span."""
TIME_UNITS = {unit: float(seconds) for seconds, units in _TABLE["seconds"].items() for unit in units}
"""Unit of a time column of numbers -> seconds."""
MONTHS: list[list[str]] = [names.split() for names in _TABLE["months"]["names"]]
"""Names of the months in the order of the year, a list for each language or spelling."""
MISSING_WORDS = frozenset(_CELLS["missing"])
"""An empty cell, in the words of different programs."""
STATUS_TEXTS: list[str] = _CELLS["status"]
"""Texts of historians in the place of a number."""
GOOD_STATUS_WORDS: list[str] = _CELLS["good"]
"""Status of a good value."""
BAD_STATUS_WORDS: tuple[str, ...] = tuple(_CELLS["bad"])
"""How the status of a value that does not count begins."""
MODES = {mode: kind == "automatic" for kind, modes in _TABLE["modes"].items() for mode in modes}
"""Controller mode -> whether the controller moves the valve by itself."""
GENERIC_WORDS = frozenset(_TABLE["places"]["generic"])
"""Words of a description that say what is measured or moved, not where."""

_LOOP_TYPES = {"F": "flow", "L": "level", "P": "pressure", "T": "temperature", "A": "analyser"}
# First letter, then difference/ratio/totalise, then what the instrument does, then alarm/safety/valve.
_FUNCTION_LETTERS = re.compile(r"(?<![A-Z])([FLPTA])[DFQ]?[ICRTY]{1,3}[AQSVZ]?(?![A-Z])")
_NUMBERED = re.compile(_FUNCTION_LETTERS.pattern + r"[-_ ]?[0-9]")
_TYPES_IN_WORDS = re.compile(r"(?<![A-Z])(FLOW|LEVEL|PRESSURE|TEMPERATURE)(?![A-Z])")


def loop_type_of(tag: str, *, numbered: bool = False) -> str:
    """Give the loop type that a tag names by ISA-5.1 letters or in one plain word, else "other".

    `numbered` accepts letters only when a number follows them, for a text that may be a word, such as a file name.

    Examples
    --------
    >>> loop_type_of("2111LIC23001"), loop_type_of("12-FC-135A"), loop_type_of("Tank level"), loop_type_of("CHEM1")
    ('level', 'flow', 'level', 'other')
    >>> loop_type_of("fit", numbered=True), loop_type_of("fic_101_june", numbered=True)
    ('other', 'flow')
    """
    if found := (_NUMBERED if numbered else _FUNCTION_LETTERS).search(tag.upper()):
        return _LOOP_TYPES[found.group(1)]
    words = set(_TYPES_IN_WORDS.findall(tag.upper()))
    return words.pop().lower() if len(words) == 1 else "other"

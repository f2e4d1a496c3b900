"""Which rows of a column of quality codes are good: by the schemes that know all its codes."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.sources.roles.vocabulary import MISSING_WORDS
from stiction.sources.values.quality_schemes import PERCENT_GOOD, SCHEMES
from stiction.sources.values.status_codes import read_codes

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.values.quality_schemes import Scheme

    Mark = Literal["good", "uncertain", "bad"]

__all__ = ["CodeReading", "QualityReading", "are_quality_codes", "read_code_counts", "read_quality"]

MAX_CODES = 50
"""Different codes above which a column holds no codes [-]."""
MAX_READINGS = 3
"""Readings of one column that are kept, the likeliest first [-]."""
_PLAIN_SCHEMES = ("text", "good flag", "doubt flag", "bad flag", "flag")
"""Schemes whose codes speak for themselves."""
_BLANK = MISSING_WORDS - {"?"}
_NUMBER = re.compile(r"(?:0X|16#)([0-9A-F]{1,8})|(-?[0-9]{1,10})(?:\.0+)?")
_PERCENT = re.compile(r"-?[0-9]{1,3}(\.[0-9]*)?")
_WRAPPED = re.compile(
    r"(?:[A-Z]*(?:STATUS|QUALITY)[A-Z]*|0X[0-9A-F]+|\d+)\s*[.:(\[-]+\s*(?:VALUE=)?([A-Z].*?|0X[0-9A-F]+|\d+)[)\]]?"
)


@dataclass(frozen=True)
class CodeReading:
    """One way to read the codes of a column."""

    missing: frozenset[str]
    """Codes of the rows that are missing, in capitals."""
    note: str = ""
    """What was assumed; empty where the codes speak for themselves."""


@dataclass
class QualityReading:
    """One way to read all quality columns of a loop."""

    masks: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    """Key of a column -> True where the value is missing, shape (n_rows,)."""
    notes: list[str] = field(default_factory=list)
    """What was assumed, a sentence each."""


def read_code_counts(
    counts: Counter[str],
    heading: str = "",
    others: Collection[str] = (),
    *,
    keep_uncertain: bool = False,
    min_percent: float = 50.0,
    min_share_ratio: float = 0.5,
) -> list[CodeReading]:
    """Give the ways to read the codes of a quality column, the likeliest first: one, unless schemes disagree.

    Parameters
    ----------
    counts : Counter
        Rows of each code in capitals; blank ones are good.
    heading : str
        Heading of the column. Schemes that it names go before those that `others` name, and these before the rest.
    others : collection of str
        Headings beside it, in capitals.
    keep_uncertain : bool
        Whether uncertain values are used.
    min_percent : float
        Share of good data from which a value is good, where the column holds that share [%].
    min_share_ratio : float
        Share of good rows of a reading over that of the best one, from which it is kept [-].

    Examples
    --------
    >>> [(sorted(one.missing), one.note) for one in read_code_counts(Counter({"192": 90, "24": 8, "64": 2}))]
    [(['24', '64'], '192 is good, 24 and 64 are not (OPC DA)')]
    >>> [sorted(one.missing) for one in read_code_counts(Counter({"0": 60, "1": 40}))]
    [['1'], ['0']]
    """
    words = Counter({code: n for code, n in counts.items() if code not in _BLANK})
    if words and _names(heading, PERCENT_GOOD) and all(map(_PERCENT.fullmatch, words)):
        limit = min_percent if max(map(float, words)) > 1.0 else min_percent / 100.0
        return [CodeReading(frozenset(c for c in words if float(c) < limit), f"below {limit:g} is taken as bad")]
    if not words or len(words) > MAX_CODES:
        note = f"{len(words)} different texts are no quality codes, and are not used" if words else ""
        return [CodeReading(frozenset(), note)]
    blank = counts.total() - words.total()
    known = [(scheme, marks) for scheme in SCHEMES if (marks := _marks(scheme, frozenset(words)))]
    full = [(scheme, marks) for scheme, marks in known if len(marks) == len(words)]
    full = _by_heading(full, heading, others)
    rated: dict[frozenset[str], tuple[float, Scheme]] = {}
    for scheme, marks in full:
        missing = _missing(marks, keep_uncertain=keep_uncertain)
        share = (blank + sum(n for code, n in words.items() if marks[code] == "good")) / counts.total()
        if share > 0.0:
            rated.setdefault(missing, (share, scheme))
    if not rated:
        if any(scheme.name in _PLAIN_SCHEMES for scheme, _ in full):
            return [CodeReading(_missing(full[0][1], keep_uncertain=keep_uncertain))]
        return _read_unknown(words, [(s, marks) for s, marks in known if not s.needs_word], keep_uncertain)
    best = max(share for share, _ in rated.values())
    ranked = sorted(rated.items(), key=lambda item: -item[1][0])
    kept = [(missing, scheme) for missing, (share, scheme) in ranked if share >= min_share_ratio * best][:MAX_READINGS]
    return [CodeReading(missing, _describe(words, missing, scheme)) for missing, scheme in kept]


def _by_heading(
    full: list[tuple[Scheme, dict[str, Mark]]], heading: str, others: Collection[str]
) -> list[tuple[Scheme, dict[str, Mark]]]:
    """Choose the schemes that the heading names, else those that others name, else all that need no word."""
    if own := [one for one in full if _names(heading, one[0].words)]:
        return own
    free = [one for one in full if not one[0].needs_word]
    return [one for one in free if not set(others).isdisjoint(one[0].words)] or free


def _names(heading: str, words: Iterable[str]) -> bool:
    """Whether a heading ends in one of some words."""
    text = heading.strip().upper()
    return any(text == word or (text.endswith(word) and not text[-len(word) - 1].isalnum()) for word in words)


def _missing(marks: Mapping[str, Mark], *, keep_uncertain: bool) -> frozenset[str]:
    return frozenset(c for c, mark in marks.items() if mark == "bad" or (mark == "uncertain" and not keep_uncertain))


def _describe(words: Counter[str], missing: frozenset[str], scheme: Scheme) -> str:
    if scheme.name in _PLAIN_SCHEMES or not missing:
        return ""
    return f"{_listed(words.keys() - missing)} good, {_listed(missing)} not ({scheme.name})"


def _listed(codes: Collection[str]) -> str:
    """List codes with their verb."""
    texts = sorted(codes, key=lambda code: (len(code), code))[:5]
    *head, last = texts or ["a blank"]
    return f"{', '.join(head)} and {last} are" if head else f"{last} is"


def _read_unknown(
    words: Counter[str],
    known: list[tuple[Scheme, dict[str, Mark]]],
    keep_uncertain: bool,
    *,
    min_good_share: float = 0.9,
) -> list[CodeReading]:
    """Read codes of which no scheme knows all, or none as good: the unknown ones are bad, or else good."""
    marks = max((marks for _, marks in known), key=lambda marks: sum(words[code] for code in marks), default={})
    good = {code for code, mark in marks.items() if mark == "good"}
    bad = _missing(marks, keep_uncertain=keep_uncertain) if good else frozenset()
    usual = max(words, key=lambda code: words[code])
    good = good or {usual}
    unknown = frozenset(words.keys() - good - bad)
    if not unknown:
        return [CodeReading(bad, f"{_listed(good)} taken as good: no scheme of quality codes knows it")]
    strict = CodeReading(bad | unknown, f"{_listed(unknown)} not known, and taken as bad")
    lenient = CodeReading(bad, f"{_listed(unknown)} not known as good or bad, and used")
    is_rare = sum(words[code] for code in good) >= min_good_share * words.total()
    return [strict, lenient] if is_rare else [lenient, strict]


@lru_cache(maxsize=512)
def _marks(scheme: Scheme, codes: frozenset[str]) -> dict[str, Mark]:
    """Give the meaning of the codes that a scheme knows."""
    marks: dict[str, Mark] = {code: mark for code in codes if (mark := _mark(scheme, code)) is not None}
    return {} if scheme.needs_fault and set(marks.values()) == {"good"} else marks


def _mark(scheme: Scheme, code: str) -> Mark | None:
    """Give what a code means in a scheme; None when the scheme does not know it."""
    number = None
    if found := _NUMBER.fullmatch(code):
        number = int(found[1], 16) if found[1] else int(found[2])
        if number not in scheme.numbers:
            return None
        number &= scheme.mask
    elif wrapped := _WRAPPED.fullmatch(code):
        return _mark(scheme, wrapped[1])
    meanings: dict[Mark, tuple] = {"good": scheme.good, "uncertain": scheme.uncertain, "bad": scheme.bad}
    return next((mark for mark, known in meanings.items() if any(_is_code(code, number, one) for one in known)), None)


def _is_code(code: str, number: int | None, known: str | int | range) -> bool:
    if isinstance(known, str):
        return code.startswith(known[:-1]) if len(known) > 2 and known.endswith("*") else code == known
    return number is not None and (number in known if isinstance(known, range) else number == known)


def are_quality_codes(cells: Iterable[str], *, named: bool = False) -> bool:
    """Whether cells are words of quality, or codes of any one scheme where the heading is `named` like one."""
    codes = frozenset(cell.strip().upper() for cell in cells) - _BLANK
    if not 0 < len(codes) <= MAX_CODES:
        return False
    schemes = [one for one in SCHEMES if not one.needs_word] if named else SCHEMES[:1]
    found = [_marks(scheme, codes) for scheme in schemes]
    return any(len(marks) == len(codes) and "good" in marks.values() for marks in found)


def read_quality(
    columns: Mapping[str, tuple[str, pl.Series]],
    others: Collection[str] = (),
    *,
    good_codes: Mapping[str, Collection[str]] | None = None,
    keep_uncertain: bool = False,
    where: str = "",
) -> list[QualityReading]:
    """Read the flag columns of a loop: by key ("bad", "quality", "pv quality", "op bad 2") heading and cells.

    Columns whose headings end in the same word share their scheme. With `good_codes` of a column all others are bad.
    """
    cells = {key: read_codes(series) for key, (_, series) in columns.items()}
    groups: dict[str, list[str]] = {}
    for key, (heading, _) in columns.items():
        is_bad = "bad" in key.split()
        word = re.split(r"[\W_]+", heading.strip().upper())[-1]
        groups.setdefault(f"{'bad' if is_bad else 'quality'} {word}", []).append(key)
    options: dict[str, list[CodeReading]] = {}
    given: dict[str, Collection[str]] = {}
    for name, keys in groups.items():
        counts = sum((cells[key][1] for key in keys), Counter())
        heading, good = columns[keys[0]][0], (good_codes or {}).get(keys[0], ())
        if name.startswith("bad"):
            options[name] = [_read_flags(counts, heading, keep_uncertain=keep_uncertain)]
        elif good:
            options[name], given[name] = [_read_given(counts, good)], good
        else:
            options[name] = read_code_counts(counts, heading, others, keep_uncertain=keep_uncertain)
    if given and not any(options[name][0].note for name in given):
        present = sorted({code for name in given for key in groups[name] for code in cells[key][1] if code})[:10]
        raise RecordError(
            "",
            Setting("good_codes", ",".join(next(iter(given.values())))),
            f" names no code of the quality columns; theirs are {', '.join(present)}",
            remedy="name the good ones among these",
            where=where,
        )
    readings = []
    for k in range(max((len(one) for one in options.values()), default=1)):
        reading = QualityReading()
        for name, keys in groups.items():
            chosen = options[name][min(k, len(options[name]) - 1)]
            for key in keys:
                mask = cells[key][0].is_in(list(chosen.missing)).to_numpy()
                reading.masks[key] = mask | _single_rows(mask)
                if n := int(np.sum(reading.masks[key] & ~mask)):
                    single = "row between bad ones is" if n == 1 else "single rows between bad ones are"
                    reading.notes.append(f"Column {columns[key][0]}: {n} {single} taken as bad.")
            if chosen.note:
                labels = list(dict.fromkeys(columns[key][0] for key in keys))
                named = ", ".join(labels[:3]) + (" ..." if labels[3:] else "")
                reading.notes.append(f"Column{'s' if labels[1:] else ''} {named}: {chosen.note}.")
        readings.append(reading)
    return readings


def _single_rows(bad: NDArray[np.bool_], *, min_run: int = 3) -> NDArray[np.bool_]:
    """Mark single good rows between runs of at least `min_run` bad ones [rows]: they are not to be trusted either."""
    single = np.zeros(bad.size, dtype=bool)
    if bad.size > 2 * min_run:
        runs: NDArray[np.bool_] = np.all(np.lib.stride_tricks.sliding_window_view(bad, min_run), axis=1)
        single[min_run:-min_run] = ~bad[min_run:-min_run] & runs[: -min_run - 1] & runs[min_run + 1 :]
    return single


def _read_flags(counts: Counter[str], heading: str, *, keep_uncertain: bool) -> CodeReading:
    """Read a column of bad flags: all is bad but what says no."""
    name = "doubt flag" if _names(heading, ("QUESTIONABLE", "SUBSTITUTED")) else "bad flag"
    scheme = next(one for one in SCHEMES if one.name == name)
    if name == "doubt flag" and keep_uncertain:
        return CodeReading(frozenset())
    return CodeReading(frozenset(c for c in counts if c not in _BLANK and _mark(scheme, c) != "good"))


def _read_given(counts: Counter[str], good_codes: Collection[str]) -> CodeReading:
    """Read codes as the user says; the note is empty where none of the codes occurs."""
    good = {code.strip().upper() for code in good_codes}
    present = {code for code in counts if code in good or code.removesuffix(".0") in good}
    missing = frozenset(counts.keys() - present - _BLANK) if present else frozenset()
    return CodeReading(missing, f"{_listed(present)} good, as given" if present else "")

"""Which rows of a column of quality codes are good: by the schemes that know all its codes."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import polars as pl

from stiction.errors import RecordError, Setting
from stiction.sources.roles.vocabulary import MISSING_WORDS, MODES

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from numpy.typing import NDArray

    Mark = Literal["good", "uncertain", "bad"]
    Marks = dict[str, Mark]

__all__ = [
    "CodeReading",
    "QualityReading",
    "are_quality_codes",
    "automatic_mask",
    "read_code_counts",
    "read_codes",
    "read_quality",
]

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


class Scheme(NamedTuple):
    """The codes of one vendor or standard; what each field means stands in `quality_schemes.toml` beside this page."""

    name: str
    words: tuple[str, ...]
    good: tuple[str | int | range, ...]
    uncertain: tuple[str | int | range, ...]
    bad: tuple[str | int | range, ...]
    mask: int
    numbers: range
    needs_word: bool
    needs_fault: bool


def _code(written: Any) -> Any:
    """Give a code as a text, a number or a range of numbers."""
    low, dots, high = str(written).partition("..")
    return range(int(low), int(high) + 1) if dots else written


def _scheme(row: dict[str, Any]) -> Scheme:
    good, uncertain, bad = (tuple(map(_code, row.get(mark, ()))) for mark in ("good", "uncertain", "bad"))
    numbers = _code(row.get("numbers", "-2147483648..4294967295"))
    flags = (row.get(name, False) for name in ("needs_word", "needs_fault"))
    return Scheme(row["name"], tuple(row.get("words", ())), good, uncertain, bad, row.get("mask", -1), numbers, *flags)


_TABLE = tomllib.loads(Path(__file__).with_name("quality_schemes.toml").read_text(encoding="utf-8"))
SCHEMES = tuple(map(_scheme, _TABLE["scheme"]))
PERCENT_GOOD: list[str] = _TABLE["percent_good"]


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

    `counts` are the rows of each code in capitals, blanks good. Schemes of the `heading` go before those of `others`
    beside it. A reading needs `min_share_ratio` of the best share of good rows [-]; percentages need `min_percent` [%].

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
    full = _by_heading([one for one in known if len(one[1]) == len(words)], heading, others)
    rated: dict[frozenset[str], tuple[float, Scheme]] = {}
    for scheme, marks in full:
        share = (blank + sum(n for code, n in words.items() if marks[code] == "good")) / counts.total()
        if share > 0.0:
            rated.setdefault(_missing(marks, keep_uncertain=keep_uncertain), (share, scheme))
    if not rated:
        if any(scheme.name in _PLAIN_SCHEMES for scheme, _ in full):
            return [CodeReading(_missing(full[0][1], keep_uncertain=keep_uncertain))]
        return _read_unknown(words, [marks for scheme, marks in known if not scheme.needs_word], keep_uncertain)
    ranked = sorted(rated.items(), key=lambda item: -item[1][0])
    least = min_share_ratio * ranked[0][1][0]
    kept = [(missing, scheme.name) for missing, (share, scheme) in ranked if share >= least][:MAX_READINGS]
    return [
        CodeReading(
            missing,
            ""
            if name in _PLAIN_SCHEMES or not missing
            else f"{_listed(words.keys() - missing)} good, {_listed(missing)} not ({name})",
        )
        for missing, name in kept
    ]


def _by_heading(full: list[tuple[Scheme, Marks]], heading: str, others: Collection[str]) -> list[tuple[Scheme, Marks]]:
    """Choose the schemes that the heading names, else those that others name, else all that need no word."""
    if own := [one for one in full if _names(heading, one[0].words)]:
        return own
    free = [one for one in full if not one[0].needs_word]
    return [one for one in free if not set(others).isdisjoint(one[0].words)] or free


def _names(heading: str, words: Iterable[str]) -> bool:
    """Whether a heading ends in one of some words."""
    text = heading.strip().upper()
    return any(text == word or (text.endswith(word) and not text[-len(word) - 1].isalnum()) for word in words)


def _missing(marks: Marks, *, keep_uncertain: bool) -> frozenset[str]:
    return frozenset(c for c, mark in marks.items() if mark == "bad" or (mark == "uncertain" and not keep_uncertain))


def _listed(codes: Collection[str]) -> str:
    """List codes with their verb."""
    *head, last = sorted(codes, key=lambda code: (len(code), code))[:5] or ["a blank"]
    return f"{', '.join(head)} and {last} are" if head else f"{last} is"


def _read_unknown(
    words: Counter[str], known: list[Marks], keep_uncertain: bool, *, min_good_share: float = 0.9
) -> list[CodeReading]:
    """Read codes of which no scheme knows all, or none as good: the unknown ones are bad, or else good."""
    marks = max(known, key=lambda marks: sum(words[code] for code in marks), default={})
    good = {code for code, mark in marks.items() if mark == "good"}
    bad = _missing(marks, keep_uncertain=keep_uncertain) if good else frozenset()
    good = good or {max(words, key=lambda code: words[code])}
    unknown = frozenset(words.keys() - good - bad)
    if not unknown:
        return [CodeReading(bad, f"{_listed(good)} taken as good: no scheme of quality codes knows it")]
    strict = CodeReading(bad | unknown, f"{_listed(unknown)} not known, and taken as bad")
    lenient = CodeReading(bad, f"{_listed(unknown)} not known as good or bad, and used")
    is_rare = sum(words[code] for code in good) >= min_good_share * words.total()
    return [strict, lenient] if is_rare else [lenient, strict]


@lru_cache(maxsize=512)
def _marks(scheme: Scheme, codes: frozenset[str]) -> Marks:
    """Give the meaning of the codes that a scheme knows."""
    marks: Marks = {code: mark for code in codes if (mark := _mark(scheme, code)) is not None}
    return {} if scheme.needs_fault and set(marks.values()) == {"good"} else marks


def _mark(scheme: Scheme, code: str) -> Mark | None:
    """Give what a code means in a scheme; None when the scheme does not know it."""
    number = None
    if match := _NUMBER.fullmatch(code):
        number = int(match[1], 16) if match[1] else int(match[2])
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
    known = [_marks(scheme, codes) for scheme in schemes]
    return any(len(marks) == len(codes) and "good" in marks.values() for marks in known)


def read_quality(
    columns: Mapping[str, tuple[str, pl.Series]],
    others: Collection[str] = (),
    *,
    good_codes: Mapping[str, Collection[str]] | None = None,
    keep_uncertain: bool = False,
    where: str = "",
) -> list[QualityReading]:
    """Read the flag columns of a loop by key: heading and cells; with `good_codes` all others are bad."""
    cells = {key: read_codes(series) for key, (_, series) in columns.items()}
    groups: dict[tuple[bool, str], list[str]] = {}
    for key, (heading, _) in columns.items():
        groups.setdefault(("bad" in key.split(), re.split(r"[\W_]+", heading.strip().upper())[-1]), []).append(key)
    ways: list[tuple[list[str], list[CodeReading]]] = []
    for (is_bad, _), keys in groups.items():
        counts = sum((cells[key][1] for key in keys), Counter())
        heading, good = columns[keys[0]][0], (good_codes or {}).get(keys[0], ())
        if is_bad:
            ways.append((keys, [_read_flags(counts, heading, keep_uncertain=keep_uncertain)]))
        elif good:
            ways.append((keys, [_read_given(counts, good, where)]))
        else:
            ways.append((keys, read_code_counts(counts, heading, others, keep_uncertain=keep_uncertain)))
    readings = []
    for k in range(max((len(one) for _, one in ways), default=1)):
        reading = QualityReading()
        for keys, one in ways:
            chosen = one[min(k, len(one) - 1)]
            labels = list(dict.fromkeys(columns[key][0] for key in keys))
            named = f"Column{'s' if labels[1:] else ''} {', '.join(labels[:3])}{' ...' if labels[3:] else ''}"
            reading.notes += [f"{named}: {chosen.note}."] if chosen.note else []
            for key in keys:
                mask = cells[key][0].is_in(list(chosen.missing)).to_numpy()
                single = _single_rows(mask)
                reading.masks[key] = mask | single
                if n := int(single.sum()):
                    reading.notes.append(f"{named}: good rows between bad ones, {n} in all, are taken as bad.")
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
    is_doubt = _names(heading, ("QUESTIONABLE", "SUBSTITUTED"))
    scheme = next(one for one in SCHEMES if one.name == ("doubt flag" if is_doubt else "bad flag"))
    bad = frozenset(code for code in counts if code not in _BLANK and _mark(scheme, code) != "good")
    return CodeReading(frozenset() if is_doubt and keep_uncertain else bad)


def _read_given(counts: Counter[str], good_codes: Collection[str], where: str) -> CodeReading:
    """Read codes as the user says."""
    good = {code.strip().upper() for code in good_codes}
    present = {code for code in counts if code in good or code.removesuffix(".0") in good}
    if not present:
        listed = ", ".join(sorted(filter(None, counts))[:10])
        raise RecordError(
            "", Setting("good_codes", ",".join(good_codes)), f" names no code of a quality column; it has {listed}",
            remedy="name the good ones among these", where=where,
        )  # fmt: skip
    return CodeReading(frozenset(counts.keys() - present - _BLANK), f"{_listed(present)} good, as given")


def read_codes(cells: pl.Series) -> tuple[pl.Series, Counter[str]]:
    """Give texts or numbers as codes in capitals, and the rows that have each."""
    codes = cells.cast(pl.String, strict=False).fill_null("").str.strip_chars().str.to_uppercase()
    return codes, Counter(dict(codes.value_counts().iter_rows()))


def automatic_mask(cells: pl.Series, *, min_known: float = 0.5) -> tuple[NDArray[np.bool_] | None, list[str]]:
    """Mark rows in automatic, modes held, with notes; None below `min_known` share of known words [-]."""
    codes, counts = read_codes(cells)
    meaning = {code: _is_automatic(code) for code in counts if code not in MISSING_WORDS}
    unknown = {code: counts[code] for code, automatic in meaning.items() if automatic is None}
    if len(unknown) == len(meaning) or sum(unknown.values()) > (1.0 - min_known) * len(cells):
        return None, ["The mode column has unknown values and was not used."]
    listed = ", ".join(f"{n} x {text!r}" for text, n in sorted(unknown.items(), key=lambda item: -item[1])[:5])
    notes = [f"Unknown modes count as not automatic: {listed}."] if unknown else []
    automatic = codes.is_in([code for code, value in meaning.items() if value]).to_numpy()
    first_known = codes.is_in(list(meaning.keys() - unknown.keys())).arg_max() or 0
    last = np.maximum.accumulate(np.where(codes.is_in(list(meaning)).to_numpy(), np.arange(len(cells)), -1))
    return automatic[np.where(last < 0, first_known, last)], notes


def _is_automatic(code: str) -> bool | None:
    """Meaning of a mode, or of the first word of one such as ``AUTO LOCAL``; None when it is not known."""
    return MODES.get(code, MODES.get(code.replace("-", " ").split()[0]) if code.strip(" -") else None)

"""Columns of codes: which texts and numbers of each vendor say that a value is bad, or a controller in automatic."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.vocabulary import BAD_STATUS_WORDS, GOOD_STATUS_WORDS, MISSING_WORDS, MODES

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

__all__ = ["automatic_mask", "bad_codes", "bad_flag_mask", "bad_status_mask", "read_codes"]

OPC_UA_UNCERTAIN = 0x40000000
"""First status code of OPC UA that is not good."""
_TRUE, _FALSE = {"TRUE", "1", "1.0"}, {"FALSE", "0", "0.0"}
_PERCENT = re.compile(r"-?[0-9]{1,3}(\.[0-9]*)?")
_NUMBER = re.compile(r"(?:0X|16#)([0-9A-F]{1,8})|([0-9]{1,10})(?:\.0+)?")


def bad_codes(
    counts: Counter[str], name: str = "", *, min_good_share: float = 0.9, min_confidence: float = 50.0
) -> tuple[set[str], str]:
    """Find which codes of a quality column mean that the value is bad, and say what was assumed.

    `counts` are the rows of each code in capitals; columns named ``Confidence`` (PHD: 0 is bad, 100 is good) and
    ``Good`` have rules of their own. Good are: texts that begin with Good, OK, Valid, Normal; OPC Data Access codes
    whose two quality bits are 11 (192 to 255); OPC UA codes below 0x40000000, when the column has codes from there on
    (their highest two bits are the severity); a number that `min_good_share` of the rows [-] have (0 of OPC UA, IP.21
    and Wonderware, 128 of WinCC). With that share of good rows an unknown code is bad. `min_confidence` is in %.
    Sources: OPC Foundation, Data Access 3.00, section 6.8; OPC UA Part 4, section 7.39.
    """
    heading = name.upper().replace(".", " ").rpartition(" ")[2]
    words = {code: rows for code, rows in counts.items() if code not in MISSING_WORDS}
    if heading == "CONFIDENCE" and words and all(map(_PERCENT.fullmatch, words)):
        limit = min_confidence if max(map(float, words)) > 1.0 else min_confidence / 100.0
        return {code for code in words if float(code) < limit}, f"A confidence below {limit:g} is taken as bad."
    if heading in ("GOOD", "ISGOOD") and words.keys() <= _TRUE | _FALSE:
        return words.keys() & _FALSE, ""
    found = {code: match for code in words if (match := _NUMBER.fullmatch(code))}
    numbers = {code: int(match[1], 16) if match[1] else int(match[2]) for code, match in found.items()}
    is_opc_ua = max(numbers.values(), default=0) >= OPC_UA_UNCERTAIN
    bad = {code for code in words if code.startswith(BAD_STATUS_WORDS)}
    good = {code for code in words if code in GOOD_STATUS_WORDS or code.startswith("GOOD")}
    good |= {code for code, n in numbers.items() if (n < OPC_UA_UNCERTAIN if is_opc_ua else 192 <= n <= 255)}
    min_rows, note = min_good_share * sum(words.values()), ""
    usual = max(words, key=lambda code: words[code], default="")
    if not good and usual in numbers and words[usual] >= min_rows:
        good, note = {usual}, f"{usual!r}, which most rows have, is taken as good."
    unknown = words.keys() - good - bad
    if sum(words[code] for code in good) >= min_rows:
        return bad | unknown, note
    if unknown:
        most = max(unknown, key=lambda code: words[code])
        note = f"{most!r} is not known as good or bad, and {words[most]} rows that have it are used."
    return bad, note


def bad_status_mask(cells: pl.Series, name: str = "") -> tuple[NDArray[np.bool_], str]:
    """Mark the rows whose quality is bad, shape (n_rows,), and say what was assumed."""
    codes, counts = read_codes(cells)
    bad, note = bad_codes(counts, name)
    return codes.is_in(list(bad)).to_numpy(), note


def bad_flag_mask(cells: pl.Series) -> NDArray[np.bool_]:
    """Mark the rows that a column of bad flags marks, shape (n_rows,)."""
    codes, _ = read_codes(cells)
    return ~codes.is_in([*_FALSE, "NO", "N", *GOOD_STATUS_WORDS, *MISSING_WORDS]).to_numpy()


def read_codes(cells: pl.Series) -> tuple[pl.Series, Counter[str]]:
    """Give texts or numbers as codes in capitals, and the rows that have each."""
    import polars as pl

    codes = cells.cast(pl.String, strict=False).fill_null("").str.strip_chars().str.to_uppercase()
    return codes, Counter(dict(codes.value_counts().iter_rows()))


def automatic_mask(cells: pl.Series, *, min_known: float = 0.5) -> tuple[NDArray[np.bool_] | None, list[str]]:
    """Mark the rows in which the controller moves the valve by itself; give also notes on unknown modes.

    The mask is None when less than `min_known` of the cells [-] are known words. A mode holds until the next one.
    """
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

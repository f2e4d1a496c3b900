"""Quality columns: which texts and numbers of each vendor say that a value is bad."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.vocabulary import BAD_STATUS_WORDS, GOOD_STATUS_WORDS, MISSING_WORDS

if TYPE_CHECKING:
    from collections.abc import Collection

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["CodeColumn", "bad_codes", "bad_flag_mask", "bad_status_mask"]

NOT_BAD = {"0", "0.0", "FALSE", "NO", "N", *GOOD_STATUS_WORDS, *MISSING_WORDS}
"""What a column of bad flags says of a good value."""
CONFIDENCE_NAMES = ("CONFIDENCE",)
"""Columns in percent of confidence (PHD: 0 is bad, 100 is good)."""
OPC_UA_UNCERTAIN = 0x40000000
"""First status code of OPC UA that is not good."""
TRUE_CODES, FALSE_CODES = ("TRUE", "1", "1.0"), ("FALSE", "0", "0.0")
_PERCENT = re.compile(r"-?[0-9]{1,3}(\.[0-9]*)?")
_NUMBER = re.compile(r"(?:0X|16#)([0-9A-F]{1,8})|([0-9]{1,10})(?:\.0+)?")


def bad_codes(
    counts: Counter[str], name: str = "", *, min_good_share: float = 0.9, min_confidence: float = 50.0
) -> tuple[set[str], str]:
    """Find which codes of a quality column mean that the value is bad, and say what was assumed.

    Parameters
    ----------
    counts : Counter
        Code in capitals -> rows that have it. An empty cell says nothing.
    name : str
        Heading of the column; ``Confidence`` and ``Good`` have rules of their own.
    min_good_share : float
        Share of the rows that must be good by known codes, or have the same number, before an unknown code counts as
        bad [-].
    min_confidence : float
        Confidence below which a value is bad [%].

    Notes
    -----
    Known as good: texts that begin with Good, OK, Valid, Normal; OPC Data Access codes whose two quality bits are 11
    (192 to 255); OPC UA codes below 0x40000000, when the column has codes from there on (their two highest bits are
    the severity: 01 uncertain, 10 bad). A number that nearly all rows have is taken as good (0 of OPC UA, IP.21 and
    Wonderware, 128 of WinCC, 100 of PHD).

    Sources: OPC Foundation, Data Access 3.00, section 6.8; OPC UA Part 4, section 7.39.

    Examples
    --------
    >>> from collections import Counter
    >>> bad_codes(Counter({"192": 90, "24": 3})), bad_codes(Counter({"RUN": 90, "BAD": 3}))[0]
    (({'24'}, ''), {'BAD'})
    >>> bad_codes(Counter({"100": 90, "0": 3}), "Confidence")[0]
    {'0'}
    """
    heading = name.upper().replace(".", " ").split()
    words = {code: rows for code, rows in counts.items() if code not in MISSING_WORDS}
    numbers = {code: number for code in words if (number := _code_number(code)) is not None}
    if heading and heading[-1] in CONFIDENCE_NAMES and words and all(_PERCENT.fullmatch(code) for code in words):
        limit = min_confidence if max(map(float, words)) > 1.0 else min_confidence / 100.0
        return {code for code in words if float(code) < limit}, f"A confidence below {limit:g} is taken as bad."
    if heading and heading[-1] in ("GOOD", "ISGOOD") and words.keys() <= {*TRUE_CODES, *FALSE_CODES}:
        return set(words) & set(FALSE_CODES), ""
    bad = {code for code in words if code.startswith(BAD_STATUS_WORDS)}
    is_opc_ua = any(number >= OPC_UA_UNCERTAIN for number in numbers.values())
    good = {code for code in words if code in GOOD_STATUS_WORDS or code.startswith("GOOD")}
    good |= {code for code, n in numbers.items() if (n < OPC_UA_UNCERTAIN if is_opc_ua else 192 <= n <= 255)}
    usual = max(words, key=lambda code: words[code], default="")
    total, note = sum(words.values()), ""
    if not good and usual in numbers and words[usual] >= min_good_share * total:
        good, note = {usual}, f"{usual!r}, which most rows have, is taken as good."
    unknown = words.keys() - good - bad
    if sum(words[code] for code in good) >= min_good_share * total:
        return bad | unknown, note
    if unknown:
        most = max(unknown, key=lambda code: words[code])
        note = f"{most!r} is not known as good or bad, and {words[most]} rows that have it are used."
    return bad, note


def _code_number(code: str) -> int | None:
    """A code as a number; hexadecimal ones begin with 0x or 16#."""
    found = _NUMBER.fullmatch(code)
    return None if found is None else int(found[1], 16) if found[1] else int(found[2])


def bad_status_mask(cells: pl.Series, name: str = "", **thresholds: float) -> tuple[NDArray[np.bool_], str]:
    """Mark the rows whose quality is bad, shape (n_rows,), and say what was assumed; thresholds as for `bad_codes`.

    Examples
    --------
    >>> import polars as pl
    >>> int(bad_status_mask(pl.Series(["Good"] * 20 + ["Bad"]))[0].sum())
    1
    """
    column = CodeColumn(cells)
    bad, note = bad_codes(column.counts, name, **thresholds)
    return column.rows_with(bad), note


def bad_flag_mask(cells: pl.Series) -> NDArray[np.bool_]:
    """Mark the rows that a column of bad flags marks, shape (n_rows,).

    Examples
    --------
    >>> import polars as pl
    >>> bad_flag_mask(pl.Series(["0", "", "1", "False"])).tolist()
    [False, False, True, False]
    """
    column = CodeColumn(cells)
    return column.rows_with(column.counts.keys() - NOT_BAD)


class CodeColumn:
    """A column of few different texts or numbers, read as codes in capitals."""

    def __init__(self, cells: pl.Series) -> None:
        import polars as pl

        self._texts = cells.cast(pl.String, strict=False).fill_null("")
        found = self._texts.value_counts()
        self._codes = {text: text.strip().upper() for text in found[:, 0]}
        self.counts: Counter[str] = Counter()
        for text, n in found.iter_rows():
            self.counts[self._codes[text]] += n

    def rows_with(self, codes: Collection[str]) -> NDArray[np.bool_]:
        """Mark the rows that have one of some codes, shape (n_rows,)."""
        texts = [text for text, code in self._codes.items() if code in codes]
        return self._texts.is_in(texts).to_numpy() if texts else np.zeros(len(self._texts), dtype=bool)

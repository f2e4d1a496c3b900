"""Columns of codes: their texts, and which modes say that a controller is in automatic."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.sources.roles.vocabulary import MISSING_WORDS, MODES

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["automatic_mask", "read_codes"]


def read_codes(cells: pl.Series) -> tuple[pl.Series, Counter[str]]:
    """Give texts or numbers as codes in capitals, and the rows that have each."""
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

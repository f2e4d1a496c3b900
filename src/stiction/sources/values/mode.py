"""Controller mode to "in automatic" for each row."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.vocabulary import MISSING_WORDS, MODES
from stiction.sources.values.status_codes import CodeColumn

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

__all__ = ["automatic_mask"]


def automatic_mask(cells: pl.Series, *, min_known: float = 0.5) -> tuple[NDArray[np.bool_] | None, list[str]]:
    """Mark the rows in which the controller moves the valve by itself.

    Parameters
    ----------
    cells : polars.Series, shape (n_rows,)
        Mode, in words of any vendor or as 1 and 0. Cascade counts as automatic. A mode holds until the next is written.
    min_known : float
        Share of the cells that must be known words before the column is used [-].

    Returns
    -------
    mask : ndarray of bool, shape (n_rows,), or None
        True in automatic; None when the column is not understood.
    notes : list of str
        Modes that are not known.

    Examples
    --------
    >>> import polars as pl
    >>> automatic_mask(pl.Series(["AUTO", "", "MAN", "CAS"]))[0].tolist()
    [True, True, False, True]
    """
    column = CodeColumn(cells)
    meaning = {code: _is_automatic(code) for code in column.counts if code not in MISSING_WORDS}
    unknown = {code: column.counts[code] for code, automatic in meaning.items() if automatic is None}
    if len(unknown) == len(meaning) or sum(unknown.values()) > (1.0 - min_known) * len(cells):
        return None, ["The mode column is not understood and was left out."]
    listed = ", ".join(f"{n} x {text!r}" for text, n in sorted(unknown.items(), key=lambda item: -item[1])[:5])
    notes = [f"Modes not known count as not automatic: {listed}."] if unknown else []
    automatic = column.rows_with([code for code, value in meaning.items() if value])
    known = column.rows_with(meaning.keys() - unknown.keys())
    last = np.maximum.accumulate(np.where(column.rows_with(meaning), np.arange(len(cells)), -1))
    return automatic[np.where(last < 0, known.argmax(), last)], notes


def _is_automatic(code: str) -> bool | None:
    """Meaning of a mode, or of the first word of one such as ``AUTO LOCAL``; None when it is not known."""
    return MODES.get(code, MODES.get(code.replace("-", " ").split()[0]) if code.strip(" -") else None)

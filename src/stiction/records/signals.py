"""What columns mean: flagged rows, OP in % of span, mode to automatic or not."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.dialects import BAD_WORDS, FRACTION_UNITS, GOOD_WORDS, MISSING_WORDS, MODES, OTHER_OUTPUT_UNITS
from stiction.records.quality.movement import detect_op_scale
from stiction.records.quality.outliers import find_outliers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.records.resample import Grid
    from stiction.records.table import Columns

__all__ = [
    "automatic",
    "bad_codes",
    "flagged_rows",
    "in_percent",
    "not_good",
    "position_in_percent",
]

OP_SCALE_WORDS = {
    "percent": "",
    "fraction": "like a fraction of span",
    "normalised": "normalised",
    "other": "like no percentage",
}
"""What `detect_op_scale` returns -> how a sentence says it."""
MOSTLY = 0.9
"""Share of the rows that are good in a column that tells the quality [-]; in another one, such as a status of the
plant, words that are not known say nothing."""
SIGNAL_SPANS = ((4.0, 20.0), (0.0, 1.0))
"""Ranges [mA] and [-] in which a position is recorded that is not in %."""
CURRENT = 3.8, 20.5
"""Range in which a current lives that is no sign of a fault, after NAMUR NE 43 [mA]."""
NEARER = 0.25
"""How near to OP, as a share of its distance as it stands, a position comes that is in another range than % [-]."""


def flagged_rows(
    signals: dict[str, int], taken: Columns, names: list[str], guesses: list[str], owner: str = ""
) -> NDArray[np.bool_]:
    """Rows that the flags of a loop mark, or those of the signal `owner` alone, shape (n_rows,)."""
    flagged = np.zeros(taken.rows, dtype=bool)
    bad, quality = (signals.get(f"{owner} {flag}".strip()) for flag in ("bad", "quality"))
    if bad is not None:
        cells = taken.text[bad]
        flagged |= np.array([cell.strip().upper() not in ("0", "0.0", "FALSE", *MISSING_WORDS) for cell in cells])
    if quality is not None:
        flagged |= not_good(taken.text[quality], names[quality] if names else f"column {quality}", guesses)
    return flagged


def not_good(cells: Sequence[str], shown: str, guesses: list[str]) -> NDArray[np.bool_]:
    """Rows that the quality in the column `shown` marks as bad, shape (n_rows,)."""
    codes = [cell.strip().upper() for cell in cells]
    bad, guess = bad_codes(Counter(codes))
    if guess:
        guesses.append(f"Column {shown}: {guess}")
    return np.array([code in bad for code in codes])


def bad_codes(told: Counter[str]) -> tuple[set[str], str]:
    """Which codes of a quality or status mean bad, and what was guessed.

    Parameters
    ----------
    told : Counter
        Code in capitals -> rows that have it.

    Returns
    -------
    bad : set of str
        What begins with one of `BAD_WORDS`. Where `MOSTLY` all rows have a word of `GOOD_WORDS`, a code of OPC from 192
        to 255 or, without any, one number (OPC UA writes 0, WinCC 128, others 100), all other codes too. An empty cell
        says nothing.
    guess : str
        A sentence; empty where nothing was guessed.

    Examples
    --------
    >>> from collections import Counter
    >>> from stiction.records.signals import bad_codes
    >>> bad_codes(Counter({"192": 90, "24": 3})), bad_codes(Counter({"RUN": 90, "BAD": 3}))[0]
    (({'24'}, ''), {'BAD'})
    """
    bad = {code for code in told if code.startswith(BAD_WORDS)}
    good = {code for code in told if _known_good(code)}
    said = {code: rows for code, rows in told.items() if code not in MISSING_WORDS}
    usual = max(said, key=lambda code: said[code], default="")
    guess = ""
    if not good and _as_code(usual) is not None and said[usual] >= MOSTLY * sum(said.values()):
        good, guess = {usual}, f"{usual!r}, which most rows have, is taken as good."
    unknown = set(said) - good - bad
    if sum(said[code] for code in good) >= MOSTLY * sum(said.values()):
        return bad | unknown, guess
    if unknown:
        most = max(unknown, key=lambda code: said[code])
        guess = f"{most!r} is not known as good or bad, and {said[most]} rows that have it are used."
    return bad, guess


def _known_good(code: str) -> bool:
    number = _as_code(code)
    return 192 <= number <= 255 if number is not None else code in GOOD_WORDS or code.startswith("GOOD")


def _as_code(code: str) -> int | None:
    """A quality as a number; hexadecimal ones begin with 0x."""
    if re.fullmatch(r"0X[0-9A-F]{1,8}", code):
        return int(code, 16)
    return int(code.removesuffix(".0")) if re.fullmatch(r"[0-9]{1,10}(\.0)?", code) else None


def in_percent(op: NDArray, written: str, op_range: tuple[float, float] | None, guesses: list[str]) -> NDArray:
    """OP in % of span where its range is known; otherwise as it stands, with a word on what it looks like."""
    low, high = _ends(op)
    unit = written.upper()
    if op_range is not None:
        return _of_span(op, op_range)
    if (known := _by_unit(op, unit, "OP", guesses)) is not None:
        return known
    suspicion = OP_SCALE_WORDS[detect_op_scale(low, high)]
    if unit == "MA":
        suspicion = "like no current of 4 to 20 mA"
    if suspicion:
        fraction = low >= 0.0 and high <= 1.0 and unit not in OTHER_OUTPUT_UNITS
        hint = "(4, 20)" if unit == "MA" else "(0, 1)" if fraction else "(low, high)"
        guesses.append(
            f"OP lies in {low:.4g} to {high:.4g} and looks {suspicion}: left as it is, S and J are then in its unit; "
            f"give op_range={hint} to convert."
        )
    elif unit in OTHER_OUTPUT_UNITS:
        guesses.append(
            f"OP is given in {written}: left as it is, S and J are then in its unit; give op_range=(low, high), OP at "
            "0 % and at 100 %, to convert."
        )
    elif not unit and low >= CURRENT[0] and high <= CURRENT[1]:
        guesses.append(f"OP lies in {low:.4g} to {high:.4g} and is taken as %; if it is in mA, give op_range=(4, 20).")
    return op


def position_in_percent(
    mv: NDArray,
    unit: str,
    mv_range: tuple[float, float] | None,
    op: NDArray,
    op_range: tuple[float, float] | None,
    guesses: list[str],
) -> NDArray:
    """Valve position in % of span where its range is known; otherwise as it stands, with a word where OP is unlike it.

    Parameters
    ----------
    mv : ndarray, shape (n_samples,)
        Valve position [unit of the column].
    unit : str
        Its unit in capitals; empty where the header names none.
    mv_range : pair of float, optional
        Position at 0 and at 100 % of span [unit of the column].
    op : ndarray, shape (n_samples,)
        OP [% of span], as far as that is known.
    op_range : pair of float, optional
        OP at 0 and at 100 % of span, where the user gave it [unit of the column].
    guesses : list of str
        Is added to.

    Examples
    --------
    >>> import numpy as np
    >>> told = []
    >>> position_in_percent(np.array([8.0, 12.0]), "MA", None, np.array([25.0, 50.0]), None, told).tolist()
    [25.0, 50.0]
    >>> position_in_percent(np.array([0.25, 0.5]), "", None, np.array([25.0, 50.0]), None, told).tolist(), told[1][-27:]
    ([0.25, 0.5], 'mv_range=(0, 1) to convert.')
    """
    if mv_range is not None:
        return _of_span(mv, mv_range)
    both = np.isfinite(mv) & np.isfinite(op)
    if not both.any():
        return mv
    said = "The valve position"
    if unit in (*FRACTION_UNITS, "MA") and (known := _by_unit(mv, unit, said, guesses)) is not None:
        return known
    low, high = _ends(mv)
    spans = [span for span in dict.fromkeys((op_range, *SIGNAL_SPANS)) if span]
    near = [span for span in spans if _apart(_of_span(mv, span)[both], op[both]) < NEARER * _apart(mv[both], op[both])]
    off = detect_op_scale(*_ends(op)) == "percent" and (low < -10.0 or high > 110.0)
    if near or off or unit in OTHER_OUTPUT_UNITS:
        hint = f"({near[0][0]:g}, {near[0][1]:g})" if near else "(low, high)"
        looks = f" and goes with OP as a signal of {near[0][0]:g} to {near[0][1]:g} would" if near else ""
        guesses.append(
            f"{said} lies in {low:.4g} to {high:.4g}{looks}: it is taken as % of span as it stands; give "
            f"mv_range={hint} to convert."
        )
    return mv


def _ends(values: NDArray) -> tuple[float, float]:
    """Smallest and largest value; a code for a bad one says nothing of the scale."""
    seen = values[np.isfinite(values) & ~find_outliers(values)]
    return float(seen.min()), float(seen.max())


def _of_span(values: NDArray, span: tuple[float, float]) -> NDArray:
    return (values - span[0]) * (100.0 / (span[1] - span[0]))


def _by_unit(values: NDArray, unit: str, said: str, guesses: list[str]) -> NDArray | None:
    """Values in % of span by their unit, a fraction or mA; None where it does not tell, or they cannot be in it."""
    low, high = _ends(values)
    if unit in FRACTION_UNITS and low >= -0.1 and high <= 1.1:
        guesses.append(f"{said} is given in {unit.lower()} and was multiplied by 100.")
        return values * 100.0
    if unit == "MA" and low >= 3.6 and high <= 21.0:  # the range in which NAMUR NE 43 lets a signal live
        option = "op_range" if said == "OP" else "mv_range"
        guesses.append(
            f"{said} is given in mA: 4 mA are taken as 0 % and 20 mA as 100 %; give {option} if that is wrong."
        )
        return _of_span(values, (4.0, 20.0))
    return None


def _apart(one: NDArray, other: NDArray) -> float:
    """Usual distance of two series."""
    return float(np.median(np.abs(one - other)))


def automatic(signals: dict[str, int], taken: Columns, grid: Grid, guesses: list[str]) -> NDArray[np.bool_] | None:
    """Mark the samples in automatic; a mode holds until the next is written."""
    if "mode" not in signals:
        return None
    cells = [cell.strip().upper() for cell in taken.text[signals["mode"]]]
    unknown = Counter(cell for cell in cells if cell not in MODES and cell not in MISSING_WORDS)
    if sum(unknown.values()) * 2 > len(cells) or not any(cell in MODES for cell in cells):
        guesses.append("The mode column is not understood and was left out.")
        return None
    if unknown:
        listed = ", ".join(f"{n} x {text!r}" for text, n in unknown.most_common(5))
        guesses.append(f"Modes not known count as not automatic: {listed}.")
    auto = np.empty(len(cells), dtype=bool)
    current = next(MODES[cell] for cell in cells if cell in MODES)
    for k, cell in enumerate(cells):
        if cell not in MISSING_WORDS:
            current = MODES.get(cell, False)
        auto[k] = current
    last = np.maximum.accumulate(np.where(grid.pick >= 0, np.arange(len(grid.pick)), 0))
    return auto[grid.pick[last]]

"""Numbers in several units, to one unit: by `pint`, where it knows both."""

from __future__ import annotations

import re
from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.errors import RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OneUnit", "is_known_unit", "scale_between", "to_one_unit"]

_POWER = re.compile(r"(?<=[a-zA-Z])(?=[23](?![0-9]))")
_SPELLINGS = {"°": "deg", "³": "3", "²": "2", "·": "*", "usgpm": "gpm", "gpm": "gallon/minute", "pct": "%"}
# Of the same name, but not of the same zero or state: gauge and absolute pressure, normal and standard volume.
_KINDS = ((r"(?i)(bar|kpa|mpa|psi|pa)(g|a|\(g\)|\(a\))$", 2), (r"^([NS])(?=m3|m³|l/)", 1))


class OneUnit(NamedTuple):
    """Numbers in one unit."""

    values: NDArray[np.float64]
    """The numbers [`unit`]."""
    unit: str
    """The unit that most had, as written."""
    note: str
    """What was converted; empty where there was one unit."""


def to_one_unit(
    values: NDArray[np.float64], units: list[str], codes: NDArray[np.integer], where: str, *, written: str = ""
) -> OneUnit:
    """Convert numbers to the unit that a header names, where some have it, else to the one that most have.

    Parameters
    ----------
    values : ndarray, shape (n_rows,)
        The numbers [unit of each row].
    units : list of str
        Different units as written; blank for none.
    codes : ndarray, shape (n_rows,)
        Position in `units` of each row.
    where : str
        File and column, for messages.
    written : str
        Unit by the header.

    Raises
    ------
    RecordError
        When two units cannot be converted into each other.

    Examples
    --------
    >>> found = to_one_unit(np.array([990.0, 1.01, 1.02]), ["L/h", "kL/h"], np.array([0, 1, 1]), "a.csv")
    >>> found.values, found.unit, found.note
    (array([0.99, 1.01, 1.02]), 'kL/h', '1 value in L/h was converted to kL/h.')
    """
    rows = Counter(codes[np.isfinite(values)].tolist())
    counts = {units[k]: n for k, n in rows.most_common()}
    if len(counts) < 2:
        return OneUnit(values, next(iter(counts), ""), "")
    target = next((unit for unit in counts if unit.upper() == written.upper()), next(iter(counts)))
    others = [unit for unit in counts if unit != target]
    values, told = values.copy(), []
    for unit in others:
        scale = scale_between(unit, target)
        if scale is None:
            listed = ", ".join(f"{n} {f'in {one}' if one else 'without a unit'}" for one, n in list(counts.items())[:4])
            raise RecordError(
                f"mixes units ({listed}); export all its values in one unit, or without units.", where=where
            )
        mask = codes == units.index(unit)
        values[mask] = values[mask] * scale[0] + scale[1]
        told.append(f"{counts[unit]} {'value' if counts[unit] == 1 else 'values'} in {unit}")
    is_one = len(told) == 1 and counts[others[0]] == 1
    return OneUnit(values, target, f"{', '.join(told)} {'was' if is_one else 'were'} converted to {target}.")


def is_known_unit(text: str) -> bool:
    """Whether pint knows a unit."""
    return scale_between(text, text) is not None


@lru_cache(maxsize=1024)
def scale_between(unit: str, target: str) -> tuple[float, float] | None:
    """Give factor and offset from one unit to another; None when pint does not know them, or they differ in kind.

    Examples
    --------
    >>> scale_between("kL/h", "m3/h"), scale_between("bar", "barg")
    ((1.0, 0.0), None)
    """
    import pint

    kinds, texts = zip(_split_kind(unit), _split_kind(target), strict=True)
    if kinds[0] != kinds[1]:
        return None
    try:
        registry = pint.get_application_registry()
        one, other = (_parse(registry, text) for text in texts)
        if one.dimensionless and "%" not in unit + target:
            return None
        zero, full = (registry.Quantity(x, one).to(other).magnitude for x in (0.0, 1.0))
    except Exception:
        return None
    factor = full - zero
    return (factor, zero) if np.isfinite(factor) and factor > 0.0 else None


def _parse(registry: Any, text: str) -> Any:
    try:
        return registry.parse_units(text)
    except Exception:
        return registry.parse_units(text, case_sensitive=False)


def _split_kind(unit: str) -> tuple[str, str]:
    """Split gauge, absolute, normal or standard off a unit, and spell the rest as pint does."""
    text, kind = unit.strip(), ""
    for pattern, group in _KINDS:
        if found := re.search(pattern, text):
            kind = found[group].strip("()").lower()
            text = text[: found.start(group)] + text[found.end(group) :]
    for written, known in _SPELLINGS.items():
        text = re.sub(re.escape(written), known, text, flags=re.IGNORECASE) if written in text.lower() else text
    return kind, _POWER.sub("**", text)

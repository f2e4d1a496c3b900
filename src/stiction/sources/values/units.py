"""Numbers in several units, to one unit: by `pint`, where it knows both."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["scale_between", "to_one_unit"]

_POWER = re.compile(r"(?<=[a-zA-Z])(?=[23](?![0-9]))")
_SPELLINGS = {"°": "deg", "³": "3", "²": "2", "·": "*", "gpm": "gallon/minute", "pct": "%"}
# Gauge and absolute pressure, normal and standard volume: of one name, but not of one zero or state.
_KIND = re.compile(r"(?<=bar|kpa|mpa|psi)\(?([ga])\)?$|^([ns])(?=m3|m³|l/)", re.IGNORECASE)


def to_one_unit(
    values: NDArray[np.float64], units: list[str], codes: NDArray[np.integer], where: str, *, written: str = ""
) -> tuple[NDArray[np.float64], str, str]:
    """Convert numbers to the unit that a header names (`written`), where some have it, else to that of most.

    `codes` give for each row its place in `units`, in which "" stands for none; `where` is file and column, for the
    RecordError that is raised when two units cannot be converted into each other. Returns the numbers, their unit as
    written, and what was converted: empty where there was one unit.

    >>> to_one_unit(np.array([990.0, 1.01, 1.02]), ["L/h", "kL/h"], np.array([0, 1, 1]), "a.csv")
    (array([0.99, 1.01, 1.02]), 'kL/h', '1 value in L/h was converted to kL/h.')
    """
    rows = np.bincount(codes[np.isfinite(values)], minlength=len(units)).tolist()
    counts = {unit: n for n, unit in sorted(zip(rows, units, strict=True), key=lambda pair: -pair[0]) if n}
    if len(counts) < 2:
        return values, next(iter(counts), ""), ""
    target = next((unit for unit in counts if unit.upper() == written.upper()), next(iter(counts)))
    values, told = values.copy(), []
    for unit, n in counts.items():
        scale = (1.0, 0.0) if unit == target else scale_between(unit, target)
        if scale is None:
            texts = [f"{n} {f'in {one}' if one else 'without a unit'}" for one, n in list(counts.items())[:4]]
            raise RecordError(
                f"mixes units ({', '.join(texts)}); export all its values in one unit, or without units.", where=where
            )
        mask = codes == units.index(unit)
        values[mask] = values[mask] * scale[0] + scale[1]
        told += [f"{n} {'value' if n == 1 else 'values'} in {unit}"] if unit != target else []
    was = "was" if told[1:] == [] and told[0].startswith("1 ") else "were"
    return values, target, f"{', '.join(told)} {was} converted to {target}."


@lru_cache(maxsize=1024)
def scale_between(unit: str, target: str) -> tuple[float, float] | None:
    """Give factor and offset from one unit to another; None when pint does not know them, or they differ in kind.

    >>> scale_between("kL/h", "L/h"), scale_between("bar", "barg")
    ((1000.0, 0.0), None)
    """
    import pint

    (kind, text), (other_kind, other) = _split_kind(unit), _split_kind(target)
    try:
        registry = pint.get_application_registry()
        one, end = registry.parse_units(text), registry.parse_units(other)
        zero, full = (registry.Quantity(x, one).to(end).magnitude for x in (0.0, 1.0))
    except Exception:  # the parser raises errors of many kinds on texts that are no units
        return None
    is_pure = one.dimensionless and "%" not in unit + target
    factor = full - zero
    return None if is_pure or kind != other_kind or not 0.0 < factor < np.inf else (factor, zero)


def _split_kind(unit: str) -> tuple[str, str]:
    """Split gauge, absolute, normal or standard off a unit, and spell the rest as pint does."""
    found = re.search(_KIND, unit.strip())
    text = _KIND.sub("", unit.strip())
    if text.isupper() and ("/" in text or len(text) > 2):  # T/H is no tesla per henry
        text = {"KPA": "kPa", "MPA": "MPa", "DEGC": "degC", "DEGF": "degF"}.get(text, text.lower())
    for written, known in _SPELLINGS.items():
        text = re.sub(re.escape(written), known, text, flags=re.IGNORECASE)
    return (found[1] or found[2]).lower() if found else "", _POWER.sub("**", text)

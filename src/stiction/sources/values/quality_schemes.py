"""The quality codes of each vendor, from `quality_schemes.toml` beside this page."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["PERCENT_GOOD", "SCHEMES", "Scheme"]


class Scheme(NamedTuple):
    """The codes of one vendor or standard; what each field means stands in the table."""

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


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
SCHEMES = tuple(map(_scheme, _TABLE["scheme"]))
PERCENT_GOOD: list[str] = _TABLE["percent_good"]

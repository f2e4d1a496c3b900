"""Numbers from outside the code under test, one table per room.

A table is a tuple of `Row`; its file is named after the room (or the page) it belongs to. `trust` says how the number
was come by: "published" (read in the source), "derived" (closed form, or an independent simulation by slow code of its
own), "recalled" (after the source, from memory: never to be printed as published).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

TRUST = ("published", "derived", "recalled")


@dataclass(frozen=True)
class Row:
    """One case and what must come out."""

    case: str
    given: dict[str, Any]
    expected: Any
    tolerance: float
    """Relative; 0 asks for the same bits."""
    source: str
    trust: str = "derived"
    note: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        assert self.trust in TRUST, self.trust
        assert self.source, f"{self.case} has no source"

    def __str__(self) -> str:
        return self.case

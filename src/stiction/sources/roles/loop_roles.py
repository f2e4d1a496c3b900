"""The columns of each loop by role, and the groups of columns that become loops."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.sources.table import TagColumn

__all__ = ["FLAG_ROLES", "NUMERIC_ROLES", "ROLES", "LoopRoles", "TagGroup", "column_label", "list_roles"]

NUMERIC_ROLES = ("pv", "sp", "op", "mv", "valve_signal")
"""Signals that are numbers."""
FLAG_ROLES = ("bad", "quality")
"""Columns that say which rows count; as ``pv quality`` they say it of one signal alone."""
ROLES = (*NUMERIC_ROLES, "mode", *FLAG_ROLES)
"""Roles that a user can give to a column."""
HOW_TO_OVERRULE = "name the columns (--column, in Python columns=) or give a map if that is wrong."
"""End of a note on a guessed role."""


@dataclass(eq=False)
class LoopRoles:
    """The columns of one loop."""

    tag: str
    """Name of the loop; empty when the source names none."""
    roles: dict[str, TagColumn]
    """Role -> column: pv, sp, op, mv, valve_signal, mode, bad, quality, and ``pv quality``, ``op bad`` and so on; a
    further flag of the same kind has a number after it (``pv bad 2``)."""
    loop_type: str = "other"
    """Loop type by the letters or words of the tag, or "other"."""
    area: str = ""
    """Plant area, by the map."""
    importance: str = ""
    """Importance of the loop, by the map."""
    master: str = ""
    """Tag of the loop whose OP is the set point of this one, by the map."""
    spans: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Role -> value at 0 and at 100 % of span [unit of the column], by the map."""
    units: dict[str, str] = field(default_factory=dict)
    """Role -> unit, by the map; it replaces the unit of the source."""
    good_codes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Role of a quality column -> codes that are good, by the map."""
    notes: list[str] = field(default_factory=list)
    """Guesses, a sentence each."""
    unused: list[str] = field(default_factory=list)
    """Names of columns that stand beside a signal of the loop and were not used."""

    def unit_of(self, role: str) -> str:
        """Unit of a role, by the map or else by the source; empty when neither names one."""
        return self.units.get(role) or (self.roles[role].unit if role in self.roles else "")


@dataclass(eq=False)
class TagGroup:
    """Columns that share a tag, by role, while the roles are being assigned."""

    tag: str
    columns: dict[str, list[TagColumn]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def is_loop(self) -> bool:
        """Whether the columns make a loop: OP, and PV or the valve position."""
        return "op" in self.columns and ("pv" in self.columns or "mv" in self.columns)

    @property
    def has_numbers(self) -> bool:
        """Whether a column is a signal of numbers."""
        return bool(self.columns.keys() & set(NUMERIC_ROLES))

    def add(self, role: str, column: TagColumn) -> None:
        """Give a role to one more column."""
        self.columns.setdefault(role, []).append(column)

    def all_columns(self) -> list[TagColumn]:
        """All columns of the group."""
        return [column for columns in self.columns.values() for column in columns]


def column_label(column: TagColumn) -> str:
    """Name of a column for messages."""
    return column.name or f"column {column.position}"


def list_roles(roles: Mapping[str, TagColumn]) -> str:
    """Columns with their roles, for messages."""
    return ", ".join(f"{column_label(column)} = {role.split()[-1].upper()}" for role, column in roles.items())

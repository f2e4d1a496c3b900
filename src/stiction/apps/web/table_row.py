"""A row of the table of loops, of dropped files as of an audit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.display.finding_words import finding_level

if TYPE_CHECKING:
    from stiction.fleet import LoopRow

__all__ = ["table_row"]

ROW_NAMES = (
    "tag", "area", "source", "status", "finding_text", "next_step", "verdict", "probability", "loop_state",
    "oscillation_cause", "period_s", "S", "J", "op_unit", "priority", "priority_reason", "group", "follows",
)  # fmt: skip
"""What the table of loops shows of a row."""
NUMBERS = ("probability", "S", "J", "period_s", "priority")
"""Fields that are sorted as numbers and shown as text."""


def table_row(row: LoopRow) -> dict[str, Any]:
    """Return what the table shows of a row: values to sort and export by, and `texts` of its numbers."""
    short = {name: row[name] for name in ROW_NAMES if row[name] not in (None, "")}
    for name in ("S", "J"):
        if not row.text(name):  # the size of the best fit, where neither stiction nor play is found
            short.pop(name, None)
    if row.failed or row.status == "screened":
        del short["verdict"]
    elif row.finding:
        short["level"] = finding_level(row.finding)
    if row.failed:
        short["error"] = row.reason
    return short | {"texts": {name: text for name in NUMBERS if (text := row.text(name))}}

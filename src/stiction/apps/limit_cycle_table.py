"""Table of limit cycles for the command line and for HTML pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stiction.limitcycle import LimitCycle

__all__ = ["COLUMNS", "FAMILIES", "cycle_row"]

COLUMNS = (
    "Kind", "Family", "Stable", "Period [s]", "OP amplitude [%]", "PV amplitude", "Exact period [s]", "Exact OP [%]",
    "Exact PV", "Trust",
)  # fmt: skip

FAMILIES = (
    "A stem that only rests and jumps returns to the same rest levels in each cycle. The families half and integer are "
    "symmetric about the steady state. With another set point or load the levels lie between these two, with another "
    "period and amplitude; in a simulation they drift slowly, faster for a longer dt."
)


def cycle_row(cycle: LimitCycle) -> list[Any]:
    """Return the table row of a limit cycle."""
    from stiction.report.labels import format_number

    exact = cycle.exact or (cycle if cycle.method == "continuous" else None)
    return [
        cycle.kind,
        cycle.family or "-",
        {True: "stable", False: "unstable", None: "unknown"}[cycle.stable],
        format_number(cycle.period, significant=4),
        format_number(cycle.amplitude, significant=4),
        format_number(cycle.amplitude_pv, significant=4),
        "" if exact is None else format_number(exact.period, significant=5),
        "" if exact is None else format_number(exact.amplitude, significant=4),
        "" if exact is None else format_number(exact.amplitude_pv, significant=4),
        cycle.trust,
    ]

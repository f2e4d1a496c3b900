"""The page of the limit cycles of a loop: table, Nyquist plot, cycles in time, phase portrait, basins, bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.limitcycle.predict import explain_no_cycle
from stiction.report.blocks import Block, Heading, SideBySide, Table, Text
from stiction.report.figures import limit_cycles as figures
from stiction.report.labels import count_noun, format_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.limitcycle import LimitCycle
    from stiction.limitcycle.study import CycleStudy
    from stiction.models import Loop

__all__ = ["cycle_table", "limit_cycle_blocks"]

COLUMNS = (
    "Kind", "Family", "Stable", "Period [s]", "OP amplitude [%]", "PV amplitude", "Exact period [s]", "Exact OP [%]",
    "Exact PV", "Trust",
)  # fmt: skip
BOUNDARY = "A boundary separates oscillations that grow from oscillations that shrink."
FAMILIES = (
    "A stem that only rests and jumps returns to the same rest levels in each cycle. The families half and integer are "
    "symmetric about the steady state. With another set point or load the levels lie between these two, with another "
    "period and amplitude; in a simulation they drift slowly, faster for a longer dt."
)


def limit_cycle_blocks(
    loop: Loop,
    cycles: Sequence[LimitCycle],
    study: CycleStudy | None = None,
    settings: Mapping[str, str] | None = None,
    *,
    sp: float = 0.0,
    disturbance: float = 0.0,
    over: str = "gain",
) -> list[Block]:
    """Return what is shown of the result of `predict_limit_cycles`; figures of the exact cycles with a `study`."""
    if not cycles:
        return [Text(explain_no_cycle(loop), kind="lead"), *_settings(settings)]
    stable = sum(cycle.kind == "cycle" and bool(cycle.stable) for cycle in cycles)
    number = count_noun(stable, "stable limit cycle") if stable else "no stable limit cycle"
    blocks: list[Block] = [Text(f"The loop has {number}.", kind="lead"), cycle_table(cycles)]
    blocks += [Heading("Where they come from"), figures.nyquist_plot(loop, cycles, sp=sp, disturbance=disturbance)]
    if study is not None:
        blocks += [Heading("The exact cycles"), figures.time_plot(study), figures.phase_portrait(study)]
        blocks += [Heading("What moves the loop between them")]
        blocks += [SideBySide([figures.basin_plot(study), figures.bifurcation_plot(study, over)])]
    return [*blocks, *_settings(settings)]


def cycle_table(cycles: Sequence[LimitCycle]) -> Table:
    """Return the table of the cycles, with the exact cycle beside each prediction."""
    notes = [BOUNDARY] if any(cycle.kind == "boundary" for cycle in cycles) else []
    notes += [FAMILIES] if any(cycle.family for cycle in cycles) else []
    return Table(COLUMNS, [_row(cycle) for cycle in cycles], " ".join(notes))


def _row(cycle: LimitCycle) -> list[str]:
    exact = cycle.exact or (cycle if cycle.method == "continuous" else None)
    numbers = [format_number(x, significant=4) for x in (cycle.period, cycle.amplitude, cycle.amplitude_pv)]
    if exact is not None:
        numbers.append(format_number(exact.period, significant=5))
        numbers += [format_number(x, significant=4) for x in (exact.amplitude, exact.amplitude_pv)]
    stable = {True: "stable", False: "unstable", None: "unknown"}[cycle.stable]
    return [cycle.kind, cycle.family or "-", stable, *numbers, *("",) * (6 - len(numbers)), cycle.trust]


def _settings(settings: Mapping[str, str] | None) -> list[Block]:
    if not settings:
        return []
    return [Heading("Where this comes from"), Table(["Setting", "Value"], [list(pair) for pair in settings.items()])]

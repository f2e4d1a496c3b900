"""HTML page of ``stiction limit-cycles``: table, Nyquist plot, cycles in time, phase portrait, basins, bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.apps import limit_cycle_figures as figures
from stiction.apps.limit_cycle_table import COLUMNS, FAMILIES, cycle_row
from stiction.limitcycle.predict import explain_no_cycle
from stiction.report import Block, Heading, SideBySide, Table, Text, write_page

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stiction.limitcycle import LimitCycle
    from stiction.models import Loop

__all__ = ["write_limit_cycles_page"]


def write_limit_cycles_page(
    loop: Loop,
    found: Sequence[LimitCycle],
    path: Path,
    texts: Mapping[str, str],
    *,
    sp: float,
    disturbance: float,
    over: str,
) -> Path:
    """Write the page for the result of `predict_limit_cycles`."""
    stable = [cycle for cycle in found if cycle.kind == "cycle" and cycle.stable]
    number = {0: "no stable limit cycle", 1: "one stable limit cycle"}.get(
        len(stable), f"{len(stable)} stable limit cycles"
    )
    blocks: list[Block] = [Text(f"The loop has {number}." if found else explain_no_cycle(loop), kind="lead")]
    if found:
        caption = "A boundary separates oscillations that grow from oscillations that shrink."
        if any(cycle.family for cycle in found):
            caption += f" {FAMILIES}"
        blocks.append(Table(COLUMNS, [cycle_row(cycle) for cycle in found], caption))
        blocks += [Heading("Where they come from"), figures.nyquist_plot(loop, found, sp=sp, disturbance=disturbance)]
    exact = figures.exact_cycles(found)
    if exact:
        runs = [figures.simulate_two_periods(loop, cycle, sp=sp, disturbance=disturbance) for cycle in exact]
        blocks += [Heading("The exact cycles"), figures.time_plot(exact, runs), figures.phase_portrait(exact, runs)]
        blocks += [Heading("What moves the loop between them")]
        basins = figures.basin_plot(loop, exact, disturbance=disturbance)
        blocks.append(SideBySide([basins, figures.bifurcation_plot(loop, over, exact)]))
    settings = [*texts.items(), ("sp", f"{sp:g}"), ("disturbance", f"{disturbance:g}")]
    blocks += [Heading("Where this comes from"), Table(["Setting", "Value"], [list(pair) for pair in settings])]
    return write_page("Limit cycles", blocks, path, subtitle=", ".join(texts.values()))

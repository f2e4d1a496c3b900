"""Roles by the data, when no name helps: OP is the column that a PI controller computes from another one."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.loop_roles import HOW_TO_OVERRULE, list_roles
from stiction.sources.values.bad_values import find_sentinels
from stiction.sources.values.numeric_cells import parse_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.sources.table import TagColumn

__all__ = ["find_roles_by_data"]

MIN_ROWS = 50
"""Rows that are needed [-]."""


def unexplained_by_pi(op: NDArray[np.float64], pv: NDArray[np.float64], sp: NDArray[np.float64] | None = None) -> float:
    """Share of the variance of OP's moves that a PI controller of PV leaves unexplained [-].

    With the error of the same sample or the one before, whichever explains more; 1 when OP does not move.
    """
    error = pv if sp is None else pv - sp
    least = 1.0
    for late in (0, 1):
        moves, e = np.diff(op)[late:], error[: len(error) - late]
        rows = np.isfinite(moves) & np.isfinite(e[1:]) & np.isfinite(e[:-1])
        variance = float(np.var(moves[rows])) if rows.sum() >= MIN_ROWS else 0.0
        if variance > 0.0:
            terms = np.column_stack([np.diff(e)[rows], e[1:][rows], np.ones(rows.sum())])
            left = moves[rows] - terms @ np.linalg.lstsq(terms, moves[rows], rcond=None)[0]
            least = min(least, float(np.mean(left**2)) / variance)
    return least


def find_roles_by_data(
    columns: Sequence[TagColumn], known: dict[str, TagColumn], *, max_unexplained: float = 0.05, min_ratio: float = 4.0
) -> tuple[dict[str, TagColumn], str]:
    """Find PV, OP and SP among columns without a role, and give a note; empty without a clear choice.

    A PI controller leaves at most `max_unexplained` of OP's moves [-], and `min_ratio` times as much with others [-].
    """
    if not 0 < len(columns) <= 8 or {"pv", "op"} <= known.keys():
        return {}, ""
    values = {id(c): x for c in (*columns, *known.values()) if (x := _numbers(c)) is not None}
    free = [c for c in columns if id(c) in values]
    steps = [c for c in free if _is_step_like(values[id(c)])]
    moving = [c for c in free if c not in steps]
    pvs, ops = ([known[role]] if role in known else moving for role in ("pv", "op"))
    set_points = [known["sp"]] if "sp" in known else [None, *steps]
    scored = [
        (unexplained_by_pi(values[id(op)], values[id(pv)], values.get(id(sp))), pv, op, sp)
        for pv, op, sp in itertools.product(pvs, ops, set_points)
        if pv is not op and len({len(values.get(id(c), ())) for c in (pv, op, sp) if c is not None}) == 1
    ]
    if not scored:
        return {}, ""
    least, pv, op, sp = min(scored, key=lambda choice: choice[0])
    others = [share for share, *pair, _ in scored if pair != [pv, op]]
    if least > max_unexplained or min(others, default=1.0) < min_ratio * max(least, 1e-9):
        return {}, ""
    low, high = np.nanmin(values[id(pv)]), np.nanmax(values[id(pv)])
    inside = [c for c in steps if low <= np.nanmin(values[id(c)]) and np.nanmax(values[id(c)]) <= high]
    sp = sp or (inside[0] if len(inside) == 1 else None)
    roles = {role: c for role, c in (("pv", pv), ("op", op), ("sp", sp)) if c is not None and role not in known}
    listed = list_roles(roles)
    explained = f"a PI controller explains {100.0 * (1.0 - least):.0f} % of the moves of OP"
    return roles, f"{listed}, by the data: {explained}; {HOW_TO_OVERRULE}"


def _numbers(column: TagColumn) -> NDArray[np.float64] | None:
    """First rows of a column as numbers; None when most are none, or when they only count up."""
    x = parse_numbers(column.cells.head(20_000), column.table.decimal).values
    x = np.where(find_sentinels(x), np.nan, x)
    known = x[np.isfinite(x)]
    return None if known.size < max(MIN_ROWS, 0.5 * x.size) or (np.diff(known) > 0.0).all() else x


def _is_step_like(x: NDArray[np.float64]) -> bool:
    """Whether a signal rests nearly all the time, as a set point does."""
    known = x[np.isfinite(x)]
    return bool(np.count_nonzero(np.diff(known)) <= 0.02 * known.size)

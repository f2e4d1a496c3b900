"""Roles by the data, when no name helps: OP is the column that a PI controller computes from another one."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.roles.loop_roles import HOW_TO_OVERRULE, column_label

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.sources.tag_column import TagColumn

__all__ = ["explained_by_pi", "find_roles_by_data"]

MAX_COLUMNS = 8
"""Columns without a role up to which their data are compared [-]."""
MAX_ROWS = 20_000
"""Rows that are compared [-]."""
MIN_ROWS = 50
"""Rows that are needed [-]."""


def explained_by_pi(op: NDArray[np.float64], pv: NDArray[np.float64], sp: NDArray[np.float64] | None = None) -> float:
    """Give the share of the variance of OP's moves that a PI controller of PV explains.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        The two signals [any unit]; NaN is missing.
    sp : ndarray, shape (n_samples,), optional
        Set point [unit of the PV]; a constant one when left out.

    Returns
    -------
    float
        Coefficient of determination of ``dOP = a de + b e + c``, with the error e of the same or of the sample before,
        whichever is larger [-]; 0 when OP does not move.

    Examples
    --------
    >>> pv = np.random.default_rng(1).normal(size=400)
    >>> op = 2.0 * pv + 0.1 * np.cumsum(pv)
    >>> round(explained_by_pi(op, pv), 3), explained_by_pi(pv, op) < 0.9
    (1.0, True)
    """
    error = pv if sp is None else pv - sp
    best = 0.0
    for late in (0, 1):
        moves, e = np.diff(op)[late:], error[: len(error) - late]
        rows = np.isfinite(moves) & np.isfinite(e[1:]) & np.isfinite(e[:-1])
        variance = float(np.var(moves[rows])) if rows.sum() >= MIN_ROWS else 0.0
        if variance > 0.0:
            terms = np.column_stack([np.diff(e)[rows], e[1:][rows], np.ones(rows.sum())])
            left = moves[rows] - terms @ np.linalg.lstsq(terms, moves[rows], rcond=None)[0]
            best = max(best, 1.0 - float(np.mean(left**2)) / variance)
    return best


def find_roles_by_data(
    columns: Sequence[TagColumn], known: dict[str, TagColumn], *, min_explained: float = 0.9, min_lead: float = 0.1
) -> tuple[dict[str, TagColumn], str]:
    """Find PV, OP and SP among columns whose names say nothing.

    Parameters
    ----------
    columns : sequence of TagColumn
        Columns without a role.
    known : dict
        Role -> column, as far as names gave it.
    min_explained : float
        Smallest share of the moves of OP that a PI controller of the PV must explain [-].
    min_lead : float
        Smallest distance of that share to the one of any other choice [-].

    Returns
    -------
    roles : dict
        Role -> column of those found; empty when no choice is clearly better than all others.
    note : str
        What was guessed and how to overrule it.
    """
    if not columns or len(columns) > MAX_COLUMNS or {"pv", "op"} <= known.keys():
        return {}, ""
    values = {id(c): x for c in (*columns, *known.values()) if (x := _numbers(c)) is not None}
    free = [c for c in columns if id(c) in values]
    steps = [c for c in free if _is_step_like(values[id(c)])]
    moving = [c for c in free if c not in steps]
    pvs, ops = ([known[role]] if role in known else moving for role in ("pv", "op"))
    scored = []
    for pv, op in itertools.product(pvs, ops):
        if pv is op or not {id(pv), id(op)} <= values.keys() or len(values[id(pv)]) != len(values[id(op)]):
            continue
        for sp in [known["sp"]] if "sp" in known else [None, *steps]:
            x = values.get(id(sp)) if sp is not None else None
            if sp is None or (x is not None and len(x) == len(values[id(pv)])):
                scored.append((explained_by_pi(values[id(op)], values[id(pv)], x), pv, op, sp))
    if not scored:
        return {}, ""
    share, pv, op, sp = max(scored, key=lambda choice: choice[0])
    second = max((s for s, a, b, _ in scored if (a, b) != (pv, op)), default=0.0)
    if share < min_explained or share - second < min_lead:
        return {}, ""
    beside = [c for c in steps if _is_within(values[id(c)], values[id(pv)])]
    sp = sp or (beside[0] if len(beside) == 1 else None)
    roles = {"pv": pv, "op": op} | ({"sp": sp} if sp is not None else {})
    roles = {role: column for role, column in roles.items() if role not in known}
    listed = ", ".join(f"{column_label(column)} = {role.upper()}" for role, column in roles.items())
    return roles, (
        f"{listed}, by the data: a PI controller explains {100 * share:.0f} % of the OP's moves; {HOW_TO_OVERRULE}"
    )


def _numbers(column: TagColumn) -> NDArray[np.float64] | None:
    """First rows of a column as numbers; None when most are none, or when they only count up."""
    from stiction.sources.values.numeric_cells import parse_numbers

    x = parse_numbers(column.cells.head(MAX_ROWS), column.table.decimal).values
    known = x[np.isfinite(x)]
    if known.size < max(MIN_ROWS, 0.5 * x.size) or (np.diff(known) > 0.0).all():
        return None
    return x


def _is_step_like(x: NDArray[np.float64]) -> bool:
    """Whether a signal rests nearly all the time, as a set point does."""
    known = x[np.isfinite(x)]
    return np.count_nonzero(np.diff(known)) <= 0.02 * known.size


def _is_within(x: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether the values of one signal lie inside the range of another."""
    return bool(np.nanmin(other) <= np.nanmin(x) and np.nanmax(x) <= np.nanmax(other))

r"""The paper's valve with three parameters (sb, sj, r).

The paper left the identification of its eq. 5 open. Here it is the repaired eq. 5 that is fitted, see the errata. It
contains Kano's valve, with :math:`sb = (S + J) / 2`, :math:`sj = J` and r = 0, and Stenman's, with r infinite.

r matters only where a moving stem sees OP go on in the same direction: at :math:`|\Delta u| / \Delta t \ge r` it
follows, below it rests. It is therefore tried at the rates that OP had, and its interval ends at such rates. Where
every move of OP is followed, or none, an end is zero or infinity.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import combinations, evaluated, halved_steps, joined, pattern_search
from stiction.diagnosis.identification.model_fit import fit_kano, fit_stenman, likely_candidates, model_fit
from stiction.models.component import TIE_TOLERANCE, ValveState
from stiction.models.numba_compile import kernel
from stiction.models.valves.srinivasan import srinivasan_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates
    from stiction.diagnosis.identification.model_fit import ModelFit, PositionCosts

__all__ = ["fit_three_parameter", "op_moves", "rate_interval", "three_parameter_positions"]


@kernel
def fill_positions(op, per_block, sb, lag, slow, start, out):
    """Fill `out` (n_valves, n_blocks) with mean positions of eq. 5 repaired; `lag` is sb - sj, `slow` r per sample."""
    for v in range(out.shape[0]):
        s = ValveState(op[0] + start[v] * sb[v], op[0], op[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for k in range(out.shape[1]):
            total = 0.0
            for i in range(k * per_block, (k + 1) * per_block):
                s = srinivasan_step(op[i], s, sb[v] * (1.0 + TIE_TOLERANCE), lag[v], slow[v] * (1.0 - TIE_TOLERANCE))
                total += s.position
            out[v, k] = total / per_block


def three_parameter_positions(
    op: NDArray[np.float64], per_block: int, rows: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Simulate valves of eq. 5 repaired over OP.

    A row is S = 2 sb - sj [% of span], sj / S [-], r [% of span per sample] and the first position from OP [half
    bands]. The positions are means over `per_block` samples of OP, shape (n_valves, n_blocks) [% of span].

    Examples
    --------
    >>> op = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    >>> three_parameter_positions(op, 1, np.array([[3.0, 1.0 / 3.0, 0.5, 0.0]])).round(9).tolist()
    [[0.0, 0.0, 0.0, 2.0, 3.0]]
    """
    S, ratio, slow, start = (np.ascontiguousarray(column) for column in rows.T)
    sb = 0.5 * S * (1.0 + ratio)
    out = np.empty((len(rows), op.size // per_block))
    fill_positions(np.ascontiguousarray(op), per_block, sb, sb - S * ratio, slow, start, out)
    return out


def op_moves(op: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sizes of the moves of OP that go on in one direction, with 0 and infinity, increasing [% of span per sample].

    Examples
    --------
    >>> op_moves(np.array([1.0, 2.0, 4.0, 3.0, 2.5])).tolist()
    [0.0, 0.5, 2.0, inf]
    """
    moves = np.diff(op)
    goes_on = moves[1:] * moves[:-1] > 0.0
    return np.unique(np.concatenate([[0.0], np.abs(moves[1:][goes_on]), [np.inf]]))


def fit_three_parameter(costs: PositionCosts, nested: tuple[ModelFit, ...] = ()) -> ModelFit:
    """Fit sb, sj and r: rows of (S = 2 sb - sj, sj / S, r, start); r is one of `op_moves` [% of span per sample].

    `nested` are the fits of Kano's and of Stenman's valve, where they were made already. Source: srinivasan2008, eq. 5;
    after srinivasan2005, a search over the nonlinear block around a linear one.
    """
    kano, stenman = nested or (fit_kano(costs), fit_stenman(costs))
    moves, swing = op_moves(costs.op), float(np.ptp(costs.op))

    def evaluate(rows: NDArray[np.float64]) -> Candidates:
        return evaluated(
            rows, lambda some: costs.cost_of_positions(three_parameter_positions(costs.op, costs.per_block, some))
        )

    tried = moves[np.unique(np.linspace(0.0, moves.size - 1.0, 14).round().astype(int))]
    starts = np.concatenate([kano.found.local_minima(6, 0.03, 0.15), stenman.found.local_minima(3, 0.03, 0.15)])
    rows = np.repeat(starts, tried.size, axis=0)
    rows[:, 2] = np.tile(tried, len(starts))
    S, ratio = np.geomspace(0.1 * swing, swing, 40), np.array([0.15, 0.35, 0.55, 0.75, 0.95])
    found = joined(evaluate(rows), evaluate(combinations(S, ratio, tried[::2], np.linspace(-0.75, 0.75, 4))))
    found = joined(found, evaluate(np.array([[*kano.best[:2], 0.0, kano.best[3]]])))
    found = joined(found, evaluate(np.array([[*stenman.best[:2], np.inf, stenman.best[3]]])))
    for step in STEPS:
        found = pattern_search(evaluate, found, (step,), swing, diagonal=True)
        near = found.local_minima(step[3], 0.5 * step[0], step[1])
        found = joined(found, evaluate(_other_rates(near, moves, step[1])))
    found = joined(found, evaluate(_around(found, moves)))
    return model_fit(costs, found, three_parameter_positions(costs.op, costs.per_block, np.array([found.best]))[0])


STEPS = halved_steps(0.03, 0.12, 0.2, 40)
"""Pattern searches: steps in ln S, in J / S and in the start, and candidates refined [-]; the step of J / S is also
that of r, as a share of all moves of OP."""


def _other_rates(rows: NDArray[np.float64], moves: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Rows with r some moves up and down."""
    step = max(round(share * moves.size), 1)
    place = np.searchsorted(moves, rows[:, 2])
    out = []
    for other in (-2 * step, -step, step, 2 * step):
        changed = rows.copy()
        changed[:, 2] = moves[np.clip(place + other, 0, moves.size - 1)]
        out.append(changed)
    return np.unique(np.concatenate(out), axis=0)


def _around(found: Candidates, moves: NDArray[np.float64]) -> NDArray[np.float64]:
    """A lattice about the best valve, from which the intervals are read."""
    S, ratio, r, start = found.best
    up = np.array([0.003, 0.01, 0.03, 0.08])
    offsets = np.concatenate([-up[::-1], [0.0], up])
    ratios = np.unique(np.clip(ratio + np.array([-0.4, -0.15, -0.05, 0.0, 0.05, 0.15, 0.4]), 0.0, 1.0))
    places = np.searchsorted(moves, r) + np.round(moves.size * np.array([-0.5, -0.1, -0.02, 0.0, 0.02, 0.1, 0.5]))
    rates = moves[np.unique(np.clip(places, 0, moves.size - 1)).astype(int)]
    return combinations(S * (1.0 + offsets), ratios, np.union1d(rates, moves[[0, -1]]), np.array([start]))


def rate_interval(fit: ModelFit, moves: NDArray[np.float64]) -> tuple[float, float]:
    """Interval of r, from the next smaller to the next larger move of OP that is not likely [% of span per sample].

    It is wider by a fiftieth of the moves tried (`op_moves`) at least; 0 and infinity where no r is excluded.
    """
    likely, rates = likely_candidates(fit.found.cost, fit.share), fit.found.valves[:, 2]
    low, high = rates[likely].min(), rates[likely].max()
    places = int(np.ceil(moves.size / 50))
    smaller, larger = rates[rates < low], rates[rates > high]
    first = moves[max(int(np.searchsorted(moves, low)) - places, 0)]
    last = moves[min(int(np.searchsorted(moves, high)) + places, moves.size - 1)]
    return (
        min(float(first), float(smaller.max()) if smaller.size else 0.0),
        max(float(last), float(larger.min()) if larger.size else float(high)),
    )

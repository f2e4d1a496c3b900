"""Valleys of a likelihood: which of the valves tried are the best of their kind, and what lies about them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import Trial
from stiction.diagnosis.identification.prediction import LANES
from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Trials

__all__ = ["one_each", "surroundings", "valleys_of"]

# What half and twice of each does is counted in docs/verdict-measured.md, "What each constant of the search brings".
FORGOTTEN = 0.1
"""Step over the place from which on that of a stem that goes on is left alone: after the first slip it is forgotten."""
EVERY_J, FEW = np.linspace(0.0, 1.0, 13), 2
"""J / S tried again about so many of the best valleys [-]."""
S_BIN, J_BIN = 0.02, 0.03
"""Width of the bins over ln S and over J / S of the best, from each of which the most likely valve is compared [-]."""


def one_each(trials: Trials) -> NDArray[np.int64]:
    """The most likely valve of each S and of each J.

    Parameters
    ----------
    trials : Trials
        Valves tried.

    Returns
    -------
    ndarray
        Their places among the trials, the most likely of all first.
    """
    order = trials.ranked()
    S, ratio = trials.columns.S[order], trials.columns.ratio[order]
    bins = np.round(np.log(S / S[0]) / S_BIN).astype(int), np.round(S * ratio / (J_BIN * S[0])).astype(int)
    first = np.concatenate([np.unique(one, return_index=True)[1] for one in bins])
    return order[np.unique(first)]


def valleys_of(tried: Trials, S_step: float, J_step: float, keep: int) -> list[Trial]:
    """The most likely valves, each more than a step and a half away from the better ones.

    Parameters
    ----------
    tried : Trials
        Valves tried.
    S_step, J_step : float
        Steps over S, as a share of it, and over J / S [-].
    keep : int
        How many are kept at most.

    Returns
    -------
    list of Trial
        The valleys, the most likely first.
    """
    return [Trial(*valve) for valve in _rows(tried, S_step, J_step, keep).tolist()]


def surroundings(
    tried: Trials, S_step: float, J_step: float, place_step: float, keep: int, most: float
) -> NDArray[np.float64]:
    """Valves a step about the best valleys.

    Parameters
    ----------
    tried : Trials
        Valves tried.
    S_step, J_step, place_step : float
        Steps over S, as a share of it, over J / S and over the place [-].
    keep : int
        How many valleys are followed at most.
    most : float
        Largest S [% of span].

    Returns
    -------
    ndarray, shape (n, 5)
        Valves as in `Trials`, along every J of the best valleys as well.
    """
    best = _rows(tried, S_step, J_step, keep)
    out = np.empty((33 * len(best) + 3 * EVERY_J.size * FEW, len(Trial._fields)))
    return out[: beside(best, S_step, J_step, place_step, most, FEW, out)]


def _rows(tried: Trials, S_step: float, J_step: float, keep: int) -> NDArray[np.float64]:
    """The valleys as rows of `Trials.valve`."""
    chosen, order = np.empty(keep, dtype=np.int64), tried.ranked()[: 32 * LANES]
    count = apart(tried.valve, order, 1.5 * S_step, 1.5 * J_step, np.empty((keep, 2)), chosen)
    return tried.valve[chosen[:count]]


@kernel
def beside(valleys, S_step, J_step, place_step, most, few, out):
    """Fill `out` (n, 5) with the valves about `valleys` (n_valleys, 5), and along the first `few` of them; how many.

    About is a step either way in S, J / S and place, none twice; a stem that goes on keeps its place once steps are
    fine. So does one that rests in K, by the step of the place, where it goes beyond its balance at all. Along is every
    J: it is a wide valley along the narrow one of S, since it moves the size of a slip, S its time. No S is larger than
    `most`.
    """
    count = 0
    for v in range(valleys.shape[0]):
        S, ratio, K, place, lag = valleys[v, 0], valleys[v, 1], valleys[v, 2], valleys[v, 3], valleys[v, 4]
        moves = K > 0.0 or place_step > FORGOTTEN
        for a in (-1.0, 0.0, 1.0):
            before = -1.0
            for b in (-1.0, 0.0, 1.0):
                J = min(max(ratio + J_step * b, 0.0), 1.0)
                for c in (-1.0, 0.0, 1.0):
                    if before < J and (moves or c == 0.0):
                        out[count, 0], out[count, 1], out[count, 2] = min(S * (1.0 + S_step * a), most), J, K
                        out[count, 3] = min(max(place + place_step * c, -1.0), 1.0) if moves else place
                        out[count, 4] = lag
                        count += 1
                before = J
        if K > 1.0:
            for more in (-1.0, 1.0):
                for a in (-1.0, 0.0, 1.0):
                    out[count, 0], out[count, 1] = min(S * (1.0 + S_step * a), most), ratio
                    out[count, 2] = min(max(K + place_step * more, 1.0), 2.0)
                    out[count, 3], out[count, 4] = place, lag
                    count += 1
    for v in range(min(few, valleys.shape[0])):
        for a in (-1.0, 0.0, 1.0):
            for J in EVERY_J:
                for column in range(2, 5):
                    out[count, column] = valleys[v, column]
                out[count, 0], out[count, 1] = min(valleys[v, 0] * (1.0 + S_step * a), most), J
                count += 1
    return count


@kernel
def apart(valve, order, S_away, J_away, place, chosen):
    """Fill `chosen` with the first of `order` whose `valve` (n, 5) is none that came before; how many.

    It is another one beyond `S_away` in ln S or `J_away` in J / S, or by its rule or lag. `place` (n_chosen, 2) is work
    space.
    """
    count = 0
    for i in order:
        S, J, alone = np.log(valve[i, 0]) / S_away, valve[i, 1] / J_away, True
        for c in range(count):
            k = chosen[c]
            alike = valve[i, 2] == valve[k, 2] and valve[i, 4] == valve[k, 4]
            if alike and abs(S - place[c, 0]) <= 1.0 and abs(J - place[c, 1]) <= 1.0:
                alone = False
                break
        if alone:
            chosen[count], place[count, 0], place[count, 1] = i, S, J
            count += 1
            if count == chosen.shape[0]:
                break
    return count

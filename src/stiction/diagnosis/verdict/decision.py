"""From the probability of stiction to a verdict: what each call costs when it is wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.errors import require_not_negative

if TYPE_CHECKING:
    from stiction.diagnosis.result import Verdict

__all__ = ["DEFAULT_PRIOR", "DEFAULT_SMALLEST_S", "Costs", "decide", "shift_prior"]

DEFAULT_PRIOR = 0.25
"""Share of sticky valves assumed where none is given [-]."""

DEFAULT_SMALLEST_S = 1.0
"""Smallest S that matters where none is given [% of span]."""


@dataclass(frozen=True, slots=True)
class Costs:
    """What a call costs, in any unit.

    Raises
    ------
    ParameterError
        When a cost is negative or no finite number.
    """

    false_alarm: float = 1.0
    """Of `stiction` when the valve is good: a needless overhaul."""
    missed: float = 1.0
    """Of `no_stiction` when the valve sticks: the loop keeps oscillating."""
    ask: float = 0.3
    """Of `undecided`: a valve test or another record."""

    def __post_init__(self) -> None:
        for name in ("false_alarm", "missed", "ask"):
            object.__setattr__(self, name, require_not_negative(name, getattr(self, name)))


def decide(probability: float, costs: Costs = Costs(), *, excluded: bool = True) -> Verdict:
    """Choose the call with the smallest expected cost.

    Parameters
    ----------
    probability : float
        Probability that the valve sticks [-].
    costs : Costs
        What each call costs when it is wrong.
    excluded : bool
        Whether a valve whose stiction matters would have shown; else nothing is called good.

    Returns
    -------
    str
        `stiction`, `no_stiction`, or `undecided` where asking costs less than either call is expected to, or where
        stiction would not have shown.

    Examples
    --------
    >>> [decide(p) for p in (0.1, 0.5, 0.9)]
    ['no_stiction', 'undecided', 'stiction']
    """
    expected: dict[Verdict, float] = {
        "stiction": (1.0 - probability) * costs.false_alarm,
        "no_stiction": probability * costs.missed,
    }
    best = min(expected, key=lambda call: expected[call])
    if expected[best] > costs.ask or (best == "no_stiction" and not excluded):
        return "undecided"
    return best


def shift_prior(probability: float, prior: float, new: float = DEFAULT_PRIOR) -> float:
    """Return the probability that the same evidence gives with another prior, by Bayes' rule [-].

    Examples
    --------
    >>> round(shift_prior(0.1, 0.01), 3), shift_prior(0.7, 0.25), shift_prior(1.0, 0.01)
    (0.786, 0.7, 1.0)
    """
    sticky, good = probability * new / prior, (1.0 - probability) * (1.0 - new) / (1.0 - prior)
    return sticky / (sticky + good)

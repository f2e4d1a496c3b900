"""What makes a loop oscillate: seven causes, each by a trained model of its own, and what the record could show."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.diagnosis.identification.loop_response import S_GRID
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR, shift_prior
from stiction.diagnosis.verdict.model import TreeModel, read_model, read_stored
from stiction.display.json_form import FOUR_DECIMALS, Result

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.loop_response import LoopResponse

__all__ = [
    "CAUSES",
    "OscillationCause",
    "assess_causes",
    "cause_models",
    "closest_alternative",
    "find_detectable_S",
    "is_position",
    "is_stuck",
    "smallest_shown",
]

CAUSES = ("valve", "tuning", "external", "set_point", "rate_limit", "dead_zone", "sensor")
"""Causes of an oscillation, in the order of the JSON."""
STICKY_TOO = ("beside_periodic_load", "deadband")
"""Compared as well, but with stiction: a load beside both valves, and a sticky valve without slip jump."""


@dataclass(frozen=True, slots=True)
class OscillationCause(Result):
    """Probability of each cause, 0 to 1, independent of one another; all small means none."""

    _json_keys = CAUSES

    valve: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """The valve sticks or has play, and that drives the loop."""
    tuning: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """The controller gain is near the limit of stability, or above it."""
    external: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """A periodic or switching load from outside."""
    set_point: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """The set point moves, and the loop follows it."""
    rate_limit: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """OP moves at a limit of its rate, too slow for the loop."""
    dead_zone: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """A range of OP, at fixed values, in which PV does not respond, as in split range."""
    sensor: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """The transmitter: coarse steps, spikes or noise that the controller follows."""
    seen: float = 1.0
    """Probability that a stem that does not move would have been seen; not among the causes."""

    @property
    def main(self) -> str:
        """The first of the named causes; "none" where there is none."""
        return self.named[0] if self.named else "none"

    @property
    def named(self) -> tuple[str, ...]:
        """All causes that are probable enough to be named, the most probable first, a load from outside last.

        A load from outside is named only where the stem is probably seen too: the inside must be excluded.
        """
        known = {name: getattr(self, name) for name in CAUSES} | {"external": self.external * self.seen}
        found = [name for name, probability in known.items() if probability >= cause_models().named]
        return tuple(sorted(found, key=lambda name: (name == "external", -getattr(self, name))))

    @property
    def any(self) -> float:
        """Probability that at least one of the causes is there, as of independent ones [-]."""
        return 1.0 - math.prod(1.0 - getattr(self, name) for name in CAUSES)


class CauseModels(NamedTuple):
    """The trained models."""

    causes: dict[str, TreeModel]
    """One for each of `CAUSES`."""
    unseen: TreeModel
    """Of a valve that sticks or is stuck, whether or not the verdict shows it."""
    stuck: TreeModel
    """Of a stem that is stuck while something else moves PV."""
    position: TreeModel
    """Of an OP that is the position of the stem and not what the controller asks for."""
    named: float
    """Probability from which a cause is named [-]."""
    unseen_limit: float
    """Its probability above which stiction of any size may be there without being seen [-]."""
    position_limit: float
    """Probability above which OP may be the position of a valve that sticks [-]."""
    min_evidence: float
    """Predicted evidence from which 90 % of the sticky valves are not called good [-]."""


@cache
def cause_models() -> CauseModels:
    """Read the trained models of the causes."""
    stored: dict[str, Any] = read_stored("causes.json")
    models = {name: read_model(one) for name, one in stored["models"].items()}
    unseen, stuck, position = (models.pop(name) for name in ("unseen", "stuck", "position"))
    return CauseModels(
        models, unseen, stuck, position, stored["named"], stored["unseen_limit"], stored["position_limit"],
        stored["min_evidence"],
    )  # fmt: skip


def assess_causes(features: Mapping[str, float], prior: float = DEFAULT_PRIOR) -> OscillationCause:
    """Judge each cause by itself, from feature -> value; `prior` is the share of sticky valves where it comes from."""
    models = cause_models()
    found = {name: one.probability(features, one.training_prior) for name, one in models.causes.items()}
    found["valve"] = shift_prior(found["valve"], DEFAULT_PRIOR, prior)
    return OscillationCause(**found, seen=1.0 - models.unseen.probability(features, models.unseen.training_prior))


def is_stuck(features: Mapping[str, float], causes: OscillationCause) -> bool:
    """Whether the stem is probably stuck while something else moves PV, which OP does not move.

    A stem that does not move makes no loop oscillate: the valve must be the less probable cause of the oscillation.
    """
    models = cause_models()
    return models.stuck.probability(features, models.stuck.training_prior) >= max(models.named, causes.valve)


def is_position(features: Mapping[str, float], causes: OscillationCause) -> bool:
    """Whether OP is the position of the stem and not what the controller asks for.

    At a limit of OP or of its rate no controller explains OP either: neither cause may be probable.
    """
    models = cause_models()
    probability = models.position.probability(features, models.position.training_prior)
    return max(causes.rate_limit, causes.tuning) < models.named <= probability


def find_detectable_S(features: Mapping[str, float], response: LoopResponse) -> float | None:
    """Find the smallest S for which 90 % of such records would not be called `no_stiction` [% of span].

    None where no S would show, as where the stem may not have moved. The evidence of each S is predicted from the
    movement of OP, the process and the noise (`response`). It counts only where the trained models leave little room
    for a valve that OP does not move, and for an OP that is the position of a sticky valve.
    """
    models = cause_models()
    limits = ((models.unseen, models.unseen_limit), (models.position, models.position_limit))
    hidden = any(model.probability(features, model.training_prior) > limit for model, limit in limits)
    return None if response.evidence is None or hidden else smallest_shown(response.evidence, models.min_evidence)


def smallest_shown(evidence: NDArray[np.float64], needed: float) -> float | None:
    """Find the smallest S [% of span] with `needed` evidence, of that of each S of `S_GRID`; None without."""
    enough = np.flatnonzero(evidence >= needed)
    if enough.size == 0:
        return None
    i = int(enough[0])
    near = slice(max(i - 1, 0), i + 1)
    return round(float(np.exp(np.interp(needed, evidence[near], np.log(S_GRID[near])))), 3)


def closest_alternative(likelihood_ratios: Mapping[str, float]) -> tuple[str, float] | None:
    """Return the closest explanation without stiction, and twice the log likelihood ratio of the sticky valve over it.

    Examples
    --------
    >>> closest_alternative({"good": 310.0, "deadband": 12.0, "relay_load": 45.0})
    ('relay_load', 45.0)
    """
    found = {k: ratio for k, ratio in likelihood_ratios.items() if k not in STICKY_TOO and math.isfinite(ratio)}
    return min(found.items(), key=lambda item: item[1]) if found else None

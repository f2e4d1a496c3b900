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

    from stiction.diagnosis.identification.loop_response import LoopResponse

__all__ = ["CAUSES", "NAMED", "OscillationCause", "assess_causes", "closest_alternative", "find_detectable_S"]

CAUSES = ("valve", "tuning", "external", "set_point", "rate_limit", "dead_zone", "sensor")
"""Causes of an oscillation, in the order of the JSON."""
NAMED = 0.5
"""Probability from which a cause is named [-]."""
STICKY_TOO = ("beside_periodic_load", "deadband")
"""Compared as well, but with stiction: a load beside both valves, and a sticky valve without slip jump."""


@dataclass(frozen=True, slots=True)
class OscillationCause(Result):
    """Probability of each cause, 0 to 1, independent of one another; all small means none."""

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

    @property
    def main(self) -> str:
        """The most probable cause from `NAMED` on; "none" where there is none."""
        name = max(CAUSES, key=lambda one: getattr(self, one))
        return name if getattr(self, name) >= NAMED else "none"

    @property
    def named(self) -> tuple[str, ...]:
        """All causes from `NAMED` on, the most probable first."""
        found = [name for name in CAUSES if getattr(self, name) >= NAMED]
        return tuple(sorted(found, key=lambda name: -getattr(self, name)))


class CauseModels(NamedTuple):
    """The trained models."""

    causes: dict[str, TreeModel]
    """One for each of `CAUSES`."""
    unseen: TreeModel
    """Of a valve that sticks or is stuck, whether or not the verdict shows it."""
    unseen_limit: float
    """Its probability above which stiction of any size may be there without being seen [-]."""
    min_evidence: float
    """Twice the log likelihood ratio from which 90 % of sticky valves are not called good [-]."""


@cache
def cause_models() -> CauseModels:
    """Read the trained models of the causes."""
    stored: dict[str, Any] = read_stored("causes.json")
    models = {name: read_model(one) for name, one in stored["models"].items()}
    unseen = models.pop("unseen")
    return CauseModels(models, unseen, stored["unseen_limit"], stored["min_evidence"])


def assess_causes(features: Mapping[str, float], prior: float = DEFAULT_PRIOR) -> OscillationCause:
    """Judge each cause by itself.

    Parameters
    ----------
    features : mapping
        Feature -> value (`cause_features.CAUSE_FEATURES`).
    prior : float
        Share of sticky valves where the record comes from [-].

    Returns
    -------
    OscillationCause
        Probabilities.
    """
    models = cause_models().causes
    found = {name: one.probability(features, one.training_prior) for name, one in models.items()}
    return OscillationCause(**(found | {"valve": shift_prior(found["valve"], DEFAULT_PRIOR, prior)}))


def find_detectable_S(features: Mapping[str, float], response: LoopResponse) -> float | None:
    """Find the smallest S that a record would have shown.

    Parameters
    ----------
    features : mapping
        Feature -> value (`cause_features.CAUSE_FEATURES`).
    response : LoopResponse
        The linear predictions of PV, with the evidence foretold of each S.

    Returns
    -------
    float or None
        The smallest S for which 90 % of such records would not be called `no_stiction` [% of span]; None where no S
        would show, as where the stem may not have moved.

    Notes
    -----
    The evidence of each S is foretold from the movement of OP, the process and the noise. It counts only where the
    trained model of an unseen valve, which asks whether OP moves PV at all, leaves little room for one.
    """
    models = cause_models()
    evidence = response.evidence
    if evidence is None or models.unseen.probability(features, models.unseen.training_prior) > models.unseen_limit:
        return None
    enough = np.flatnonzero(evidence >= models.min_evidence)
    if enough.size == 0:
        return None
    i = int(enough[0])
    near = slice(max(i - 1, 0), i + 1)
    return round(float(np.exp(np.interp(models.min_evidence, evidence[near], np.log(S_GRID[near])))), 3)


def closest_alternative(likelihood_ratios: Mapping[str, float]) -> tuple[str, float] | None:
    """Return the closest explanation without stiction, and twice the log likelihood ratio of the sticky valve over it.

    Examples
    --------
    >>> closest_alternative({"good": 310.0, "deadband": 12.0, "relay_load": 45.0})
    ('relay_load', 45.0)
    """
    found = {k: ratio for k, ratio in likelihood_ratios.items() if k not in STICKY_TOO and math.isfinite(ratio)}
    return min(found.items(), key=lambda item: item[1]) if found else None

"""What makes a loop oscillate: five causes, each judged by itself from what was identified."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from stiction.diagnosis.verdict.features import sensitivity
from stiction.diagnosis.verdict.model import logistic
from stiction.display.json_form import FOUR_DECIMALS, Result

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.identification.dead_zone import DeadZone
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.result import Oscillation

__all__ = ["CAUSES", "STICKY_TOO", "OscillationCause", "assess_causes", "closest_alternative", "tuning_score"]

CAUSES = ("valve", "tuning", "external", "sensor", "dead_zone")
"""Causes of an oscillation, in the order of the JSON."""
STICKY_TOO = ("beside_periodic_load", "deadband")
"""Compared as well, but with stiction: a load beside both valves, and a sticky valve without slip jump."""


@dataclass(frozen=True, slots=True)
class OscillationCause(Result):
    """How much speaks for each cause, 0 to 1, independent of one another; all small means none."""

    valve: float = field(metadata=FOUR_DECIMALS)
    """The valve sticks, and its stick and slip drive the loop."""
    tuning: float = field(metadata=FOUR_DECIMALS)
    """The controller gain is near the limit of stability."""
    external: float = field(metadata=FOUR_DECIMALS)
    """A periodic or switching load from outside."""
    sensor: float = field(metadata=FOUR_DECIMALS)
    """The transmitter: coarse steps, spikes or noise that the controller follows."""
    dead_zone: float = field(metadata=FOUR_DECIMALS)
    """A range of OP, at fixed values, in which PV does not respond, as in split range."""

    @property
    def main(self) -> str:
        """The strongest cause from 0.5 on; "none" where there is none."""
        name = max(CAUSES, key=lambda one: getattr(self, one))
        return name if getattr(self, name) >= 0.5 else "none"


def assess_causes(
    identification: Identification,
    controller: ControllerFit,
    oscillation: Oscillation,
    probability: float,
    *,
    pv_step_share: float,
    spike_share: float,
    min_evidence: float = 20.0,
    min_relay_evidence: float = 60.0,
    min_sticky_evidence: float = 60.0,
    sticky_sensitivity: float = 3.0,
    good_sensitivity: float = 2.0,
) -> OscillationCause:
    """Judge each cause by itself.

    Parameters
    ----------
    identification : Identification
        Stiction and process.
    controller : ControllerFit
        The controller.
    oscillation : Oscillation
        The oscillation.
    probability : float
        Probability that the valve sticks [-].
    pv_step_share : float
        Quantisation step of the PV over its range [-].
    spike_share : float
        Share of the samples in which the PV jumps away and back [-].
    min_evidence : float
        Twice the log likelihood ratio at which a periodic load counts half [-].
    min_relay_evidence : float
        The same of a load that switches, which a loop near the limit of stability resembles [-].
    min_sticky_evidence : float
        Twice the log likelihood ratio of the sticky valve over the closest other explanation at which the sticky valve
        counts at least half, however small its prior probability [-].
    sticky_sensitivity, good_sensitivity : float
        Sensitivity at the oscillation at which tuning counts half [-]. That of a sticky valve is larger: its
        oscillation takes a frequency at which the loop is sensitive, however it is tuned.

    Returns
    -------
    OscillationCause
        Scores from 0 to 1.

    Notes
    -----
    Where nothing oscillates, valve, tuning and load score 0: a sticky valve that nothing moves drives no oscillation.
    The score of a load compares a valve with the load and without it, a good and a sticky one, weighted by the
    probability of each. A valve that the record shows to stick counts as sticky for the load and the tuning even where
    a small prior makes its probability small: the prior is no evidence of another cause. The sensitivity is that of the
    process fitted with a good valve as far as the valve is good. It counts less where a load explains the oscillation:
    OP then follows PV through the controller C, the identified process looks like -1 / C, and the loop like an unstable
    one. A PV of few values stands still as over a dead zone, which then counts less.
    """
    active = 1.0 if oscillation.oscillating else 0.0
    ratios = identification.likelihood_ratios
    closest = closest_alternative(ratios)
    shown = 0.0 if closest is None else logistic((closest[1] - min_sticky_evidence) / 4.0)
    sticks = max(probability, shown)
    good = ratios.get("good", 0.0)
    periodic, relay = (ratios.get(name, math.inf) for name in ("periodic_load", "relay_load"))
    beside_good = max(good - periodic - min_evidence, good - relay - min_relay_evidence)
    beside_sticky = ratios.get("beside_periodic_load", -math.inf) - periodic - min_evidence
    load = (1.0 - sticks) * logistic(beside_good / 4.0) + sticks * logistic(beside_sticky / 4.0)
    zone = identification.dead_zone
    sensor = max(logistic((pv_step_share - 0.25) / 0.05), logistic((spike_share - 0.02) / 0.005))
    dead_zone = 0.0 if zone is None else (1.0 - sensor) * dead_zone_score(zone, good, periodic)
    sticky, linear = (
        tuning_score(sensitivity(replace(identification, process=process), controller, oscillation.period), critical=at)
        for process, at in ((identification.process, sticky_sensitivity), (identification.linear, good_sensitivity))
    )
    tuning = (sticks * sticky + (1.0 - sticks) * linear) * (1.0 - load)
    others = max(sticks * active, tuning, sensor, dead_zone)
    return OscillationCause(
        valve=probability * active,
        tuning=tuning * active,
        external=max(load, 1.0 - others) * active,
        sensor=sensor,
        dead_zone=dead_zone,
    )


def closest_alternative(likelihood_ratios: Mapping[str, float]) -> tuple[str, float] | None:
    """Return the closest explanation without stiction, and twice the log likelihood ratio of the sticky valve over it.

    Examples
    --------
    >>> closest_alternative({"good": 310.0, "deadband": 12.0, "relay_load": 45.0})
    ('relay_load', 45.0)
    """
    found = {k: ratio for k, ratio in likelihood_ratios.items() if k not in STICKY_TOO and math.isfinite(ratio)}
    return min(found.items(), key=lambda item: item[1]) if found else None


def tuning_score(sensitivity: float, *, critical: float = 2.0, width: float = 0.3) -> float:
    """How much the sensitivity of the loop at its oscillation speaks for tight tuning, 0 to 1.

    Parameters
    ----------
    sensitivity : float
        Sensitivity at the frequency of the oscillation [-]; NaN when unknown.
    critical : float
        Sensitivity that counts half [-]; well tuned loops have at most 2 at any frequency (Skogestad 2003: 1.6).
    width : float
        Width of the transition in ln(sensitivity) [-].

    Returns
    -------
    float
        Score [-]; 0 when the sensitivity is unknown.

    Examples
    --------
    >>> round(tuning_score(1.0), 2), round(tuning_score(2.0), 2), round(tuning_score(20.0), 2)
    (0.09, 0.5, 1.0)
    """
    return logistic(math.log(sensitivity / critical) / width) if sensitivity > 0.0 else 0.0


def dead_zone_score(
    zone: DeadZone,
    good: float,
    load: float,
    *,
    min_evidence: float = 70.0,
    min_evidence_once: float = 16.0,
    max_advantage: float = 10.0,
    max_load_advantage: float = 0.0,
    width: float = 4.0,
) -> float:
    """How much speaks for a dead zone at fixed values of OP, 0 to 1.

    Parameters
    ----------
    zone : DeadZone
        The most likely dead zone.
    good : float
        Twice the log likelihood ratio of the sticky valve over a good one [-].
    load : float
        The same over a periodic load [-]; infinite where none was searched for.
    min_evidence : float
        Twice the log likelihood ratio of the dead zone over a good valve that counts half [-].
    min_evidence_once : float
        The same where OP crosses its range only once or twice; there it may be that of the sticky valve too.
    max_advantage : float
        Twice the log likelihood ratio of the sticky valve over the dead zone at which the zone counts half [-]; not
        asked where OP crosses its range only once or twice, since the two then look the same.
    max_load_advantage : float
        Twice the log likelihood ratio of the load over the dead zone at which the zone counts half [-].
    width : float
        Width of the transitions [-].

    Returns
    -------
    float
        Score [-].
    """
    gain, advantage = zone.likelihood_ratio, good - zone.likelihood_ratio
    if zone.crossed_rarely:
        gain, min_evidence, advantage, max_advantage = max(gain, good), min_evidence_once, 0.0, math.inf
    score = logistic((gain - min_evidence) / width) * logistic((max_advantage - advantage) / width)
    return score * logistic((max_load_advantage - advantage + load) / width)

"""The answer to the main question about one loop."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stiction.diagnosis.loop_state import describe_action, describe_state
from stiction.diagnosis.verdict.causes import OscillationCause, closest_alternative
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR, DEFAULT_SMALLEST_S, Costs
from stiction.diagnosis.verdict.explanation import explain_action, explain_reason
from stiction.diagnosis.verdict.finding import explain_next_step, find_code, grade, manual_time, plan_valve_test
from stiction.diagnosis.verdict.model import log_odds, stiction_model
from stiction.display.json_form import FOUR_DECIMALS, fields_to_json
from stiction.display.number_format import format_number, format_probability
from stiction.display.result_display import ResultDisplay

if TYPE_CHECKING:
    from stiction.diagnosis.identification.loop_response import LoopResponse
    from stiction.diagnosis.identification.result import ControllerFit, Identification
    from stiction.diagnosis.loop_state import LoopState
    from stiction.diagnosis.result import Evidence, Oscillation, Verdict
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.diagnosis.verdict.finding import Finding
    from stiction.diagnosis.verdict.history import Change, Window
    from stiction.diagnosis.verdict.model import Contribution
    from stiction.records.assess import Quality
    from stiction.records.record import LoopRecord
    from stiction.simulation.valve_test_plan import TestPlan

__all__ = ["Diagnosis"]


@dataclass(frozen=True, slots=True)
class Diagnosis(ResultDisplay, kind="verdict"):
    """Whether the valve of a loop sticks, how much, how sure that is, and what to do.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> found = st.diagnose(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow"))
    >>> isinstance(found, st.Diagnosis), found.verdict
    (True, 'stiction')
    """

    _json_keys = (
        "record.provenance.source as file", "record.tag as tag", "verdict", "probability", "prior", "reason", "action",
        "record.op_unit as op_unit", "record.dt as dt_s", "loop_state", "identification as stiction", "controller",
        "oscillation", "oscillation_cause", "finding", "next_step", "valve_test", "S_detectable",
        "average_log_odds", "contributions as features", "windows", "history", "windows_needed", "evidence", "quality",
    )  # fmt: skip

    segment: JudgedSegment = field(repr=False)
    """The part of the record that was judged, with loop state, oscillation and data checks."""
    verdict: Verdict
    """`stiction`, `no_stiction` or `undecided`."""
    probability: float = field(metadata=FOUR_DECIMALS)
    """Probability that the valve sticks [-]; the prior where the record cannot be judged."""
    oscillation_cause: OscillationCause = field(default_factory=OscillationCause)
    """What makes the loop oscillate; all 0 where the record cannot be judged."""
    stuck: bool = False
    """Whether the stem is probably stuck while something else moves PV."""
    op_is_position: bool = False
    """Whether the recorded OP is probably the position of the stem and not what the controller asks for."""
    evidence: tuple[Evidence, ...] = ()
    """What each published method says."""
    identification: Identification | None = None
    """Stiction and process found; None when the record did not allow a search."""
    controller: ControllerFit | None = None
    """The controller found; None when the record did not allow a fit."""
    features: dict[str, float] = field(default_factory=dict)
    """The features from which the probability was computed [-]; empty where the record cannot be judged."""
    contributions: tuple[Contribution, ...] = ()
    """What each feature adds to the log odds of stiction, the strongest first."""
    prior: float = DEFAULT_PRIOR
    """Share of sticky valves assumed before the record is looked at [-]."""
    S_detectable: float | None = None
    """Smallest S for which 90 % of such records would not be called `no_stiction` [% of span]; None where none would
    show."""
    smallest_S: float = DEFAULT_SMALLEST_S
    """Smallest S that matters [% of span]."""
    cause_features: dict[str, float] = field(default_factory=dict, repr=False)
    """The features from which the causes were computed [-]; empty where the record cannot be judged."""
    response: LoopResponse | None = field(default=None, repr=False)
    """What a linear prediction of PV says of the loop; None where the record cannot be judged."""
    costs: Costs = field(default_factory=Costs)
    """Costs of a wrong call."""
    windows: tuple[Window, ...] = ()
    """The windows of the loop, each judged by itself, in the order of time. With more than one, probability, S and J
    are pooled over those since the last change, and the segment is that of one window."""
    history: tuple[Change, ...] = ()
    """When the fault began, grew or was repaired."""
    windows_needed: int | None = None
    """Further windows like these after which there would be a verdict [-]; 0 where there is one, None where more of the
    same will not decide."""
    settings: dict[str, Any] = field(default_factory=dict)
    """What a caller adds."""

    @property
    def record(self) -> LoopRecord:
        """The record, outliers missing; `quality.first` and `quality.last` bound the part that was judged."""
        return self.segment.record

    @property
    def shows_size(self) -> bool:
        """Whether stiction or play is found, so that S is its size and not only that of the best fit."""
        return self.verdict == "stiction" or self.finding == "backlash"

    @property
    def S(self) -> float:
        """Deadband plus stickband [% of span]; NaN where neither stiction nor play is found."""
        return self.identification.S if self.shows_size and self.identification is not None else float("nan")

    @property
    def J(self) -> float:
        """Slip jump [% of span]; NaN where neither stiction nor play is found."""
        return self.identification.J if self.shows_size and self.identification is not None else float("nan")

    def __repr__(self) -> str:
        """Tag, finding, probability and size in one line."""
        size = f", S = {format_number(self.S, self.record.op_unit_short, 2)}" if self.shows_size else ""
        chance = format_probability(self.probability)
        return f"<Diagnosis {self.record.tag}: {self.finding}, probability of stiction {chance}{size}>"

    @property
    def loop_state(self) -> LoopState:
        """Whether the controller moves the valve and the process answers; else nothing is said about the valve."""
        return self.segment.loop_state

    @property
    def oscillation(self) -> Oscillation:
        """Whether and how the loop oscillates."""
        return self.segment.oscillation

    @property
    def quality(self) -> Quality:
        """The data checks."""
        return self.segment.quality

    @property
    def finding(self) -> Finding:
        """What is said first, as a code."""
        return find_code(self)

    @property
    def next_step(self) -> str:
        """The cheapest test that decides what is open, with its size and duration; empty where nothing is open."""
        return explain_next_step(self)

    @property
    def valve_test(self) -> TestPlan | None:
        """The test of the next step, where it moves OP: the same in next step, work list and work order."""
        return plan_valve_test(self)

    @property
    def manual_time(self) -> float:
        """Time in manual that the next step needs [s]; NaN where it needs none."""
        return manual_time(self)

    @property
    def grade(self) -> str:
        """Word for verdict and probability, one of five."""
        return grade(self.verdict, self.probability)

    @property
    def reason(self) -> str:
        """Why, in some sentences."""
        return explain_reason(self)

    @property
    def action(self) -> str:
        """What to do, in a sentence or two."""
        return explain_action(self)

    @property
    def cause(self) -> str:
        """The main cause of the oscillation: one of `OscillationCause`, or "none"."""
        return self.oscillation_cause.main

    @property
    def average_log_odds(self) -> float:
        """Log odds that the average of all training loops adds to those of the prior [-].

        The log odds of the prior, this and the contributions add up to the log odds of the probability.
        """
        model = stiction_model()
        return model.intercept - log_odds(model.training_prior)

    @property
    def zone_is_unclear(self) -> bool:
        """Whether a dead zone is found that OP crosses too few times to tell it from a sticky valve."""
        zone = None if self.identification is None else self.identification.dead_zone
        return zone is not None and zone.crossed_rarely and self.oscillation_cause.dead_zone >= 0.5

    @property
    def strongest_alternative(self) -> tuple[str, float] | None:
        """The closest explanation without stiction, and twice the log likelihood ratio of the sticky valve over it."""
        return None if self.identification is None else closest_alternative(self.identification.likelihood_ratios)

    def summary(self) -> str:
        """The verdict in a sentence or two."""
        return (
            f"{self.record.tag}: {self.verdict} (probability {format_probability(self.probability)}). {self.reason} "
            f"{self.action}"
        )

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form, as `stiction diagnose --json` prints it."""
        found = fields_to_json(self, series=series)
        why = describe_state(self.loop_state, self.record.start, self.record.provenance.pv_unit)
        found["loop_state"] |= {"why": why, "action": describe_action(self.loop_state)}
        if not self.loop_state.in_control:
            found["stiction"] = None
        elif self.identification is not None:
            found["stiction"]["kind"] = "backlash" if self.identification.is_play else "stiction"
        found["average_log_odds"] = round(self.average_log_odds, 4) if self.contributions else None
        return found

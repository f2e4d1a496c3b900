"""The row of one loop in an audit: made here alone; ledger, frames, workbook, JSON and pages are views of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import timedelta
from typing import TYPE_CHECKING, Any

from stiction.display.duration_format import format_duration
from stiction.display.finding_words import FINDINGS, can_wait
from stiction.display.json_form import Result, to_json
from stiction.display.number_format import format_interval, format_number, format_probability
from stiction.fleet.loop_oscillations import LoopOscillation

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis
    from stiction.diagnosis.loop_state.state import StateName
    from stiction.diagnosis.result import Verdict
    from stiction.fleet.loop_metrics import LoopMetrics
    from stiction.fleet.source_parts import LoopPlace
    from stiction.records.record import LoopRecord

__all__ = ["FAILED", "NAMES", "RESTING_STATES", "LoopRow"]

FAILED = ("error", "timeout", "crashed")
"""Status of loops that could not be done."""
SIZED = ("sticks", "probably_sticks", "backlash")
"""Findings of which S is the size."""
RESTING_STATES = ("manual", "saturated", "shut_in", "pv_frozen", "bad_data")
"""Loop states in which neither valve nor tuning can be judged."""


def _of(path: str) -> dict[str, str]:
    """Metadata of a field that is read from a source: place, record, metrics, diagnosis, oscillation or valve.

    The oscillation is there where the loop oscillates; the valve, where it is not called good or has play.
    """
    return {"path": path}


@dataclass(frozen=True, eq=False, slots=True)
class LoopRow(Result, Mapping[str, Any]):
    """What an audit says of one loop; unknown numbers are None. A mapping too: its keys are those of the JSON.

    Examples
    --------
    >>> row = LoopRow("FIC-101", S=2.5)
    >>> row.S, row["S"], "verdict" in row
    (2.5, 2.5, True)
    """

    tag: str = field(default="", metadata=_of("place.tag"))
    """Tag of the loop, unique in the audit."""
    area: str = field(default="", metadata=_of("place.area"))
    """Area of the plant."""
    finding_text: str = ""
    """The finding in words; of a follower with the source that it oscillates with."""
    next_step: str = field(default="", metadata=_of("diagnosis.next_step"))
    """What to do next, in a sentence or two."""
    test_time_s: float | None = field(default=None, metadata=_of("diagnosis.manual_time"))
    """Time in manual that the next step needs [s]."""
    test_size: float | None = field(default=None, metadata=_of("diagnosis.valve_test.upset"))
    """Largest move of OP from its usual value in that test [% of span]."""
    finding: str | None = field(default=None, metadata=_of("diagnosis.finding"))
    """Code of what is said first of the loop, such as `sticks`, `tuning`, `follows` or `cannot_tell`."""
    source: str = field(default="", metadata=_of("place.part.display_name"))
    """File or database."""
    status: str = "screened"
    """`diagnosed`; `skipped`: nothing can be said of the valve; `screened`: not diagnosed yet; or one of `FAILED`."""
    verdict: Verdict = field(default="undecided", metadata=_of("diagnosis.verdict"))
    """`stiction`, `no_stiction` or `undecided`."""
    probability: float | None = field(default=None, metadata=_of("diagnosis.probability"))
    """Probability that the valve sticks [-]."""
    S_detectable: float | None = field(default=None, metadata=_of("diagnosis.S_detectable"))
    """Smallest S that the record would have shown [% of span]; None where no S would."""
    windows: int | None = None
    """Windows of the loop that were judged and pooled, those of earlier runs too [-]."""
    windows_left_out: int = 0
    """Windows of earlier runs that other models judged and that the source no longer holds [-]."""
    history: tuple[dict[str, Any], ...] = ()
    """When the fault began, grew or was repaired, as in the JSON of a diagnosis."""
    loop_state: StateName | None = field(default=None, metadata=_of("diagnosis.loop_state.state"))
    """State of the loop."""
    oscillation_cause: str = field(default="none", metadata=_of("diagnosis.cause"))
    """The main cause of the oscillation, or "none"."""
    oscillation_causes: dict[str, float] | None = field(default=None, metadata=_of("diagnosis.oscillation_cause"))
    """How much speaks for each cause [-]."""
    period_s: float | None = field(default=None, metadata=_of("oscillation.period"))
    """Period [s]."""
    S: float | None = field(default=None, metadata=_of("valve.S"))
    """Deadband plus stickband [`op_unit`]."""
    S_low: float | None = field(default=None, metadata=_of("valve.S_low"))
    """Lower end of the 95 % interval of S [`op_unit`]."""
    S_high: float | None = field(default=None, metadata=_of("valve.S_high"))
    """Upper end of the 95 % interval of S [`op_unit`]."""
    J: float | None = field(default=None, metadata=_of("valve.J"))
    """Slip jump [`op_unit`]."""
    J_low: float | None = field(default=None, metadata=_of("valve.J_low"))
    """Lower end of the 95 % interval of J [`op_unit`]."""
    J_high: float | None = field(default=None, metadata=_of("valve.J_high"))
    """Upper end of the 95 % interval of J [`op_unit`]."""
    op_unit: str = field(default="% of span", metadata=_of("diagnosis.record.op_unit"))
    """Unit of OP, S and J."""
    priority: float = 0.0
    """Severity times confidence times importance, of the loop and the loops that follow it [-]."""
    priority_reason: str = ""
    """The priority in words: what the fault costs, how sure it is, how many loops follow."""
    severity: float = field(default=0.0, metadata=_of("metrics.severity"))
    """How bad the loop is, from 0 to 1 [-]."""
    confidence: float = 0.0
    """Probability that the loop itself has a fault [-]."""
    importance: float = field(default=1.0, metadata=_of("place.importance"))
    """Weight that the plant gives the loop [-]."""
    severity_parts: dict[str, float] = field(default_factory=dict, metadata=_of("metrics.severity_parts"))
    """Part of the severity -> its size from 0 to 1 [-]."""
    reason: str = field(default="", metadata=_of("diagnosis.reason"))
    """Why, in some sentences; of a failure what went wrong."""
    action: str = field(default="", metadata=_of("diagnosis.action"))
    """What to do."""
    oscillating: bool = field(default=False, metadata=_of("diagnosis.oscillation.oscillating"))
    """Whether the loop oscillates."""
    regularity: float | None = field(default=None, metadata=_of("oscillation.regularity"))
    """Thornhill's regularity r of the zero crossings [-]; above 1 is regular."""
    oscillation_index: float = field(default=0.0, metadata=_of("metrics.oscillation_index"))
    """Autocorrelation of the block means one period later, 0 where none is regular [-]."""
    automatic_share: float | None = field(default=None, metadata=_of("metrics.automatic_share"))
    """Time in automatic [-]."""
    manual_share: float | None = field(default=None, metadata=_of("metrics.manual_share"))
    """Time in manual [-]."""
    cascade_share: float | None = None
    """Time in which a secondary loop takes its set point from its primary [-]."""
    saturated_share: float | None = field(default=None, metadata=_of("metrics.saturated_share"))
    """Time with OP at a limit [-]."""
    not_in_command_share: float | None = None
    """Time in which the controller does not move the valve [-]."""
    missing_share: float | None = field(default=None, metadata=_of("metrics.missing_share"))
    """Time in which OP or PV is missing [-]."""
    error_mean_absolute: float | None = field(default=None, metadata=_of("metrics.error_mean_absolute"))
    """Mean absolute control error [% of span]."""
    variability: float | None = field(default=None, metadata=_of("metrics.variability"))
    """Standard deviation of the control error [% of span]."""
    valve_travel_per_day: float | None = field(default=None, metadata=_of("metrics.valve_travel_per_day"))
    """Path length of the valve [% of span per day]."""
    reversals_per_day: float | None = field(default=None, metadata=_of("metrics.reversals_per_day"))
    """Reversals of OP [1/day]."""
    loop_type: str | None = field(default=None, metadata=_of("record.loop_type"))
    """Flow, level, ..."""
    pv_unit: str = field(default="", metadata=_of("record.provenance.pv_unit"))
    """Unit of PV."""
    dt_s: float | None = field(default=None, metadata=_of("record.dt"))
    """Sampling period [s]."""
    samples: int | None = None
    """Samples in the audited time [-]."""
    start: str | None = field(default=None, metadata=_of("record.start"))
    """Time of the first sample, as ISO 8601."""
    end: str | None = None
    """End of the audited samples, as ISO 8601."""
    data_warnings: tuple[str, ...] = ()
    """Names of the data checks that fail."""
    oscillations: tuple[LoopOscillation, ...] = ()
    """Candidates for an oscillation, of the block means that groups are found from."""
    group: int | None = None
    """Number of its group."""
    follows: str | None = None
    """Tag of the likeliest source of the oscillation of its group, where that is another loop."""
    followers: int = 0
    """Loops that follow this one [-]."""

    def __getitem__(self, key: str) -> Any:
        """Value of a field by its name."""
        if key not in NAMES:
            raise KeyError(key)
        return getattr(self, key)

    def __iter__(self) -> Iterator[str]:
        """Names of the fields."""
        return iter(NAMES)

    def __len__(self) -> int:
        """Number of fields."""
        return len(NAMES)

    @property
    def failed(self) -> bool:
        """Whether the loop could not be done."""
        return self.status in FAILED

    @property
    def waits(self) -> bool:
        """Whether its open question can wait."""
        return self.group is None and can_wait(self.finding, oscillating=self.oscillating)

    @property
    def test(self) -> str:
        """Time in manual and size of the test that the next step names; empty where it names none.

        Examples
        --------
        >>> LoopRow("FIC-101", test_time_s=900.0, test_size=6.0).test.replace("\u00a0", " ")
        '15 min in manual, OP ±6 %'
        """
        if self.test_time_s is None or self.waits:
            return ""
        size = "" if self.test_size is None else f", OP ±{format_number(self.test_size, '%', 2)}"
        return f"{format_duration(self.test_time_s)} in manual{size}"

    @property
    def in_control(self) -> bool:
        """Whether the loop was diagnosed, and the controller moved its valve."""
        return self.status == "diagnosed" and self.loop_state == "in_control"

    def text(self, name: str) -> str:
        """Value of a field as every table shows it; empty where it is unknown or says nothing.

        S and J have the digits that their intervals allow, and their unit where it is not % of span; they are empty
        where neither stiction nor play is found.

        Examples
        --------
        >>> row = LoopRow("FIC-101", status="diagnosed", loop_state="in_control", probability=0.998, S=4.96)
        >>> row.text("probability"), row.text("S"), row.text("priority"), row.text("period_s")
        ('>0.99', '4.96', '0.00', '')
        """
        value = getattr(self, name)
        if value is None or (name == "probability" and not self.in_control):
            return ""
        if name in ("S", "J") and self.finding not in (*SIZED, None):
            return ""
        if name == "probability":
            return format_probability(value)
        if name in ("S", "J"):
            ends = (getattr(self, f"{name}_{end}") for end in ("low", "high"))
            text = format_interval(value, *(math.nan if end is None else end for end in ends))[0]
            return text if self.op_unit == "% of span" else f"{text} {self.op_unit}"
        if name == "period_s":
            return format_duration(value)
        if isinstance(value, float):
            return f"{value:.2f}" if name == "priority" else format_number(value)
        words = str(value).replace("_", " ")
        return words.replace("pv ", "PV ") if name == "loop_state" else words

    def with_record(self, record: LoopRecord, metrics: LoopMetrics, *, is_secondary: bool) -> LoopRow:
        """Add what is known before the diagnosis; a secondary loop takes its set point from another loop."""
        end = record.start and record.start + timedelta(seconds=record.duration)
        cascade = float(record.auto.mean()) if is_secondary and record.auto is not None else None
        row = self._read_from(record=record, metrics=metrics)
        return replace(row, samples=len(record), end=end and end.isoformat(), cascade_share=cascade)

    def with_diagnosis(self, diagnosis: Diagnosis) -> LoopRow:
        """Add the diagnosis."""
        from stiction.diagnosis.loop_state import HEADLINES
        from stiction.diagnosis.verdict.finding import NOTHING_NOW

        state, quality, valve = diagnosis.loop_state, diagnosis.quality, diagnosis.identification
        known = diagnosis.oscillation if diagnosis.oscillation.oscillating else None
        has_size = state.in_control and (diagnosis.verdict != "no_stiction" or diagnosis.finding == "backlash")
        sized = valve if has_size else None
        said = HEADLINES[state.state] if not state.in_control else FINDINGS[diagnosis.finding]
        waits = can_wait(diagnosis.finding, oscillating=diagnosis.oscillation.oscillating)
        step = diagnosis.reason if state.state == "bad_data" else diagnosis.next_step or diagnosis.action
        lost = sum(one.end_s - one.start_s for one in state.stretches if one.state == "not_in_command")
        return replace(
            self._read_from(diagnosis=diagnosis, oscillation=known, valve=sized),
            finding_text=said,
            next_step=NOTHING_NOW if waits else step or "Nothing to do now.",
            status="skipped" if state.state in RESTING_STATES else "diagnosed",
            not_in_command_share=min(1.0, lost / max(diagnosis.record.duration, 1e-9)),
            data_warnings=tuple(check.name for check in (*quality.rejections, *quality.warnings)),
            windows=len(diagnosis.windows) or None,
            history=tuple(one.to_dict() for one in diagnosis.history),
        )

    @classmethod
    def of_place(cls, place: LoopPlace, **known: Any) -> LoopRow:
        """Row of a loop of which nothing is known yet, but for some fields."""
        return replace(cls()._read_from(place=place), **known)

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> LoopRow:
        """Row from its JSON-ready form."""
        known = {name: value for name, value in stored.items() if name in NAMES}
        oscillations = tuple(LoopOscillation(**one) for one in known.get("oscillations", ()))
        warnings = tuple(known.get("data_warnings", ()))
        history = tuple(known.get("history", ()))
        return cls(**known | {"oscillations": oscillations, "data_warnings": warnings, "history": history})

    def _read_from(self, **sources: object) -> LoopRow:
        """Read the fields that come from some sources; a source that is None leaves them unknown."""
        known = {name: _value(sources[source], path) for name, source, path in PATHS if source in sources}
        return replace(self, **known)


def _value(thing: Any, path: list[str]) -> Any:
    for name in path:
        thing = None if thing is None else getattr(thing, name)
    return to_json(thing)


NAMES = tuple(one.name for one in fields(LoopRow))
"""Names of the fields of a row."""
PATHS = tuple(
    (one.name, source, path) for one in fields(LoopRow) for source, *path in [one.metadata.get("path", "").split(".")]
)
"""Name, source and attributes of each field that is read from a source."""

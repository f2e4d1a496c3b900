"""Work order for the valve shop, one page: findings, parts to check, tests, interim remedy, signatures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.prediction_text import format_settings, prediction_text
from stiction.compensation.shop_tests import acceptance_criteria, plan_acceptance_test, plan_staircase
from stiction.compensation.suspect_parts import SuspectPart, rank_suspects
from stiction.diagnosis import Diagnosis
from stiction.display.duration_format import format_seconds, format_time
from stiction.display.json_form import Result
from stiction.display.number_format import format_interval, format_probability
from stiction.errors import ParameterError, require_kind
from stiction.simulation.confirming_tests import plan_confirming_ramp

if TYPE_CHECKING:
    from stiction.compensation.result import CompensationTrial
    from stiction.diagnosis import Identification
    from stiction.simulation.valve_test_plan import TestPlan

__all__ = ["WorkOrder", "work_order"]

BLANK = "________"
MID_SPAN_PERCENT = 50.0
"""OP near which the tests are planned when OP is not recorded in % of span [% of span]."""
ASSUMED_S_PERCENT = 5.0
"""S for which the tests are planned when it was not identified, or is in another unit [% of span]."""
SIGN_OFF = ("Tests before, by / date", "Work done, by / date", "Tests after, by / date", "Compensation off, by / date")


@dataclass(frozen=True)
class WorkOrder(Result):
    """A work order; unknown facts are lines to fill in."""

    tag: str
    """Name of the loop."""
    title: str
    """What to do: repair, or test first."""
    record: str
    """The record from which the findings come."""
    verdict: str
    """`stiction` or `undecided`."""
    probability: float
    """Probability that the valve sticks [-]."""
    S: float
    """Deadband plus stickband [% of span]; NaN when not identified, or in another unit."""
    S_low: float
    """Lower end of the 95 % interval of S [% of span]."""
    S_high: float
    """Upper end of the 95 % interval of S [% of span]."""
    J: float
    """Slip jump [% of span]; NaN when not identified, or in another unit."""
    J_low: float
    """Lower end of the 95 % interval of J [% of span]."""
    J_high: float
    """Upper end of the 95 % interval of J [% of span]."""
    findings: tuple[str, ...]
    """Findings, one sentence each."""
    suspects: tuple[SuspectPart, ...]
    """Parts to check, the most likely first."""
    order_of_suspects: str
    """Reason for their order."""
    before: tuple[TestPlan, ...]
    """Tests that confirm the stiction, first that of the diagnosis."""
    after: tuple[TestPlan, ...]
    """Acceptance tests of the repaired valve; they include a test from before the repair."""
    acceptance: tuple[str, ...]
    """Acceptance criteria."""
    meanwhile: tuple[str, ...]
    """The remedy until the repair, which must be removed afterwards."""
    to_fill_in: tuple[str, ...]
    """Facts that the record does not contain."""
    sign_off: tuple[str, ...] = SIGN_OFF
    """Signatures."""

    def summary(self) -> str:
        """Return the order in two lines."""
        return f"{self.title}\n{' '.join(self.findings[:2])}"

    @property
    def head(self) -> tuple[str, str]:
        """Record, and lines for number and date."""
        return f"Record: {self.record}.", f"Order no. {BLANK}  issued {BLANK}"

    @property
    def sections(self) -> dict[str, tuple[str, ...]]:
        """Heading of each section -> its lines; the parts to check are in their order."""
        return {
            "Findings": self.findings,
            "Parts to check": tuple(f"{s.part}. {s.sign} Check: {s.check} Found: {BLANK}" for s in self.suspects),
            "Test before the repair": _plan_lines(self.before),
            "Test after the repair": (*_plan_lines(self.after), *(f"Pass: {line}." for line in self.acceptance)),
            "Until the repair": self.meanwhile,
            "To fill in": tuple(f"{line}: {BLANK}" for line in self.to_fill_in),
            "Signatures": tuple(f"{line}: {BLANK}" for line in self.sign_off),
        }

    def to_text(self) -> str:
        """Return the page as Markdown."""
        body = [f"# {self.title}", "", *self.head]
        for name, lines in self.sections.items():
            body += ["", f"## {name}", ""]
            if name == "Parts to check":
                body += [self.order_of_suspects, "", *(f"{k}. {line}" for k, line in enumerate(lines, 1))]
            else:
                body += [f"- {line}" for line in lines]
        return "\n".join(body) + "\n"


def work_order(diagnosis: Diagnosis, trial: CompensationTrial | None = None) -> WorkOrder:
    """Write the work order for a valve that sticks, or may stick.

    Parameters
    ----------
    diagnosis : Diagnosis
        The verdict on its loop.
    trial : CompensationTrial, optional
        The result of `compensate`, for the remedy until the repair.

    Returns
    -------
    WorkOrder
        Findings, parts to check, tests before and after the repair, and the remedy until then; `to_text()` is the page.
        With an undecided verdict the order is to test, not to repair.

    Raises
    ------
    ParameterError
        When the verdict is no stiction, or `diagnosis` is not a Diagnosis.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0, op_start=50.0, tag="FIC-101", loop_type="flow")
    >>> st.work_order(st.diagnose(record)).title
    'Work order: control valve of FIC-101, repair'
    """
    require_kind("diagnosis", diagnosis, Diagnosis, "the result of st.diagnose(record)")
    verdict, found, percent = diagnosis.verdict, _identified_valve(diagnosis), diagnosis.record.op_in_percent
    if verdict == "no_stiction":
        raise ParameterError(
            f"{diagnosis.record.tag}: no work order, because the verdict is no stiction (probability of stiction "
            f"{format_probability(diagnosis.probability)}). {diagnosis.action}"
        )
    op = _usual_op(diagnosis)
    S = found.S if found and percent else math.inf
    first = diagnosis.valve_test or plan_confirming_ramp(op, found.S if found and percent else ASSUMED_S_PERCENT)
    stairs = plan_staircase(
        op, max(found.S, min(found.S_high, 2.0 * found.S)) if found and percent else ASSUMED_S_PERCENT
    )
    before = (first, stairs) if stairs else (first,)
    parts, why = rank_suspects(found, diagnosis.record.op_unit_short)
    nan = math.nan
    size = (found.S, found.S_low, found.S_high, found.J, found.J_low, found.J_high) if found and percent else (nan,) * 6
    ask = "test before any repair" if verdict == "undecided" else "repair"
    return WorkOrder(
        diagnosis.record.tag,
        f"Work order: control valve of {diagnosis.record.tag}, {ask}",
        _describe_record(diagnosis),
        verdict,
        diagnosis.probability,
        *size,
        findings=_findings(diagnosis, op),
        suspects=parts,
        order_of_suspects=why,
        before=before,
        after=(plan_acceptance_test(op, S), before[0]),
        acceptance=(
            *acceptance_criteria(S),
            "the verdict on a record with the loop in automatic, as long as 20 periods of the former oscillation, is "
            "no stiction",
        ),
        meanwhile=_meanwhile(trial),
        to_fill_in=_to_fill_in(diagnosis),
    )


def _identified_valve(diagnosis: Diagnosis) -> Identification | None:
    """Return the identified valve if it has an S."""
    found = diagnosis.identification
    return found if found is not None and found.S > 0.0 else None


def _usual_op(diagnosis: Diagnosis) -> float:
    """Return the median of OP in the judged part, or in the whole record [% of span]; mid span for another unit."""
    if not diagnosis.record.op_in_percent:
        return MID_SPAN_PERCENT
    op = diagnosis.segment.op
    return float(np.nanmedian(op if op.size else diagnosis.record.op))


def _describe_record(diagnosis: Diagnosis) -> str:
    record = diagnosis.record
    start = f"from {format_time(record.start)}" if record.start else f"date {BLANK}"
    length, every = format_seconds(record.duration), format_seconds(record.dt)
    return f"{record.provenance.source}, {start}, {length}, sampled every {every}"


def _findings(diagnosis: Diagnosis, op: float) -> tuple[str, ...]:
    record, found, cycle = diagnosis.record, _identified_valve(diagnosis), diagnosis.oscillation
    verdict = "the valve sticks" if diagnosis.verdict == "stiction" else "cannot tell"
    lines = [
        f"Verdict: {verdict}; probability of stiction {format_probability(diagnosis.probability)}.",
        diagnosis.reason,
    ]
    if found:
        S = _format_with_interval("S", found.S, found.S_low, found.S_high, record.op_unit)
        J = _format_with_interval("J", found.J, found.J_low, found.J_high, record.op_unit)
        lines += [
            f"At each reversal, OP travels {S} before the stem moves.",
            f"When the stem breaks loose, it jumps by {J}.",
        ]
        lines += [f"Limitation: {found.reason}"] if found.reason else []
    if cycle.oscillating and math.isfinite(cycle.period):
        day = 2.0 * 86400.0 / cycle.period
        lines.append(
            f"The loop oscillates with a period of {format_seconds(cycle.period)}: about {float(f'{day:.2g}'):.0f} "
            "reversals of the stem a day."
        )
    if record.op_in_percent:
        lines.append(f"Usual OP (controller output): {op:.0f} %.")
    else:
        low, high = np.nanmin(record.op), np.nanmax(record.op)
        lines.append(
            f"OP is recorded from {low:.3g} to {high:.3g}, not in % of span: S and J are in the unit of OP, and the "
            f"tests are planned near {op:.0f} %."
        )
    return tuple(lines)


def _format_with_interval(name: str, value: float, low: float, high: float, unit: str) -> str:
    at, least, most = format_interval(value, low, high)
    ends = f"95 % {least} to {most}" if math.isfinite(low) and math.isfinite(high) else "interval unknown"
    return f"{name} = {at} {unit} ({ends})"


def _to_fill_in(diagnosis: Diagnosis) -> tuple[str, ...]:
    lines = ["Make, type and size of valve, actuator, positioner", "Last service and what was done"]
    found = _identified_valve(diagnosis)
    if found and not diagnosis.record.op_in_percent:
        lines.append(f"OP at 0 % and at 100 % of span (the tests are planned for S up to {ASSUMED_S_PERCENT:g} %)")
    elif found:
        lines.append(f"Stroke in mm (S is {found.S / 100.0:.3g}, J {found.J / 100.0:.3g} of the stroke)")
    else:
        lines.append(
            f"S and J in % of span (not identified; the tests are planned for S up to {ASSUMED_S_PERCENT:g} %)"
        )
    if diagnosis.record.mv is None:
        lines.append("Where to read the valve position in the tests (it is not in the record)")
    lines.append("OP range and time that operations allow for the tests")
    return tuple(lines)


def _meanwhile(trial: CompensationTrial | None) -> tuple[str, ...]:
    service = f"Remedy in service now, since: {BLANK}"
    if trial is None:
        return ("No remedy was simulated.", service)
    if trial.recommended is None:
        return (f"No remedy is recommended. {trial.reason}", service)
    chosen = trial[trial.recommended]
    lines = [f"Recommended until the repair: {chosen.name}. {chosen.remedy.words}"]
    if not chosen.remedy.settings:
        return (*lines, trial.reason, service)
    lines += [
        f"Settings: {format_settings(chosen.remedy.settings)}.",
        f"Predicted by simulation: {prediction_text(trial)}.",
        "Switch it off before the tests, and remove it after the repair: ENABLE to FALSE, or back to "
        f"Kc {BLANK} Ti {BLANK}.",
    ]
    return (*lines, service)


def _plan_lines(plans: tuple[TestPlan, ...]) -> tuple[str, ...]:
    return tuple(" ".join(plan.summary().split("\n")[:2]) for plan in plans)

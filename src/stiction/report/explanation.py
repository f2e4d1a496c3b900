"""How a verdict was reached, step by step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.loop_state import HEADLINES, describe_state
from stiction.diagnosis.verdict.causes import CAUSES
from stiction.diagnosis.verdict.model import log_odds
from stiction.report import labels
from stiction.report.figures.contributions import feature_table
from stiction.report.figures.likelihood_ratios import RATIO_LABEL, finite_likelihood_ratios

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import ControllerFit, Identification, ProcessFit
    from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = ["ExplanationStep", "StepTable", "describe_controller", "describe_identification", "explanation_steps"]


class StepTable(NamedTuple):
    """A small table within a step."""

    columns: list[str]
    """Headings."""
    rows: list[list[str]]
    """Cells."""
    numbers: list[str]
    """Columns that hold numbers."""


class ExplanationStep(NamedTuple):
    """One step of the explanation."""

    title: str
    """The question."""
    lines: list[str]
    """The answer, one sentence per line."""
    table: StepTable | None = None
    """Its numbers."""


def explanation_steps(diagnosis: Diagnosis) -> list[ExplanationStep]:
    """Explain how a verdict was reached.

    Parameters
    ----------
    diagnosis : Diagnosis
        A verdict.

    Returns
    -------
    list of ExplanationStep
        The steps in order; a step that was not carried out is left out.
    """
    found, unit = diagnosis.identification, diagnosis.record.op_unit_short
    steps = [
        ExplanationStep("Are the data good enough?", diagnosis.quality.summary().splitlines()),
        ExplanationStep("Is the loop in control?", _state(diagnosis)),
        ExplanationStep("Does the loop oscillate?", _oscillation(diagnosis)),
    ]
    if diagnosis.controller is not None:
        steps.append(ExplanationStep("Which controller moves OP?", [describe_controller(diagnosis.controller, unit)]))
    if found is not None:
        parts = describe_identification(found, unit)
        sentences = [f"{name}: {text}" if name.startswith("Process") else text for name, text in parts]
        steps += [ExplanationStep("Which valve and process explain the PV?", sentences), _alternatives(found)]
    if diagnosis.contributions:
        steps.append(_probability(diagnosis))
    if diagnosis.loop_state.in_control:
        steps.append(_causes(diagnosis))
    if diagnosis.evidence:
        steps.append(_methods(diagnosis))
    verdict = f"{labels.headline(diagnosis)}. {labels.confidence_text(diagnosis)}."
    return [*steps, ExplanationStep("What is the verdict?", [verdict, diagnosis.reason, diagnosis.action])]


def _state(diagnosis: Diagnosis) -> list[str]:
    record, state = diagnosis.record, diagnosis.loop_state
    lines = [describe_state(state, record.start, record.provenance.pv_unit) or f"{HEADLINES['in_control']}."]
    if state.in_control:
        lines += [
            f"{HEADLINES[one.state]} from {labels.format_duration(one.start_s)} to {labels.format_duration(one.end_s)}."
            for one in state.stretches
        ]
    return lines


def _oscillation(diagnosis: Diagnosis) -> list[str]:
    found = diagnosis.oscillation
    lines = [found.reason] if found.reason else []
    if found.oscillating:
        pv = labels.format_number(found.amplitude_pv)
        op = labels.format_number(found.amplitude_op, diagnosis.record.op_unit_short)
        lines.append(
            f"Period {labels.format_duration(found.period)}, {labels.format_number(found.cycles)} cycles; "
            f"amplitude of PV {pv}, of OP {op}."
        )
    return lines + [
        f"A further oscillation of period {labels.format_duration(other.period)} carries {100.0 * other.share:.0f} % "
        "of the variance of the control error."
        for other in found.others
    ]


def describe_controller(found: ControllerFit, unit: str) -> str:
    """Return form, settings with standard errors and fit of the controller as a sentence; OP in `unit`."""
    if found.form == "unknown":
        return f"No form of controller explains OP. {found.why}"
    settings = [f"Kc {_with_error(found.Kc, found.Kc_error)} {unit} per PV unit"] if found.Kc else []
    if 0.0 < found.Ti < math.inf:
        settings.append(f"Ti {_with_error(found.Ti, found.Ti_error)} s")
    if not found.Kc:
        settings.append(f"Ki {labels.format_number(found.Ki)} {unit} per PV unit and s")
    if found.Td:
        settings.append(f"Td {labels.format_number(found.Td)} s")
    exact = "; the record shows every move of the controller" if found.exact else ""
    return f"{found.form} with {', '.join(settings)}: explains {100.0 * found.explained:.0f} % of OP{exact}."


def _with_error(value: float, error: float) -> str:
    text = labels.format_number(value)
    return f"{text} \u00b1 {labels.format_number(error, significant=1)}" if error > 1e-6 * abs(value) else text


def describe_identification(found: Identification, unit: str) -> list[tuple[str, str]]:
    """Return what was identified, each with its name and a sentence; OP in `unit`."""
    lines = [
        ("Valve", found.summary(unit)),
        ("Process with the sticky valve", f"{_process(found.process, unit)}."),
        ("Process with a good valve", f"{_process(found.linear, unit)}."),
    ]
    if math.isfinite(found.drift) and math.isfinite(found.drift_error):
        drift, error = (labels.format_number(x, significant=2) for x in (found.drift, found.drift_error))
        lines.append(("Drift of S", f"S changes by {drift} {unit} per hour (standard error {error})."))
    remarks = " ".join(text for text in (found.J_remark, found.reason) if text)
    return [*lines, ("Limits", remarks)] if remarks else lines


def _process(found: ProcessFit, unit: str) -> str:
    gain, of_op = labels.format_number(found.gain), unit.removesuffix("s")
    dead_time = f"dead time {labels.format_duration(found.dead_time)}"
    if found.integrating:
        return f"integrating process, gain {gain} PV units per {of_op} and second, {dead_time}"
    lag = labels.format_duration(found.time_constant)
    return f"gain {gain} PV units per {of_op}, time constant {lag}, {dead_time}"


def _alternatives(found: Identification) -> ExplanationStep:
    rows = [[name, labels.format_number(ratio)] for name, ratio in finite_likelihood_ratios(found)]
    lines = [
        "Positive: the sticky valve predicts the PV better. Negative: the other explanation predicts it better. The "
        "number is twice the logarithm of the likelihood ratio.",
        "The rows marked 'apart' are not other explanations: a valve with deadband sticks too, but without a slip "
        "jump; a "
        "load added to both valves shows whether a load changes the result.",
    ]
    columns = ["Other explanation", RATIO_LABEL]
    return ExplanationStep("Which other explanation comes close?", lines, StepTable(columns, rows, columns[1:]))


def _probability(diagnosis: Diagnosis) -> ExplanationStep:
    line = (
        f"The log odds in the table and the log odds of the prior {diagnosis.prior:g} "
        f"({log_odds(diagnosis.prior):+.2f}) add up to the log odds of the probability of stiction, "
        f"{labels.format_probability(diagnosis.probability)}."
    )
    rows = [[name, value, log_odds] for name, _, value, log_odds in feature_table(diagnosis)]
    columns = ["Feature", "Value", "Log odds"]
    return ExplanationStep("How probable is stiction?", [line], StepTable(columns, rows, columns[1:]))


def _causes(diagnosis: Diagnosis) -> ExplanationStep:
    main = labels.cause_label(diagnosis)
    line = (
        "No cause reaches a score of 0.5." if main == "none" else f"The main {labels.cause_title(diagnosis)} is {main}."
    )
    rows = [[labels.CAUSES[name], f"{getattr(diagnosis.oscillation_cause, name):.2f}"] for name in CAUSES]
    columns = ["Cause", "Score [-]"]
    return ExplanationStep("What makes the loop oscillate?", [line], StepTable(columns, rows, columns[1:]))


def _methods(diagnosis: Diagnosis) -> ExplanationStep:
    rows = [
        [
            labels.method_label(row.method),
            labels.format_number(row.index),
            labels.format_number(row.threshold),
            labels.VERDICTS[row.vote].lower(),
            "yes" if row.valid else "no",
            row.why,
        ]
        for row in diagnosis.evidence
    ]
    columns = ["Method", "Index", "Threshold", "Vote", "Valid here", "Why"]
    line = "The methods are shown for comparison; the probability does not use their votes."
    return ExplanationStep("What do published methods say?", [line], StepTable(columns, rows, ["Index", "Threshold"]))

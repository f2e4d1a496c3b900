"""The story of one verdict, step by step: data, oscillation, valve and process, what counted, causes, what is told."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.held import value_of
from stiction.diagnosis.verdict.meaning import FEATURES, PRIOR
from stiction.display.number_format import count_noun, format_interval
from stiction.report import labels

if TYPE_CHECKING:
    from stiction.diagnosis.identified import ControllerFit, Explanation, Identification, ProcessFit
    from stiction.diagnosis.result import Diagnosis

__all__ = ["Step", "Tabled", "causes_step", "controlled", "counted_step", "explained", "story"]

COUNTED = 8
"""Findings named in the story; the others are told together."""
NO_DRIFT = 1e-3
"""Share of S per hour below which a drift, with its standard error, is none [-]."""


class Tabled(NamedTuple):
    """A small table within a step."""

    columns: list[str]
    """Headings."""
    rows: list[list[str]]
    """Cells."""
    numbers: list[str]
    """Columns that hold numbers."""


class Step(NamedTuple):
    """One step of the story."""

    title: str
    """The question."""
    lines: list[str]
    """The answer, a sentence a line."""
    table: Tabled | None = None
    """Its numbers, where there are more than a sentence holds."""


def explanation_steps(diagnosis: Diagnosis) -> list[Step]:
    """Tell how a verdict came about.

    Parameters
    ----------
    diagnosis : Diagnosis
        A verdict.

    Returns
    -------
    list of Step
        The steps in order; those that did not take place are left out.
    """
    found, unit = diagnosis.identification, diagnosis.record.op_unit_short
    steps = [
        Step("What are the data worth?", diagnosis.quality.summary().splitlines()),
        Step("Does the loop oscillate?", _rhythm(diagnosis)),
    ]
    if diagnosis.controller is not None:
        steps.append(Step("Which controller moves OP?", [controlled(diagnosis.controller, unit)]))
    if found is not None:
        lines = [text for _, text in explained(found, unit)]
        steps.append(Step("Which valve and process explain the PV?", lines))
    stem = [row.why for row in diagnosis.evidence if row.method == "stem"]
    if stem:
        steps.append(Step("What does the valve's position show?", stem))
    steps += [step for step in (counted_step(diagnosis), causes_step(diagnosis)) if step is not None]
    if diagnosis.evidence:
        steps.append(_methods(diagnosis))
    if diagnosis.windows:
        steps.append(_windows(diagnosis))
    told = f"{labels.headline(diagnosis)}. {labels.confidence_text(diagnosis)}."
    return [*steps, Step("So", [told, diagnosis.reason, diagnosis.action])]


def _rhythm(diagnosis: Diagnosis) -> list[str]:
    rhythm = diagnosis.oscillation
    lines = [rhythm.reason] if rhythm.reason else []
    if rhythm.oscillating:
        unit = diagnosis.record.op_unit_short
        amplitudes = f"PV by {labels.format_number(rhythm.amplitude_pv)}, OP by {labels.format_number(rhythm.amplitude_op, unit)}"
        lines.append(
            f"Every {labels.format_duration(rhythm.period)}, {labels.format_number(rhythm.cycles)} cycles, {amplitudes} either way."
        )
    return lines + [
        f"Another oscillation every {labels.format_duration(other.period)} carries {100.0 * other.share:.0f} % of the error."
        for other in rhythm.others
    ]


def controlled(found: ControllerFit, unit: str) -> str:
    """The controller found, its settings with standard errors, and what it explains, in a sentence; OP in `unit`."""
    if found.form == "unknown":
        return f"No form of controller explains it. {found.why}"
    settings = [f"Kc {_with_error(found.Kc, found.Kc_error)} {unit} per PV unit"] if found.Kc else []
    if 0.0 < found.Ti < math.inf:
        settings.append(f"Ti {_with_error(found.Ti, found.Ti_error)} s")
    if not found.Kc:
        settings.append(f"Ki {labels.format_number(found.Ki)} {unit} per PV unit and s")
    if found.Td:
        settings.append(f"Td {labels.format_number(found.Td)} s")
    samples = "; the record shows its own samples" if found.own_samples else ""
    return f"{found.form} with {', '.join(settings)}: explains {100.0 * found.explained:.0f} % of OP{samples}."


def _with_error(value: float, error: float) -> str:
    return labels.format_number(value) + (
        f" \u00b1 {labels.format_number(error, significant=1)}" if error > 1e-6 * abs(value) else ""
    )


def explained(found: Identification, unit: str) -> list[tuple[str, str]]:
    """What was identified, each with a word for it and a sentence; OP in `unit`."""
    lines = [("Valve", found.summary(unit)), ("Process", f"The process {_process(found.process, unit)}.")]
    if found.linear is not None:
        lines.append(("Good valve", f"Behind a good valve the process {_process(found.linear, unit)}."))
    if math.isfinite(found.S_bootstrap[0]):
        _, low, high = format_interval(found.S_bootstrap[0], *found.S_bootstrap)
        ends = f"is {low}" if low == high else f"lies between {low} and {high}"
        draws = f"In 95 of 100 draws of the record's half cycles the likeliest S {ends} {unit}."
        lines.append(("Bootstrap", draws))
    by = _over_rivals(found)
    if by:
        lines.append(("Rivals", f"In twice the log likelihood a sticky valve predicts the PV {by}."))
    if found.left_out:
        samples = count_noun(found.left_out, "sample")
        left = f"Left out of that: {samples} that neither valve predicts, as where the load steps."
        lines.append(("Left out", left))
    if math.isfinite(found.drift) and max(abs(found.drift), found.drift_error) > NO_DRIFT * found.S:
        by, error = (labels.format_number(x, significant=2) for x in (found.drift, found.drift_error))
        lines.append(("Drift", f"S changes by {by} {unit} per hour (standard error {error})."))
    return [*lines, ("Limits", found.reason)] if found.reason else lines


def _process(found: ProcessFit, unit: str) -> str:
    """What a process does with OP, as part of a sentence; OP in `unit`."""
    gain, of_op = labels.format_number(found.gain), unit.removesuffix("s")
    late = f"a dead time of {labels.format_duration(found.dead_time)}"
    if found.integrating:
        return f"integrates {gain} PV units per {of_op} and second after {late}"
    lags = labels.format_duration(found.time_constant)
    return f"has a gain of {gain} PV units per {of_op}, a time constant of {lags} and {late}"


def _over_rivals(found: Identification) -> str:
    """By how much a sticky valve beats each of its rivals, as part of a sentence; nothing where none was compared."""
    told: dict[Explanation, str] = {
        "good": "than a good one",
        "bent": f"than a good one of a bent characteristic ({found.bent})",
        "gated": "than a good one given the past of the PV without its noise",
        "relaxation": "than a good one beside a disturbance that turns where the PV comes to a level",
        "wave": "than a good one beside a wave from outside",
        "beside_wave": "with that wave beside both",
    }
    likelier = [(found.over(name).likelier, what) for name, what in told.items()]
    return ", ".join(
        f"{'worse' if by < 0.0 else 'better'} by {labels.format_number(abs(by))} {what}"
        for by, what in likelier
        if math.isfinite(by)
    )


def counted_step(diagnosis: Diagnosis) -> Step | None:
    """Which findings counted for stiction and against it, the strongest first; None where nothing was weighed."""
    counted = diagnosis.counted
    if not counted:
        return None
    rows = [
        _counted_row(
            FEATURES.get(one.feature, one.feature.replace("_", " ")),
            one.log_odds,
            value_of(one),
            labels.format_number(one.usual, significant=2),
        )
        for one in counted[:COUNTED]
    ]
    if counted[COUNTED:]:
        rows.append(_counted_row("the others together", sum(one.log_odds for one in counted[COUNTED:])))
    rows.append(_counted_row("all together", sum(one.log_odds for one in counted)))
    found = labels.count_noun(sum(one.feature != PRIOR for one in counted), "finding")
    line = (
        f"{found}, and what is known of any loop, add up in log odds of stiction against all but play (deadband); with "
        f"play beside it the probability of stiction is "
        f"{labels.format_probability(diagnosis.probability_before_doubts)}."
    )
    table = Tabled(["Finding", "Here", "Usually", "Log odds", "Speaks"], rows, ["Here", "Usually", "Log odds"])
    return Step("What counted?", [line], table)


def _counted_row(name: str, log_odds: float, value: str = "–", usual: str = "–") -> list[str]:
    return [name, value, usual, f"{log_odds:+.1f}", "for stiction" if log_odds > 0.0 else "against"]


def causes_step(diagnosis: Diagnosis) -> Step | None:
    """Probability of each cause, the likeliest first; None where nothing was weighed."""
    if not diagnosis.causes:
        return None
    ranked = sorted(diagnosis.causes.items(), key=lambda item: -item[1])
    rows = [[name, labels.format_probability(share)] for name, share in ranked]
    return Step("Which cause?", [], Tabled(["Cause", "Probability"], rows, ["Probability"]))


def _methods(diagnosis: Diagnosis) -> Step:
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
    columns = ["Method", "Index", "Threshold", "Says", "Valid here", "Why"]
    return Step("What does each method say?", [], Tabled(columns, rows, ["Index", "Threshold"]))


def _windows(diagnosis: Diagnosis) -> Step:
    dt = diagnosis.record.dt
    rows = [
        [
            labels.format_duration(one.first * dt),
            labels.format_duration(one.last * dt),
            labels.VERDICTS[one.verdict].lower(),
            labels.format_number(one.S),
            labels.format_number(one.fit),
            labels.format_number(one.fit_linear),
        ]
        for one in diagnosis.windows
    ]
    columns = ["From", "To", "Says", f"S [{diagnosis.record.op_unit_short}]", "Fit [%]", "Good valve [%]"]
    return Step("When does it stick?", [], Tabled(columns, rows, [name for name in columns if name != "Says"]))

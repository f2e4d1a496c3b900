"""Format verdicts as text, and failures as JSON with the keys of verdicts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.apps.output import print_out, print_table
from stiction.report import labels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.apps.failure import Failure
    from stiction.diagnosis import Diagnosis

__all__ = ["failed_diagnosis_dict", "format_S", "print_verdicts"]


def print_verdicts(diagnoses: Sequence[Diagnosis], failures: Sequence[Failure], *, explain: bool) -> None:
    """Print one loop as a few lines, several loops as a table with the worst first."""
    from stiction.report.overview import sort_worst_first

    ranked = sort_worst_first(diagnoses)
    names = labels.unique_loop_names([diagnosis.record for diagnosis in ranked])
    if ranked:
        print_out("")
    if len(ranked) + len(failures) == 1 and ranked:
        only = ranked[0]
        print_out(f"{only.record.tag}: {labels.headline(only)}. {labels.confidence_text(only)}.")
        print_out(only.reason)
        print_out(only.action)
    elif ranked:
        rows = [[name, *_row(diagnosis)] for name, diagnosis in zip(names, ranked, strict=True)]
        rows += [[failure.tag or failure.file, "not diagnosed", "", "", "", "", failure.reason] for failure in failures]
        S = "S [%]" if any(diagnosis.record.op_in_percent for diagnosis in ranked) else "S"
        columns = ["Loop", "Verdict", "Cause", "Probability", S, "Period", "What to do"]
        print_table(columns, rows, right=["Probability", S, "Period"])
    elif len(failures) > 1:
        print_table(["File", "Reason"], [[failure.tag or failure.file, failure.reason] for failure in failures])
    if explain:
        for name, diagnosis in zip(names, ranked, strict=True):
            _explain(name, diagnosis)


def format_S(diagnosis: Diagnosis) -> str:
    """Return S with its interval, and its unit if that is not % of span; empty when S is not identified."""
    found = diagnosis.identification
    if found is None or diagnosis.verdict == "no_stiction":
        return ""
    S, low, high = labels.format_interval(found.S, found.S_low, found.S_high)
    unit = "" if diagnosis.record.op_in_percent else f" {diagnosis.record.op_unit_short}"
    return f"{S} ({low} to {high}){unit}"


def failed_diagnosis_dict(failure: Failure) -> dict[str, Any]:
    """Return a failure with the keys of a diagnosis and `error`, so that all JSON objects have the same keys."""
    return {
        "file": failure.file,
        "tag": failure.tag,
        "verdict": "undecided",
        "probability": None,
        "prior": None,
        "reason": failure.reason,
        "action": failure.remedy,
        "op_unit": None,
        "dt_s": None,
        "loop_state": None,
        "stiction": None,
        "controller": None,
        "oscillation": None,
        "oscillation_cause": None,
        "average_log_odds": None,
        "features": [],
        "evidence": [],
        "quality": None,
        "error": failure.reason,
    }


def _row(diagnosis: Diagnosis) -> list[str]:
    oscillation = diagnosis.oscillation
    return [
        labels.VERDICTS[diagnosis.verdict],
        labels.cause_label(diagnosis),
        labels.format_probability(diagnosis.probability) if diagnosis.loop_state.in_control else "-",
        format_S(diagnosis),
        labels.format_duration(oscillation.period) if oscillation.oscillating else "",
        diagnosis.action,
    ]


def _explain(name: str, diagnosis: Diagnosis) -> None:
    from stiction.report.explanation import explanation_steps

    print_out(f"\n{name}, step by step")
    for k, step in enumerate(explanation_steps(diagnosis), 1):
        print_out(f"\n{k}. {step.title}")
        for line in step.lines:
            print_out(f"   {line}")
        if step.table is not None:
            print_table(step.table.columns, step.table.rows, right=step.table.numbers)

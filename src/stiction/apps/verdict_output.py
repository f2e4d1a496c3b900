"""Format verdicts as text, and failures as JSON with the keys of verdicts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.apps.output import print_out, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.apps.failure import Failure
    from stiction.diagnosis import Diagnosis

__all__ = ["failed_diagnosis_dict", "print_verdicts"]


def print_verdicts(diagnoses: Sequence[Diagnosis], failures: Sequence[Failure], *, explain: bool) -> None:
    """Print one loop as a few lines, several loops as a table with the worst first."""
    from stiction.apps.print_blocks import print_blocks
    from stiction.report import labels
    from stiction.report.pages.loop import loop_blocks, loop_headline
    from stiction.report.pages.overview import overview, sort_worst_first

    ranked = sort_worst_first(diagnoses)
    left = [(failure.tag or failure.file, failure.reason) for failure in failures]
    if ranked:
        print_out("")
    if len(ranked) == 1 and not failures:
        print_blocks([loop_headline(ranked[0])])
    elif ranked:
        print_blocks([overview(ranked, left)])
    elif len(failures) > 1:
        print_table(["File", "Reason"], left)
    if explain:
        for name, diagnosis in zip(
            labels.unique_loop_names([diagnosis.record for diagnosis in ranked]), ranked, strict=True
        ):
            print_out(f"\n{name}, in detail")
            print_blocks(loop_blocks(diagnosis)[1:])


def failed_diagnosis_dict(failure: Failure) -> dict[str, Any]:
    """Return a failure with the keys of a diagnosis and `error`, so that all JSON objects have the same keys."""
    unknown = ("probability", "prior", "op_unit", "dt_s", "loop_state", "stiction", "controller", "oscillation",
               "oscillation_cause", "valve_test", "S_detectable", "average_log_odds", "windows_needed",
               "quality")  # fmt: skip
    return {
        "file": failure.file, "tag": failure.tag, "verdict": "undecided", "reason": failure.reason,
        "action": failure.remedy, "finding": "no_data", "next_step": "",
        **dict.fromkeys(unknown), "features": [], "windows": [], "history": [], "evidence": [], "error": failure.reason,
    }  # fmt: skip

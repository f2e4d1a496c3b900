"""``stiction benchmark``: compare verdicts with labels."""

from typing import Any

from stiction.apps.failure import program_fault, traceback_text
from stiction.apps.options import JsonOption
from stiction.errors import RecordError, StictionError

__all__ = ["benchmark"]


def benchmark(folder: str = ".", /, *, as_json: JsonOption = False) -> int:
    """Diagnose every record of a folder with a labels.csv, and count how often the verdict agrees with the label.

    The verdict of a group is that of most of its records; "undecided" counts as wrong. Exit code 1 when the verdict
    of a group is wrong, 0 when none is.

    Parameters
    ----------
    folder
        Folder with labels.csv: columns file and label (stiction or no_stiction), and where known loop, group,
        loop_type, integrating, dt_s and source. Files are named from that folder. A loop_type "concentration" is
        read as "analyser".
    as_json
        Print everything as JSON.
    """
    import time

    from stiction.apps.output import track
    from stiction.fleet.record_labels import read_labels
    from stiction.fleet.verdict_scores import (
        calibration_error,
        confusion_counts,
        reliability,
        score_causes,
        score_groups,
    )

    labels = read_labels(folder)
    began = time.perf_counter()
    results = [_diagnose_record(label) for label in track(labels, "Diagnosing")]
    seconds = (time.perf_counter() - began) / len(results)
    if all(result["error"] for result in results):
        raise RecordError(f"no record could be used; the first error is: {results[0]['reason']}", where=folder)
    groups = score_groups(results)
    bins = reliability(results)
    error = calibration_error(bins)
    summary = {
        "records": confusion_counts(results),
        "groups": confusion_counts(groups),
        "causes": score_causes(results),
        "reliability": bins,
        "calibration_error": round(error, 4) if error == error else None,
        "seconds_per_record": round(seconds, 3),
    }
    if as_json:
        from stiction.apps.output import print_json

        print_json({**summary, "results": results, "group_results": groups})
    else:
        _print_scores(summary, results, groups)
    return int(any(group["verdict"] != group["label"] for group in groups))


def _diagnose_record(label: Any) -> dict[str, Any]:
    """Diagnose one record and return its verdict with its label."""
    from dataclasses import replace

    from stiction import diagnose, read
    from stiction.apps.output import print_err

    row: dict[str, Any] = {"file": label.file, "loop": label.loop, "group": label.group, "label": label.label}
    try:
        records = read(label.path, dt=label.dt, loop_type=label.loop_type)
        if len(records) != 1:
            raise RecordError(f"contains {len(records)} loops; give a file with one loop.")
        diagnosis = diagnose(replace(records[0], tag=label.loop, integrating=label.integrating))
    except Exception as error:
        reason = str(error)
        if not isinstance(error, StictionError):
            reason = program_fault(label.file, label.loop, error).reason
            print_err(traceback_text(error))
        unknown = dict.fromkeys(("probability", "oscillation_cause", "stiction"))
        return {**row, **unknown, "verdict": "undecided", "cause": "none", "reason": reason, "error": True}
    stiction = diagnosis.identification.to_dict() if diagnosis.identification is not None else None
    verdict = {
        "verdict": diagnosis.verdict,
        "probability": diagnosis.probability,
        "cause": diagnosis.cause,
        "reason": diagnosis.reason,
    }
    causes = {"oscillation_cause": diagnosis.oscillation_cause.to_dict()}
    return {**row, **verdict, **causes, "stiction": stiction, "error": False}


def _print_scores(summary: dict[str, Any], results: list[dict[str, Any]], groups: list[dict[str, Any]]) -> None:
    from stiction.apps.output import print_out, print_table
    from stiction.display.number_format import format_probability

    rows = [
        [name, cells["n"], cells["right"], f"{100.0 * cells['right'] / cells['n']:.0f} %"]
        + [cells[cell] for cell in ("true_alarms", "missed", "false_alarms", "true_rests", "undecided")]
        for name, cells in (("records", summary["records"]), ("groups", summary["groups"]))
    ]
    counts = ["found", "missed", "false alarm", "cleared", "undecided"]
    print_table(["", "n", "right", "share", *counts], rows)
    print_out(f"{summary['seconds_per_record']:.2f} s per record")
    named = sorted({cause for counts in summary["causes"].values() for cause in counts})
    print_out("\nMain cause of the oscillation, by label")
    rows = [[label, *(counts.get(cause, 0) for cause in named)] for label, counts in summary["causes"].items()]
    print_table(["Label", *named], rows)
    if summary["reliability"]:
        print_out(
            f"\nProbability of stiction and share of sticky valves; mean difference {summary['calibration_error']:.3f}"
        )
        rows = [
            [f"{row['from']:.1f} to {row['to']:.1f}", row["n"], format_probability(row["mean"]), f"{row['sticky']:.2f}"]
            for row in summary["reliability"]
        ]
        print_table(["Probability", "Records", "Mean", "Sticks"], rows)
    wrong = [group for group in groups if group["verdict"] != group["label"]]
    if wrong:
        print_out("\nGroups with a wrong verdict")
        print_table(
            ["Group", "Label", "Verdict", "Records"], [[g["group"], g["label"], g["verdict"], g["n"]] for g in wrong]
        )
    missed = [row for row in results if row["verdict"] != row["label"]]
    if missed:
        print_out("\nRecords with a wrong verdict")
        keys = ("file", "label", "verdict", "probability", "cause", "reason")
        rows = [[_shown(row[key]) for key in keys] for row in missed]
        print_table([key.capitalize() for key in keys], rows)
    print_out(
        "\nThe model is trained on simulated loops alone; docs/validation.md shows its results on recorded loops."
    )


def _shown(value: Any) -> str:
    from stiction.display.number_format import format_probability

    return "" if value is None else format_probability(value) if isinstance(value, float) else str(value)

"""``stiction demo``: diagnose a small simulated plant with known faults."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from stiction.apps.demo_plant import score_text
from stiction.apps.options import JsonOption, ReportOption
from stiction.display.finding_words import OPEN
from stiction.display.number_format import count_noun

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis
    from stiction.simulation.demo import DemoLoop

__all__ = ["demo", "score_finding"]

DEFAULT_REPORT = "stiction-demo.html"


def demo(
    *,
    report: ReportOption = None,
    open: bool | None = None,  # noqa: A002 (--open)
    as_json: JsonOption = False,
    plant: Annotated[bool, Parameter(negative="")] = False,
    live: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Diagnose nine simulated loops, four of them with sticky valves, and compare each finding with the truth.

    Writes the report, and next to it a folder of the same name with the records as CSV, for `stiction diagnose`. A
    finding that leaves the question open counts neither as right nor as wrong. Exit code 0 when none is wrong, else 1.

    Parameters
    ----------
    report
        HTML file to write; stiction-demo.html in this folder when not given.
    open
        Whether to open the report in a browser; by default on a terminal with a display.
    as_json
        Print truth and verdict of each loop as JSON.
    plant
        Audit a simulated plant of 56 loops instead, with cascades and oscillations that spread from loop to loop. Its
        files go to the folder stiction-plant, or to the folder with the name of --report without its ending.
    live
        Serve a simulated plant of 57 loops by OPC UA, ten times as fast as a real one, and watch it for half an hour: a
        valve begins to stick and is repaired. Its files go to the folder stiction-live.
    """
    if live:
        from stiction.apps.demo_live import demo_live

        return demo_live(Path("stiction-live"))
    if plant:
        return _audit_plant(report, open, as_json=as_json)
    from dataclasses import replace

    from stiction import diagnose, read
    from stiction.apps.output import print_json, print_out, track
    from stiction.apps.output_files import check_folder, check_report, historian_csv
    from stiction.atomic_write import write_atomically
    from stiction.report import write_report
    from stiction.simulation.demo import demo_plant as simulated_loops

    target = check_report(report or DEFAULT_REPORT)
    folder = check_folder(target.with_suffix("") if target.suffix else target.with_name(f"{target.name}-records"))
    simulated = simulated_loops()
    if not as_json:
        print_out(f"A simulated plant of {count_noun(len(simulated), 'loop')}; its records are in {folder}.")
    diagnoses: list[Diagnosis] = []
    for loop in track(simulated, "Diagnosing"):
        file = write_atomically(historian_csv(loop.record), folder / f"{loop.record.tag}.csv")
        diagnosis = diagnose(read(file)[0])
        diagnoses.append(replace(diagnosis, settings={**diagnosis.settings, "truth": loop.story}))
    write_report(diagnoses, target, title="Demo plant", settings={"data": "simulated by stiction demo"})
    scores = [score_finding(loop, diagnosis) for loop, diagnosis in zip(simulated, diagnoses, strict=True)]
    if as_json:
        loops = [_verdict_dict(loop, diagnosis) for loop, diagnosis in zip(simulated, diagnoses, strict=True)]
        counts = {"right": scores.count("ok"), "open": scores.count("open")}
        print_json({"report": str(target), "records": str(folder), **counts, "loops": loops})
    else:
        _print_verdicts(simulated, diagnoses)
        print_out(f"\n{score_text(scores)}")
        print_out(f"Report: {target}")
        print_out(f"Try:    stiction diagnose {folder / simulated[0].record.tag}.csv")
    _open_page(target, open, as_json)
    return int("WRONG" in scores)


def _audit_plant(report: str | None, open_page: bool | None, *, as_json: bool) -> int:
    from stiction.apps.demo_plant import FOLDER, demo_plant_audit

    code, page = demo_plant_audit(Path(report).with_suffix("") if report else Path(FOLDER), as_json=as_json)
    _open_page(page, open_page, as_json)
    return code


def _open_page(page: Path, open_page: bool | None, as_json: bool) -> None:
    """Open a page in the browser on request, or by default on a terminal with a display."""
    if open_page or (open_page is None and not as_json and _has_display()):
        import webbrowser

        webbrowser.open(page.resolve().as_uri())


EXPECTED = {
    "stiction": ("sticks", "probably_sticks"),
    "deadband": ("backlash",),
    "tight tuning": ("tuning",),
    "external disturbance": ("external",),
    "sensor": ("sensor",),
    "none": ("nothing_found",),
}
"""Fault of a loop -> findings that are right."""


def score_finding(loop: "DemoLoop", found: "Diagnosis") -> str:
    """Compare a finding with the truth: "ok", "open" where it leaves the question open, else "WRONG"."""
    if found.finding in OPEN:
        return "open"
    right = found.finding in EXPECTED[loop.cause] and (found.verdict == "stiction") == (loop.cause == "stiction")
    return "ok" if right else "WRONG"


def _print_verdicts(plant: tuple["DemoLoop", ...], diagnoses: list["Diagnosis"]) -> None:
    from stiction.apps.output import print_out, print_table
    from stiction.report import labels

    print_out("")
    rows = [
        [
            score_finding(loop, diagnosis),
            loop.record.tag,
            loop.story,
            labels.finding_line(diagnosis),
            labels.format_probability(diagnosis.probability),
            f"{loop.S:g}" if loop.cause == "stiction" else "",
            labels.S_text(diagnosis),
        ]
        for loop, diagnosis in zip(plant, diagnoses, strict=True)
    ]
    columns = ["", "Loop", "Truth", "Finding", "Probability", "S true [%]", "S found [%]"]
    print_table(columns, rows)


def _verdict_dict(loop: "DemoLoop", diagnosis: "Diagnosis") -> dict[str, Any]:
    truth = {"cause": loop.cause, "story": loop.story, "S": loop.S, "J": loop.J}
    return {
        "tag": loop.record.tag,
        "result": {"ok": "right", "open": "open", "WRONG": "wrong"}[score_finding(loop, diagnosis)],
        "truth": truth,
        "diagnosis": diagnosis.to_dict(),
    }


def _has_display() -> bool:
    """Return whether there is a terminal with a display."""
    import os

    if not sys.stdout.isatty() or os.environ.get("CI") or os.environ.get("SSH_CONNECTION"):
        return False
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))

"""``stiction diagnose``: verdicts for recorded loops."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter

from stiction.apps.collection import pause_collection, resume_collection
from stiction.apps.failure import traceback_text, try_each
from stiction.apps.options import JsonOption, ReportOption, reject_misplaced_options
from stiction.apps.reading_options import SOURCES, ReadingOptions, read_sources
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis
    from stiction.records import LoopRecord

__all__ = ["diagnose", "diagnose_files"]

DEFAULT_REPORT = "stiction-report.html"


def diagnose(
    *files: Annotated[str, Parameter(name="SOURCE", help=SOURCES, allow_leading_hyphen=True)],
    report: ReportOption = None,
    no_report: Annotated[bool, Parameter(name="--no-report", negative="")] = False,
    as_json: JsonOption = False,
    explain: Annotated[bool, Parameter(negative="")] = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
    prior: float = 0.25,
    costs: tuple[float, float, float] = (1.0, 1.0, 0.3),
    smallest_S: Annotated[float, Parameter(name="--smallest-S")] = 1.0,
    export_twin: Annotated[str | None, Parameter(name="--export-twin", negative="")] = None,
) -> int:
    """Find out for each loop whether its valve sticks, how much, with what probability, and what to do.

    Files of one loop, by tag and time stamps, are pooled to one verdict.

    "Cannot tell" in a table is the verdict "undecided". Exit code 1 when a valve sticks, 0 when none does, 3 when no
    file could be used.

    Parameters
    ----------
    report
        HTML file to write, named .html or .htm; stiction-report.html in this folder when not given, none with --json.
        An older report is replaced; a file that is no report is left alone.
    no_report
        Write no report.
    as_json
        Print only a list with one JSON object per loop.
    explain
        Print all texts and numbers of the report for each loop: reasons, valve and process, oscillation, methods, data.
        Not with --json, which holds the same numbers.
    prior
        Share of sticky valves among the loops that the records come from, between 0 and 1; 0.25 when not given.
    costs
        Cost of a false alarm, of a missed sticky valve, and of an open question: three numbers in any unit; 1 1
        0.3 when not given. The verdict is "undecided" where either answer is expected to cost more than an open
        question.
    smallest_S
        Smallest stiction band that matters in % of span; 1 when not given. No valve is called good where stiction of
        this size would not have shown.
    export_twin
        FMU to write for one loop: valve, process and controller as identified, with the intervals of S and J as the
        ranges of these parameters.
    """
    reject_misplaced_options(files, diagnose)
    if not files:
        raise ParameterError(
            "there is no file to diagnose; give files, a folder, a pattern, a database URL, or - for standard input."
        )
    if report is not None and no_report:
        raise ParameterError("--report and --no-report cannot be used together; leave one of them out.")
    if as_json and explain:
        raise ParameterError(
            "--json and --explain cannot be used together; leave one of them out. The JSON has the numbers of the "
            "explanation: quality, loop_state, oscillation, controller, stiction, features, evidence."
        )
    options = reading.arguments()
    target = None
    if not no_report and (report is not None or not as_json):
        from stiction.apps.output_files import check_report

        try:
            target = check_report(report or DEFAULT_REPORT)
        except RecordError as error:
            raise RecordError(str(error) if report else f"{error} Or add --no-report.") from None
        if target.suffix.lower() not in (".html", ".htm"):
            raise ParameterError(
                f"--report writes HTML, but {target.name} does not end in .html or .htm; give a name that does."
            )
    judgement = {"prior": prior, "costs": costs, "smallest_S": smallest_S}
    if export_twin is not None:
        from stiction.atomic_write import require_new_file

        require_new_file(export_twin)
    pause_collection()
    try:
        return diagnose_files(files, options, judgement, target, as_json=as_json, explain=explain, twin=export_twin)
    finally:
        resume_collection()


class LoopFiles(NamedTuple):
    """All records of one loop."""

    records: "list[LoopRecord]"
    """The records."""

    @property
    def record(self) -> "LoopRecord":
        """The first one, whose tag and file name the loop."""
        return self.records[0]


def group_by_loop(records: "list[LoopRecord]") -> tuple[list[LoopFiles], list[str]]:
    """Put records with times and the same tag together, and say which of them do not fit together."""
    from stiction.diagnosis.evidence.one_loop import order_records

    groups: dict[tuple[str, int], list[LoopRecord]] = {}
    for number, record in enumerate(records):
        groups.setdefault((record.tag, -1 if record.start is not None else number), []).append(record)
    loops, notes = [], []
    for group in groups.values():
        try:
            order_records(group)
            loops.append(LoopFiles(group))
        except RecordError as error:
            notes.append(f"Not pooled: {error}")
            loops += [LoopFiles([record]) for record in group]
    return loops, notes


def diagnose_files(
    files: tuple[str, ...],
    options: dict[str, Any],
    judgement: dict[str, Any],
    target: Path | None,
    *,
    as_json: bool,
    explain: bool,
    twin: str | None = None,
) -> int:
    """Read, diagnose, print and write; return the exit code."""
    import stiction
    from stiction.apps.output import print_err, print_json, print_out, track
    from stiction.apps.verdict_output import failed_diagnosis_dict, print_verdicts
    from stiction.diagnosis.verdict.decision import Costs
    from stiction.records import summarise

    contents = read_sources(files, options)
    records, failures = contents.records, contents.failures
    if records:
        (print_err if as_json else print_out)(summarise(records).summary())
    settings = {
        "prior": judgement["prior"], "costs": Costs(*judgement["costs"]), "smallest_S": judgement["smallest_S"],
    }  # fmt: skip
    loops, notes = group_by_loop(records)
    for note in notes:
        print_err(note)
    if twin is not None and len(loops) > 1:
        tag = loops[0].record.tag
        raise ParameterError(
            f"--export-twin writes one loop, but there are {len(loops)}; choose one by --tag, such as --tag {tag}."
        )

    def judge(loop: LoopFiles) -> "Diagnosis":
        try:
            return stiction.diagnose(loop.records, **settings)
        finally:
            resume_collection()

    diagnoses, more = try_each(track(loops, "Diagnosing"), judge)
    failures += more
    if as_json:
        judged = ({**diagnosis.to_dict(), "error": None} for diagnosis in diagnoses)
        print_json([*judged, *map(failed_diagnosis_dict, failures)])
    else:
        print_verdicts(diagnoses, failures, explain=explain)
    faults = [failure.fault for failure in failures if failure.fault is not None]
    if not diagnoses:
        if faults:
            raise faults[0]
        for failure in failures[1:] if len(failures) > 1 and as_json else ():
            print_err(f"stiction: {failure.reason}")
        raise RecordError(failures[0].reason if len(failures) == 1 else "no file could be used; the reasons are above.")
    for error in faults:
        print_err(traceback_text(error))
    if target is not None:
        from stiction.report import write_report

        replaced = " (the older report is replaced)" if target.exists() else ""
        left = [(failure.tag or failure.file, failure.reason) for failure in failures]
        path = write_report(diagnoses, target, settings={**options, **judgement}, failures=left)
        (print_err if as_json else print_out)(f"Report: {path}{replaced}")
    if twin is not None:
        (print_err if as_json else print_out)(_export_twin(diagnoses, twin))
    return int(any(diagnosis.verdict == "stiction" for diagnosis in diagnoses))


def _export_twin(diagnoses: list["Diagnosis"], path: str) -> str:
    """Write the identified loop as an FMU; return what was written."""
    from stiction.export import export_fmu

    return export_fmu(diagnoses[0], path).summary()

"""``stiction diagnose``: from recorded loops to verdicts."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from stiction.apps.failure import Failure, fault, traceback_of
from stiction.apps.options import Json, Report, in_options, refuse_options
from stiction.errors import ParameterError, RecordError, StictionError

if TYPE_CHECKING:
    from stiction.diagnosis import Diagnosis
    from stiction.records import LoopRecord

__all__ = ["diagnose", "judge"]

FILES = 'CSV files as plants export them, one loop or many in each; "-" is the standard input.'
DEFAULT_REPORT = "stiction-report.html"


def diagnose(
    *files: Annotated[str, Parameter(name="FILE", help=FILES, allow_leading_hyphen=True)],
    report: Report = None,
    no_report: Annotated[bool, Parameter(name="--no-report", negative="")] = False,
    as_json: Json = False,
    explain: Annotated[bool, Parameter(negative="")] = False,
    tag: str | None = None,
    dt: float | None = None,
    column: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    loop_type: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    time_format: str | None = None,
    op_range: tuple[float, float] | None = None,
    mv_range: tuple[float, float] | None = None,
    day_first: bool | None = None,
) -> int:
    """Say of each loop in a record whether its valve sticks, how badly, how sure that is, and what to do.

    Exit code 1 when a valve sticks, 0 when none does, 3 when no file could be used.

    Parameters
    ----------
    report
        HTML file to write; stiction-report.html in this folder when not given, none with --json.
    no_report
        Write no report.
    as_json
        Print a list with one object per loop, and nothing else, on the output.
    explain
        Tell the story of each verdict step by step: data, oscillation, valve, what counted, causes, methods. Not with
        --json, which holds the numbers of the story.
    tag
        Only this loop of a file with several; the name of the loop where the header has none.
    dt
        Sampling period in seconds, where the file has no time or a wrong one: its rows are then taken as even.
    column
        SIGNAL=NAME, for example op=FIC101.OUT: which column is which, instead of guessing. SIGNAL is time, pv, sp,
        op, mv (valve position), valve_signal (what a compensator sends to the valve), mode, bad or quality. May be
        repeated.
    loop_type
        flow, level, pressure, temperature, analyser or other; by default from the tag's letters.
    delimiter
        Character between columns.
    decimal
        Decimal mark, "." or ",".
    time_format
        How time stamps are written, as in "%d.%m.%Y %H:%M:%S".
    op_range
        OP at 0 % and at 100 % of span, where the column is not in %: two numbers.
    mv_range
        The same of the valve position.
    day_first
        Whether 01/02/2026 is the first of February.
    """
    refuse_options(files, diagnose)
    if not files:
        raise ParameterError("no file was named; give one or more CSV files, or - for the standard input.")
    if report is not None and no_report:
        raise ParameterError("--report and --no-report exclude each other; leave one of them out.")
    if as_json and explain:
        raise ParameterError(
            "--json and --explain exclude each other: the story is text; leave one of them out. The JSON holds its "
            "numbers: quality, oscillation, controller, stiction, counted, causes, evidence, windows."
        )
    given = {
        "tag": tag, "dt": dt, "columns": columns_of(column), "loop_type": loop_type, "delimiter": delimiter,
        "decimal": decimal, "time_format": time_format, "op_range": op_range, "mv_range": mv_range,
        "day_first": day_first,
    }  # fmt: skip
    options = {name: value for name, value in given.items() if value is not None}
    target = None
    if not no_report and (report is not None or not as_json):
        from stiction.apps.files import check_report

        try:
            target = check_report(report or DEFAULT_REPORT)
        except RecordError as error:
            raise RecordError(str(error) if report else f"{error} Or add --no-report.") from None
    return judge(files, options, target, as_json=as_json, explain=explain)


def judge(files: tuple[str, ...], options: dict[str, Any], target: Path | None, *, as_json: bool, explain: bool) -> int:
    """Read, diagnose, tell and write; return the exit code."""
    from stiction.apps.findings import as_object, tell
    from stiction.apps.output import note, print_json, say
    from stiction.records import summarise

    records, failures = _read(files, options)
    if records:
        (note if as_json else say)(in_options(summarise(records).summary()))
    diagnoses, more = _diagnose(records)
    failures += more
    if as_json:
        judged = ({**diagnosis.to_dict(), "error": None} for diagnosis in diagnoses)
        print_json([*judged, *map(as_object, failures)])
    else:
        tell(diagnoses, failures, explain=explain)
    faults = [failure.fault for failure in failures if failure.fault is not None]
    if not diagnoses:
        if faults:
            raise faults[0]
        for failure in failures[1:] if len(failures) > 1 and as_json else ():
            note(f"stiction: {failure.reason}")
        raise RecordError(failures[0].reason if len(failures) == 1 else "no file could be used; see the reasons above.")
    for error in faults:
        note(traceback_of(error))
    if target is not None:
        from stiction.report import write_report

        left = [(failure.tag or failure.file, failure.reason) for failure in failures]
        path = write_report(diagnoses, target, settings=options, failures=left)
        (note if as_json else say)(f"Report: {path}")
    return int(any(diagnosis.verdict == "stiction" for diagnosis in diagnoses))


def columns_of(pairs: tuple[str, ...]) -> dict[str, str | int] | None:
    """Return SIGNAL=NAME pairs as a mapping; a NAME of digits is an index from 0.

    Examples
    --------
    >>> columns_of(("op=FIC101.OUT", "pv=2"))
    {'op': 'FIC101.OUT', 'pv': 2}
    """
    columns: dict[str, str | int] = {}
    for pair in pairs:
        signal, equals, name = pair.partition("=")
        if not (signal.strip() and equals and name.strip()):
            raise ParameterError(f'--column "{pair}" is not SIGNAL=NAME; write for example --column op=FIC101.OUT.')
        columns[signal.strip().lower()] = int(name) if name.strip().isdecimal() else name.strip()
    return columns or None


def _read(files: tuple[str, ...], options: dict[str, Any]) -> tuple[list["LoopRecord"], list[Failure]]:
    from stiction.apps.output import track
    from stiction.sources import read

    records: list[LoopRecord] = []
    failures: list[Failure] = []
    for file in track(files, "Reading"):
        try:
            records += read(file, **options)
        except RecordError as error:
            failures.append(Failure(file, None, in_options(str(error))))
        except StictionError:
            raise
        except Exception as error:
            failures.append(fault(file, None, error))
    return records, failures


def _diagnose(records: list["LoopRecord"]) -> tuple[list["Diagnosis"], list[Failure]]:
    from stiction import diagnose as verdict_of
    from stiction.apps.output import track

    diagnoses: list[Diagnosis] = []
    failures: list[Failure] = []
    for record in track(records, "Diagnosing"):
        try:
            diagnoses.append(verdict_of(record))
        except StictionError as error:
            failures.append(Failure(record.provenance.source, record.tag, in_options(str(error))))
        except Exception as error:
            failures.append(fault(record.provenance.source, record.tag, error))
    return diagnoses, failures

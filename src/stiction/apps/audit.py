"""``stiction audit``: many loops, ranked, grouped, resumable."""

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from stiction.apps.options import JsonOption, reject_misplaced_options
from stiction.apps.reading_options import ReadingOptions
from stiction.errors import ParameterError, StictionError

if TYPE_CHECKING:
    from stiction.fleet import Audit, LoopRow

__all__ = ["audit", "print_audit", "write_results"]

SOURCES = "What to read: files, folders, patterns or database URLs, as for `stiction diagnose`."
Results = Group("Results", sort_key=2)


@Parameter(name="*")
@dataclass(frozen=True)
class WorkOptions:
    """How an audit works.

    Parameters
    ----------
    workers
        Worker processes; one for each core when not given.
    dask
        Address of a Dask scheduler, or local.
    budget
        Time after which no further loop is begun, such as 10m; the same command without it does the rest.
    loops
        Only loops whose tag matches this pattern, such as "FIC*".
    connections
        CSV file with the columns from and to: loops that a stream or a signal connects.
    ledger
        URL of a PostgreSQL database for the results; a file in --out when not given.
    signals
        Folder for the averaged signals; signals in --out when not given.
    retry
        Try loops again that failed before.
    time_limit
        Longest processor time for one loop in seconds; 60 when not given.
    prior
        Share of sticky valves in the plant, between 0 and 1; 0.25 when not given.
    costs
        Cost of a false alarm, of a missed sticky valve, and of an open question; 1 1 0.3 when not given.
    smallest_S
        Smallest S that matters, in % of span: no valve is called good whose stiction of this size would not have shown;
        1 when not given.
    """

    workers: int | None = None
    dask: str | None = None
    budget: str | None = None
    loops: str | None = None
    connections: str | None = None
    ledger: Annotated[str | None, Parameter(group=Results)] = None
    signals: Annotated[str | None, Parameter(group=Results)] = None
    retry: Annotated[bool, Parameter(negative="")] = False
    time_limit: float = 60.0
    prior: float = 0.25
    costs: tuple[float, float, float] = (1.0, 1.0, 0.3)
    smallest_S: Annotated[float, Parameter(name="--smallest-S")] = 1.0


def audit(
    *sources: Annotated[str, Parameter(name="SOURCE", help=SOURCES, allow_leading_hyphen=True)],
    out: Annotated[str | None, Parameter(group=Results)] = None,
    as_json: JsonOption = False,
    compare: Annotated[str | None, Parameter(group=Results)] = None,
    pages: Annotated[int, Parameter(group=Results)] = 10,
    page: Annotated[tuple[str, ...], Parameter(group=Results, negative="")] = (),
    work: WorkOptions = WorkOptions(),
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Audit the loops of a plant: diagnose all, worst first, rank them, group shared oscillations.

    Ctrl-C stops; the same command goes on. Without SOURCE it shows the audit in --out again. Exit code 1 when a valve
    sticks, 0 when none does or nothing is new since --since last, 3 when the source or the folder cannot be used or
    every loop failed.

    Parameters
    ----------
    out
        Folder for the results: a new one, or the one of an earlier audit.
    as_json
        Print one object with loops (ranked), groups and counts, and nothing else, on the output.
    compare
        Folder of an earlier audit: say what is new, worse, same, better and gone.
    pages
        Write a page for each of this many loops, the worst first; 10 when not given.
    page
        Write the page of the loop with this tag too. May be repeated.
    """
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.atomic_write import may_write

    reject_misplaced_options(sources, audit)
    if out is None:
        raise ParameterError("no folder for the results was given; give one with --out FOLDER.")
    if pages < 0:
        raise ParameterError(f"--pages {pages} is negative; give 0 or more.")
    other = None if compare is None else _open(compare, None, "--compare ")
    found = _run(sources, out, work, reading, page, quiet=as_json) if sources else _open(out, work.ledger)
    if found is None:
        print_err("Stopped. The results so far are stored; run the same command again to continue.")
        return 130
    if found.run.get("nothing_since"):
        return _say_nothing_is_new(found, as_json=as_json)
    if not sources:
        _check_pages(page, [row.tag for row in found.rows])
    changes = None
    if other is not None:
        from stiction.fleet import compare_audits

        changes = compare_audits(found, other)
    shown = f"{found.folder} cannot be written to: the files in it stay as they are."
    if sources or may_write(found.folder):
        files = write_results(found, changes, pages, page)
        shown = f"Results:   {files}\nWork list: {found.folder / 'worklist' / 'index.html'}"
    if as_json:
        print_json(found.to_dict() | ({} if changes is None else {"changes": changes}))
    else:
        print_audit(found, changes)
    (print_err if as_json else print_out)(shown)
    counts = found.counts
    failed = counts["error"] + counts["timeout"] + counts["crashed"]
    if failed and failed == counts["loops"]:
        return 3
    return int(counts["stiction"] > 0)


def _say_nothing_is_new(found: "Audit", *, as_json: bool) -> int:
    """Say that no loop has samples after the last audit, which stays as it is."""
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.display.duration_format import format_time

    if as_json:
        print_json(found.to_dict())
    show = print_err if as_json else print_out
    show(f"Nothing is new: no loop has samples after {format_time(found.run['nothing_since'], local=True)}.")
    return 0


def _run(
    sources: tuple[str, ...], out: str, work: WorkOptions, reading: ReadingOptions, pages: tuple[str, ...], *,
    quiet: bool,
) -> "Audit | None":  # fmt: skip
    """Run the audit with a progress bar; None after Ctrl-C."""
    from stiction.apps.audit_interrupt import AuditInterrupt
    from stiction.apps.audit_progress import AuditBar
    from stiction.apps.output import print_err
    from stiction.fleet import AuditOptions, Progress
    from stiction.fleet import audit as audit_plant

    arguments = reading.arguments()
    window = {name: arguments.pop(name, None) for name in ("since", "until", "map")}
    options = AuditOptions(**vars(work), **window, reading=arguments)

    def watch(progress: Progress) -> None:
        if progress.stage == "find" and progress.details:
            _check_pages(pages, progress.details["tags"])
        interrupt.stage = progress.stage
        bar.update(progress)

    try:
        with AuditBar(quiet=quiet) as bar, AuditInterrupt() as interrupt:
            found = audit_plant(sources, out, options, progress=watch, stop=interrupt.stop)
    except KeyboardInterrupt:
        print_err("Stopped. The results so far are stored; run the same command again to continue.")
        raise
    return found if found.run["finished"] else None


def _check_pages(pages: tuple[str, ...], tags: list[str]) -> None:
    """Check that there is a loop for each page that was asked for."""
    for tag in pages:
        if tag not in tags:
            close = difflib.get_close_matches(tag, tags, 1) or tags[:1]
            raise ParameterError(
                f"--page {tag}: no loop has this tag; give one of the {len(tags)} tags, for example {close[0]}."
            )


def _open(folder: str, ledger: str | None, option: str = "") -> "Audit":
    from stiction.fleet import open_audit

    try:
        return open_audit(folder, ledger=ledger)
    except StictionError as error:
        raise type(error)(*error.args, remedy=error.remedy, where=f"{option}{error.where}") from None


def write_results(found: "Audit", changes: list[dict[str, Any]] | None, pages: int, tags: tuple[str, ...]) -> str:
    """Write all files that people look at, and give the path of the first one to open.

    A loop of which no page can be written gives its place to the next one, but not a loop that was asked for.
    """
    from stiction.apps.output import print_err
    from stiction.fleet import work_list, write_exports
    from stiction.fleet.work_list_file import write_work_list_file
    from stiction.report import write_audit_page, write_loop_page
    from stiction.report.work_list_page import write_work_list_page

    write_exports(found)
    for tag in dict.fromkeys(tags):
        write_loop_page(found, tag)
    written = set[str]()
    for row in found.rows:
        if len(written) == pages:
            break
        if row.status == "diagnosed":
            try:
                if row.tag not in tags:
                    write_loop_page(found, row.tag)
                written.add(row.tag)
            except Exception as error:  # one page must not cost the table and the other pages
                print_err(f"The page of {row.tag} was not written: {error}")
    items, folder = work_list(found), found.folder / "worklist"
    write_work_list_file(items, folder / "worklist.xlsx")
    write_work_list_page(found, items, {}, folder / "index.html")
    return str(write_audit_page(found, changes=changes))


def print_audit(found: "Audit", changes: list[dict[str, Any]] | None = None) -> None:
    """Print counts, the ten worst loops, the groups, and what changed."""
    from stiction.apps.output import print_out, print_table
    from stiction.display import count_noun

    counts = found.counts
    print_out("")
    print_out(
        f"{count_noun(counts['loops'], 'loop')}: {counts['diagnosed']} diagnosed, {counts['screened']} screened only, "
        f"{counts['skipped']} at rest or without usable data, "
        f"{counts['error'] + counts['timeout'] + counts['crashed']} failed."
    )
    rows = [
        [row.tag, row.finding_text or row.text("status"), row.next_step, *map(row.text, ("S", "period_s", "priority"))]
        for row in found.worst(10)
    ]
    print_table(["Loop", "Finding", "Next step", "S [%]", "Period", "Priority"], rows)
    print_out("\nPriority: severity times the probability of a fault, with the severity of the loops that follow.")
    for row in found.worst(3):
        print_out(f"{row.tag}: {row.priority_reason}")
    _print_not_judged(found)
    for group in found.groups:
        print_out(f"\nGroup {group['number']}: {group['summary']}")
    if changes is not None:
        print_out("")
        if not changes:
            print_out("No loop has a finding in one of the two audits.")
            return
        names = ("change", "tag", "finding_text", "finding_text_before", "why")
        rows = [[row[name] or "" for name in names] for row in changes]
        print_table(["Change", "Loop", "Finding", "Before", "Why"], rows)


def _print_not_judged(found: "Audit", *, max_tags: int = 10) -> None:
    """Print the loops that were not judged, and the tags that the source does not have."""
    from stiction.apps.output import print_out

    loops = [f"{row.tag} ({_state_text(row)})" for row in found.not_judged]
    for what, tags in (
        ("Not judged", loops),
        ("Tags of the map that the source does not have", found.missing_tags["map_tags"]),
        ("Tags of the connections that are not loops", found.missing_tags["connection_tags"]),
    ):
        if tags:
            more = f" and {len(tags) - max_tags} more" if len(tags) > max_tags else ""
            print_out(f"\n{what}: {', '.join(tags[:max_tags])}{more}")
    failed = [row for row in found.not_judged if row.failed or row.loop_state == "bad_data"]
    for row in failed[:max_tags]:
        print_out(f"{row.tag}: {row.reason}")


def _state_text(row: "LoopRow") -> str:
    return row.text("status") if row.failed or row.loop_state is None else row.text("loop_state")

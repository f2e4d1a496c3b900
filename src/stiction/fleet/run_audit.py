"""`audit`: screen all loops of a plant, diagnose them worst first, group their oscillations, and keep the results."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError, require_positive, require_probability
from stiction.fleet.audit import Audit, read_audit
from stiction.fleet.find_loops import choose_loops, list_loop_places
from stiction.fleet.folder import check_folder, lock_folder, options_digest, process_name, write_settings
from stiction.fleet.ledger import FORMAT_VERSION, Ledger, sqlite_url
from stiction.fleet.progress import Progress
from stiction.fleet.tag_receipt import find_missing_tags
from stiction.fleet.time_text import parse_duration, parse_moment
from stiction.fleet.window import resolve_window

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Mapping, Sequence
    from datetime import datetime

    from stiction.fleet.source_parts import LoopPlace

__all__ = ["audit"]


def audit(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    workers: int | None = None,
    dask: str | None = None,
    since: str | datetime | None = None,
    until: str | datetime | None = None,
    budget: str | float | None = None,
    loops: str | None = None,
    map: str | os.PathLike[str] | None = None,  # noqa: A002 (the option of the command line has this name)
    connections: str | os.PathLike[str] | None = None,
    ledger: str | None = None,
    signals: str | os.PathLike[str] | None = None,
    prior: float = 0.25,
    costs: tuple[float, float, float] = (1.0, 1.0, 0.2),
    time_limit: float = 60.0,
    retry: bool = False,
    reading: Mapping[str, Any] | None = None,
    progress: Callable[[Progress], None] | None = None,
    stop: threading.Event | None = None,
) -> Audit:
    """Diagnose all loops of a plant, rank them, and group those that share an oscillation.

    The same call goes on where an earlier one was interrupted; loops that are done, and whose files did not change, are
    not done again.

    Parameters
    ----------
    source : str, path, or sequence of these
        Files, folders, patterns or database URLs, as `stiction.read` takes them.
    out : path
        Folder for the results; a new one, or the one of an earlier audit.
    workers : int, optional
        Worker processes [-]; one for each core when not given.
    dask : str, optional
        Address of a Dask scheduler, or "local", instead of the processes of this machine.
    since, until : str or datetime, optional
        First time, and the time before which the samples end; "last" for `since` is the end of the data of the last
        audit.
    budget : str or float, optional
        Time after which no further loop is begun, such as "10m" or 600 [s]. All loops are screened first, and diagnosed
        in the order of their expected priority.
    loops : str, optional
        Only loops whose tag matches this pattern, such as "FIC*".
    map : path, optional
        Mapping file: tag, loop, role, unit, span, area, master and importance.
    connections : path, optional
        CSV file with the columns `from` and `to`: tags of loops that a stream or a signal connects.
    ledger : str, optional
        URL of a PostgreSQL database that keeps the results; a file in `out` when not given.
    signals : path, optional
        Folder for the block means of the signals; `out`/signals when not given.
    prior : float
        Share of sticky valves in the plant [-].
    costs : (float, float, float)
        Costs of a false alarm, a missed sticky valve, and an open question [-].
    time_limit : float
        Longest processor time for one loop [s]; a loop that takes ten times that by the clock is ended too.
    retry : bool
        Whether loops that failed before are tried again.
    reading : mapping, optional
        Further options of `stiction.read`.
    progress : callable, optional
        Called with a `Progress` whenever something is done.
    stop : threading.Event, optional
        When it is set, the loops in work are finished, no further one is begun, and the unfinished audit is returned.

    Returns
    -------
    Audit
        All rows, ranked, and the groups.

    Raises
    ------
    RecordError
        When the source holds no loop, the folder holds something else, another audit is at work in it, or the ledger
        cannot be reached, or no tag of the connections is a loop. Existing results stay.
    ParameterError
        When an option is outside its limits.

    Notes
    -----
    A screen of every loop finds loop state, oscillation, data checks and severity. It leaves out only loops that cannot
    be judged or rest (`RESTING_STATES`). The diagnosis works on block means of at least 30 samples a period, or on a
    part of the record where the oscillation is faster.

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     record.to_parquet(f"{folder}/plant.parquet")
    ...     found = st.audit(f"{folder}/plant.parquet", f"{folder}/audit", workers=1)
    ...     [(row["verdict"], round(row["period_s"], -1)) for row in found.rows]
    [('stiction', 140.0)]
    """
    from stiction.diagnosis.verdict.decision import Costs
    from stiction.fleet.audit_run import AuditRun, RunOptions

    sources = [os.fspath(source)] if isinstance(source, (str, os.PathLike)) else [os.fspath(one) for one in source]
    if not sources:
        raise ParameterError("source is empty; give files, folders, patterns or database URLs.")
    options = dict(reading or {}) | ({"map": os.fspath(map)} if map is not None else {})
    links = read_connections(connections) if connections is not None else []
    chosen = RunOptions(
        workers=workers, dask=dask, prior=prior, costs=costs, time_limit=time_limit, retry=retry,
        budget=None if budget is None else parse_duration("budget", budget), connections=links, stop=stop,
    )  # fmt: skip
    report = progress or _ignore
    first, last = since if since == "last" else parse_moment("since", since), parse_moment("until", until)
    Costs(*costs)
    require_positive("time_limit", time_limit, "s")
    require_probability("prior", prior)
    folder = Path(out)
    check_folder(folder)

    def find(since: datetime | None, until: datetime | None) -> tuple[list[LoopPlace], dict[str, list[str]]]:
        report(Progress("find", 0, 0))
        found = list_loop_places(sources, _with_times(options, since, until))
        missing = find_missing_tags([one.tag for one in found], options.get("map"), links)
        places = choose_loops(found, loops)
        report(Progress("find", len(places), len(places), details={"tags": [one.tag for one in places]}))
        return places, missing

    known = None if first == "last" else find(first, last)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordError(f"cannot be created ({error.strerror}); give another folder.", where=folder) from None
    with lock_folder(folder):
        database = Ledger(ledger or sqlite_url(folder / "ledger.sqlite"))
        try:
            database.create()
            with database.lock(process_name()):
                digest = options_digest({"reading": options, "prior": prior, "costs": costs})
                key, span = resolve_window(database, digest, first, last)
                places, missing = known or find(*span)
                settings = _settings(sources, options, loops, ledger, signals, connections)
                write_settings(folder, settings)
                run = AuditRun(
                    folder, settings, database, key, span, places, replace(chosen, missing_tags=missing), report
                )
                try:
                    run.run()
                finally:
                    run.close()
                return read_audit(folder, settings, database)
        finally:
            database.close()


def read_connections(path: str | os.PathLike[str]) -> list[tuple[str, str]]:
    """Read a CSV file with the columns `from` and `to`.

    Raises
    ------
    RecordError
        When it cannot be read, has other columns, or a row without one of the two tags.
    """
    import csv

    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(f"the connections cannot be read ({reason}); check the path.", where=path) from None
    rows = list(csv.DictReader(text.splitlines()))
    names = [name.strip().lower() for name in (csv.reader(text.splitlines()[:1]).__next__() if text.strip() else [])]
    if not {"from", "to"} <= set(names):
        raise RecordError(
            f"has the columns {', '.join(names) or '(none)'}; write from,to in its first line.", where=path
        )
    links = []
    for number, row in enumerate(rows, 2):
        cells = {str(name).strip().lower(): str(cell or "").strip() for name, cell in row.items()}
        if not (cells["from"] and cells["to"]):
            raise RecordError(
                "from or to is empty; write two tags, or delete the line.", where=f"{path}, line {number}"
            )
        links.append((cells["from"], cells["to"]))
    return links


def _with_times(options: dict[str, Any], since: Any, until: Any) -> dict[str, Any]:
    """Options for reading; a database whose time column is named is asked for the audited time alone."""
    if "time" not in options or "table" not in options:
        return options
    times = {"since": since and since.isoformat(), "until": until and until.isoformat()}
    return options | {name: text for name, text in times.items() if text}


def _settings(
    sources: list[str], options: dict[str, Any], loops: str | None, ledger: str | None, signals: Any, connections: Any
) -> dict[str, Any]:
    from stiction import __version__
    from stiction.sources.database_url import is_database_url, show_url

    return {
        "format": FORMAT_VERSION,
        "version": __version__,
        "sources": [show_url(one) if is_database_url(one) else one for one in sources],
        "reading": options,
        "loops": loops,
        "ledger": ledger and show_url(ledger),
        "signals": None if signals is None else os.fspath(signals),
        "connections": None if connections is None else os.fspath(connections),
    }


def _ignore(_: Progress) -> None:
    """Show nothing."""

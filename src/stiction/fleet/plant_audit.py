"""`audit`: screen all loops of a plant, diagnose them worst first, group their oscillations, and keep the results."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError
from stiction.fleet.audit_options import AuditOptions
from stiction.fleet.audit_result import Audit, read_audit
from stiction.fleet.audit_stages import AuditStages, EmptyRangeError
from stiction.fleet.engine import usable_cores
from stiction.fleet.find_loops import choose_loops, list_loop_places
from stiction.fleet.folder import check_folder, lock_folder, options_digest, process_name, write_settings
from stiction.fleet.ledger import FORMAT_VERSION, Ledger, sqlite_url
from stiction.fleet.progress import Progress
from stiction.fleet.tag_receipt import find_missing_tags
from stiction.fleet.window import resolve_window
from stiction.scratch import shared_copies
from stiction.sources.memory import shared_memory

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence
    from datetime import datetime

    from stiction.fleet.source_parts import LoopPlace

__all__ = ["audit"]


@shared_copies()
def audit(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    options: AuditOptions | None = None,
    *,
    progress: Callable[[Progress], None] | None = None,
    stop: threading.Event | None = None,
    **changes: Any,
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
    options : AuditOptions, optional
        What is asked for.
    progress : callable, optional
        Called with a `Progress` whenever something is done.
    stop : threading.Event, optional
        When it is set, the loops in work are finished, no further one is begun, and the unfinished audit is returned.
    **changes
        Fields of `AuditOptions`: workers [-], since, until, budget, loops, map, connections, prior [-], time_limit [s],
        ...

    Returns
    -------
    Audit
        All rows, ranked, and the groups; with `since="last"` and no new samples those of the last run, and
        `run["nothing_since"]` has the time after which there are none.

    Raises
    ------
    RecordError
        When the source holds no loop, the folder holds something else, another audit is at work in it, or the ledger
        cannot be reached, or no tag of the connections is a loop. Existing results stay.
    ParameterError
        When an option is outside its limits.

    Notes
    -----
    Each loop is diagnosed as `stiction.diagnose` does. A screen before it finds the order, worst first, and the block
    means from which groups are found; it leaves no loop out.

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     record.to_parquet(f"{folder}/plant.parquet")
    ...     found = st.audit(f"{folder}/plant.parquet", f"{folder}/audit", workers=1)
    ...     [(row.verdict, round(row.period_s, -1)) for row in found.rows]
    [('stiction', 140.0)]
    """
    sources = [os.fspath(one) for one in ([source] if isinstance(source, (str, os.PathLike)) else source)]
    if not sources:
        raise ParameterError("source is empty; give files, folders, patterns or database URLs.")
    chosen = replace(options or AuditOptions(), **changes)
    report = progress or _ignore
    folder = Path(out)
    check_folder(folder)

    def find(since: datetime | None, until: datetime | None) -> tuple[list[LoopPlace], dict[str, list[str]]]:
        report(Progress("find", 0, 0))
        listed = list_loop_places(sources, chosen.reading_between(since, until), (since, until))
        missing = find_missing_tags([one.tag for one in listed], chosen.reading.get("map"), chosen.links)
        places = choose_loops(listed, chosen.loops)
        report(Progress("find", len(places), len(places), details={"tags": [one.tag for one in places]}))
        return places, missing

    known = None if isinstance(chosen.first, str) else find(chosen.first, chosen.last)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordError(f"cannot be created ({error.strerror}); give another folder.", where=folder) from None
    with lock_folder(folder):
        database = Ledger(chosen.ledger or sqlite_url(folder / "ledger.sqlite"))
        try:
            database.create()
            memory = shared_memory(chosen.reading.get("max_memory"), chosen.workers or usable_cores())
            with database.lock(process_name()), memory:
                key, span = resolve_window(database, options_digest(chosen.of_results), chosen.first, chosen.last)
                places, missing = known or find(*span)
                settings = _settings(sources, chosen)
                write_settings(folder, settings)
                stages = AuditStages(folder, database, key, span, chosen, report, stop)
                try:
                    stages.run(places, missing)
                except EmptyRangeError:
                    if not isinstance(chosen.first, str):
                        raise
                    last = read_audit(folder, settings, database)
                    return replace(last, run=last.run | {"nothing_since": span[0] and span[0].isoformat()})
                finally:
                    stages.close()
                return read_audit(folder, settings, database)
        finally:
            database.close()


def _settings(sources: list[str], options: AuditOptions) -> dict[str, Any]:
    from stiction import __version__
    from stiction.sources.database_url import is_database_url, show_url

    return {
        "format": FORMAT_VERSION,
        "version": __version__,
        "sources": [show_url(one) if is_database_url(one) else one for one in sources],
        "reading": options.reading,
        "loops": options.loops,
        "ledger": options.ledger and show_url(options.ledger),
        "signals": None if options.signals is None else os.fspath(options.signals),
        "connections": None if options.connections is None else os.fspath(options.connections),
    }


def _ignore(_: Progress) -> None:
    """Show nothing."""

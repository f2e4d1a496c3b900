"""The result of an audit: its rows, ranked, and its groups, read from its folder."""

from __future__ import annotations

import html
import json
from collections import Counter
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.display.frames import as_native
from stiction.display.number_format import count_noun
from stiction.errors import ParameterError, RecordError, Setting
from stiction.fleet.audit_options import RUN_OPTIONS
from stiction.fleet.folder import read_settings
from stiction.fleet.labels import newest_labels, read_labels
from stiction.fleet.ledger import Ledger, ResultKey, sqlite_url
from stiction.fleet.loop_row import FAILED, NAMES
from stiction.fleet.rank import is_judged, rank_members, rank_rows

if TYPE_CHECKING:
    import os

    from stiction.diagnosis import Diagnosis
    from stiction.fleet.block_means import BlockMeans
    from stiction.fleet.loop_row import LoopRow
    from stiction.fleet.source_parts import LoopPlace
    from stiction.records.record import LoopRecord

__all__ = ["Audit", "open_audit"]


@dataclass(frozen=True)
class Audit:
    """Many loops, diagnosed and ranked.

    Examples
    --------
    >>> from pathlib import Path
    >>> import stiction as st
    >>> st.Audit(Path("plant"), [], [], {}, {}).worst(3)
    []
    """

    folder: Path
    """Folder of the audit."""
    rows: list[LoopRow] = field(repr=False)
    """One row for each loop, the highest priority first."""
    groups: list[dict[str, Any]] = field(repr=False)
    """Loops that share an oscillation, as `Group.to_dict` gives them; `number` counts from 1."""
    settings: dict[str, Any] = field(repr=False)
    """What was asked for: sources, options, version."""
    run: dict[str, Any] = field(repr=False)
    """The newest run: `started`, `finished` (None while it is at work), `window`, `since`, `until` and its options."""
    signal_parts: dict[str, tuple[int, str]] = field(default_factory=dict, repr=False)
    """Tag -> number of the loop [-] and name of the part that holds its block means."""
    ledger_url: str = field(default="", repr=False)
    """URL of the ledger; empty where it is in the folder."""

    @property
    def counts(self) -> dict[str, int]:
        """Loops by status and by verdict: "loops", "diagnosed", "screened", "skipped", "error", ..., "stiction", ..."""
        status = Counter(row.status for row in self.rows)
        verdict = Counter(row.verdict for row in self.rows if row.status == "diagnosed")
        names = ("diagnosed", "screened", "skipped", *FAILED)
        verdicts = {name: verdict[name] for name in ("stiction", "no_stiction", "undecided")}
        return {"loops": len(self.rows), **{name: status[name] for name in names}, **verdicts}

    @property
    def missing_tags(self) -> dict[str, list[str]]:
        """Tags that the source does not have: `map_tags` of the map, `connection_tags` of the connections."""
        return {"map_tags": [], "connection_tags": []} | (self.run.get("missing_tags") or {})

    @property
    def not_judged(self) -> list[LoopRow]:
        """Rows of loops that cannot be judged or failed; they come last in `rows`."""
        return [row for row in self.rows if not is_judged(row)]

    def worst(self, n: int = 10) -> list[LoopRow]:
        """The first `n` rows [-] of loops that were judged."""
        return [row for row in self.rows if is_judged(row)][:n]

    def row(self, tag: str) -> LoopRow:
        """Row of one loop.

        Raises
        ------
        ParameterError
            When the audit has no such loop.
        """
        for row in self.rows:
            if row.tag == tag:
                return row
        raise ParameterError(f"has no loop {tag!r}; give one of its {len(self.rows)} tags.", where=self.folder)

    def to_frame(self, native: str = "polars") -> Any:
        """Rows as a data frame of polars, pandas or pyarrow, without what is not a number or text."""
        import polars as pl

        nested = ("oscillation_causes", "severity_parts", "oscillations", "history")
        flat = [{name: value for name, value in row.items() if name not in nested} for row in self.rows]
        flat = [one | {"data_warnings": ", ".join(one["data_warnings"])} for one in flat]
        names = [name for name in NAMES if name not in nested]
        frame = pl.DataFrame(flat, schema=names, infer_schema_length=None)
        return as_native(frame, native)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, as `stiction audit --json` prints it."""
        receipt = {"missing_tags": self.missing_tags}
        rows = [row.to_dict() for row in self.rows]
        return {"loops": rows, "groups": self.groups, "counts": self.counts, "receipt": receipt, "run": self.run}

    def signals(self, tag: str) -> BlockMeans | None:
        """Block means of one loop; None when it has none."""
        from stiction.fleet.signals import read_signals

        number, part = self.signal_parts.get(tag, (0, ""))
        return read_signals(self.signals_folder, {number: part}).get(number) if part else None

    @property
    def signals_folder(self) -> Path:
        """Folder of the block means."""
        return Path(self.settings["signals"]) if self.settings.get("signals") else self.folder / "signals"

    def source_of(self, tag: str) -> LoopPlace:
        """Where the record of one loop is.

        Raises
        ------
        ParameterError
            When the audit has no such loop.
        """
        from stiction.fleet.source_parts import place_from_dict

        self.row(tag)
        return place_from_dict(json.loads(self.settings["places"][tag]))

    def read(self, tag: str) -> LoopRecord:
        """Read the record of one loop, cut to the window of the audit.

        Raises
        ------
        RecordError
            When the source is gone, or cannot be read.
        """
        from stiction.fleet.loop_work import cut_time
        from stiction.fleet.source_parts import read_loop

        since, until = (text and datetime.fromisoformat(text) for text in (self.run["since"], self.run["until"]))
        return cut_time(read_loop(self.source_of(tag)), since or None, until or None)

    def diagnose(self, record: LoopRecord) -> Diagnosis:
        """Diagnose the record of one loop, as `read` gives it, with prior, costs and smallest S of the newest run.

        Of a loop that follows another, the page says so: `Diagnosis.settings` has `follows` and `next_step`.

        Raises
        ------
        RecordError
            When the record has no PV.
        """
        from stiction.diagnosis import diagnose
        from stiction.diagnosis.verdict.decision import Costs

        run = self.run
        found = diagnose(record, prior=run["prior"], costs=Costs(*run["costs"]), smallest_S=run["smallest_S"])
        row = next((row for row in self.rows if row.tag == record.tag), None)
        if row is None or row.follows is None:
            return found
        told = {"follows": row.finding_text, "next_step": row.next_step}
        return replace(found, settings=found.settings | told)

    def history(self, tag: str) -> list[dict[str, Any]]:
        """Verdicts and sizes of one valve in all audited times of this folder, the earliest first.

        Each has `window`, `start`, `end`, `finding_text`, `verdict`, `probability`, `priority`, and `S`, `S_low`,
        `S_high` and `S_detectable` [% of span]: the trend of S.
        """
        self.row(tag)
        database = Ledger(self.ledger_url or sqlite_url(self.folder / "ledger.sqlite"))
        try:
            stored = database.read_history(self.signal_parts[tag][0])
        finally:
            database.close()
        names = ("start", "end", "verdict", "probability", "priority", "S", "S_low", "S_high", "S_detectable",
                 "finding_text")  # fmt: skip
        rows = [{"window": window, **{name: row[name] for name in names}} for window, row in stored]
        return sorted(rows, key=lambda row: (row["end"] or "", row["window"]))

    def labels(self) -> dict[str, Any]:
        """Tag -> newest row of `labels.csv` of that tag."""
        return newest_labels(read_labels(self.folder))

    def summary(self) -> str:
        """The audit in a few lines."""
        counts = self.counts
        failed = counts["error"] + counts["timeout"] + counts["crashed"]
        lines = [
            f"{count_noun(counts['loops'], 'loop')}: {counts['diagnosed']} diagnosed, {counts['screened']} screened "
            f"only, {counts['skipped']} not diagnosed, {failed} failed. "
            f"{count_noun(counts['stiction'], 'sticky valve')}, {counts['undecided']} undecided, "
            f"{count_noun(len(self.groups), 'group')}."
        ]
        lines += [f"{k}. {row.tag}: {row.finding_text}. {row.next_step}" for k, row in enumerate(self.worst(), 1)]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Counts and the ten worst loops, for a notebook."""
        names = ("tag", "area", "finding_text", "next_step", "S", "period_s", "priority")
        heads = ("Loop", "Area", "Finding", "Next step", "S", "Period", "Priority")
        head = "".join(f"<th>{name}</th>" for name in heads)
        cells = ("".join(f"<td>{html.escape(row.text(name))}</td>" for name in names) for row in self.worst())
        lines = [f"<tr>{line}</tr>" for line in cells]
        text = html.escape(self.summary().splitlines()[0])
        return f"<p>{text}</p><table><thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def open_audit(folder: str | os.PathLike[str], *, ledger: str | None = None) -> Audit:
    """Open the audit in a folder, finished or not.

    Parameters
    ----------
    folder : path
        The folder that `audit` wrote.
    ledger : str, optional
        URL of the ledger, where it is not in the folder.

    Returns
    -------
    Audit
        The newest run.

    Raises
    ------
    RecordError
        When the folder holds no audit, or one of another format, or the ledger cannot be reached.

    Examples
    --------
    >>> import stiction as st
    >>> st.open_audit("no-such-folder")
    Traceback (most recent call last):
    ...
    stiction.errors.RecordError: no-such-folder: is not an audit (it has no audit.toml); make one with `stiction audit`.
    """
    folder = Path(folder)
    settings = read_settings(folder)
    if ledger is None and settings.get("ledger"):
        import os

        ledger = os.environ.get("STICTION_LEDGER")
        if ledger is None:
            raise RecordError(
                f"its results are in the database {settings['ledger']}",
                remedy=("give its URL with ", Setting("ledger"), " or in the environment variable STICTION_LEDGER"),
                where=folder,
            )
    database = Ledger(ledger or sqlite_url(folder / "ledger.sqlite"))
    try:
        return read_audit(folder, settings, database)
    finally:
        database.close()


def read_audit(folder: Path, settings: dict[str, Any], database: Ledger) -> Audit:
    """Read the newest run from an open ledger."""
    runs = database.read_runs()
    if not runs:
        return Audit(folder, [], [], settings, {"started": None, "finished": None, "since": None, "until": None})
    run = runs[-1]
    key = ResultKey.of_run(run)
    loops = database.read_loops()
    chosen = set(run["body"]["loops"])
    results = {k: v for k, v in database.read_results(key).items() if k in chosen}
    finished = [one for one in runs if one["finished"] and ResultKey.of_run(one) == key]
    groups = finished[-1]["body"].get("groups", []) if finished else []
    rows = rank_members([one.row for one in results.values()], groups)
    places = {one.row.tag: loops[k] for k, one in results.items()}
    parts = {one.row.tag: (k, one.signals) for k, one in results.items()}
    about = {name: run[name] for name in ("started", "finished", "window", "version")}
    about |= {name: run["body"][name] for name in ("since", "until", "missing_tags", *RUN_OPTIONS)}
    url = database.url if settings.get("ledger") else ""
    return Audit(folder, rank_rows(rows), groups, settings | {"places": places}, about, parts, url)

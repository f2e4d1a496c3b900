"""What an audit is asked for, checked when it is made."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, require_positive, require_probability
from stiction.fleet.time_text import parse_duration, parse_moment

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    Text = str | os.PathLike[str]

__all__ = ["RUN_OPTIONS", "AuditOptions"]

RUN_OPTIONS = ("prior", "costs", "smallest_S", "time_limit")
"""Options that a run keeps in the ledger."""


@dataclass(frozen=True)
class AuditOptions:
    """What an audit is asked for, besides its source and its folder.

    Raises
    ------
    ParameterError
        When an option is outside its limits.
    RecordError
        When the connections cannot be read.

    Examples
    --------
    >>> AuditOptions(budget="10m", prior=0.4).budget_s
    600.0
    """

    workers: int | None = None
    """Worker processes [-]; one for each core when not given."""
    dask: str | None = None
    """Address of a Dask scheduler, or "local", instead of the processes of this machine."""
    since: str | datetime | None = None
    """First time; "last" is the end of the data of the last audit."""
    until: str | datetime | None = None
    """Time before which the samples end."""
    budget: str | float | None = None
    """Time after which no further loop is begun, such as "10m" or 600 [s]. All loops are screened first, and diagnosed
    in the order of their expected priority."""
    loops: str | None = None
    """Only loops whose tag matches this pattern, such as "FIC*"."""
    map: Text | None = None
    """Mapping file: tag, loop, role, unit, span, area, master and importance."""
    connections: Text | None = None
    """CSV file with the columns `from` and `to`: tags of loops that a stream or a signal connects."""
    ledger: str | None = None
    """URL of a PostgreSQL database that keeps the results; a file in the folder when not given."""
    signals: Text | None = None
    """Folder for the block means of the signals; `signals` in the folder when not given."""
    prior: float = 0.25
    """Share of sticky valves in the plant [-]."""
    costs: tuple[float, float, float] = (1.0, 1.0, 0.3)
    """Costs of a false alarm, a missed sticky valve, and an open question [-]."""
    smallest_S: float = 1.0
    """Smallest S that matters [% of span]."""
    time_limit: float = 60.0
    """Longest processor time for one loop [s]; a loop that takes ten times that by the clock is ended too."""
    retry: bool = False
    """Whether loops that failed before are tried again."""
    reading: Mapping[str, Any] = field(default_factory=dict)
    """Further options of `stiction.read`."""
    links: list[tuple[str, str]] = field(init=False, repr=False)
    """The rows of `connections`."""
    budget_s: float | None = field(init=False, repr=False)
    """The budget [s]."""
    first: str | datetime | None = field(init=False, repr=False)
    """`since` as a time, or "last"."""
    last: datetime | None = field(init=False, repr=False)
    """`until` as a time."""

    def __post_init__(self) -> None:
        from stiction.diagnosis.verdict.decision import Costs

        parsed = {
            "links": [] if self.connections is None else read_connections(self.connections),
            "budget_s": None if self.budget is None else parse_duration("budget", self.budget),
            "first": self.since if self.since == "last" else parse_moment("since", self.since),
            "last": parse_moment("until", self.until),
            "reading": dict(self.reading or {}) | ({} if self.map is None else {"map": os.fspath(self.map)}),
        }
        for name, value in parsed.items():
            object.__setattr__(self, name, value)
        Costs(*self.costs)
        require_positive("time_limit", self.time_limit, "s")
        require_positive("smallest_S", self.smallest_S, "% of span")
        require_probability("prior", self.prior)

    @property
    def of_results(self) -> dict[str, Any]:
        """The options that results depend on."""
        return {"reading": self.reading, "prior": self.prior, "costs": self.costs, "smallest_S": self.smallest_S}

    def reading_between(self, since: datetime | None, until: datetime | None) -> dict[str, Any]:
        """Options for reading; a database whose time column is named is asked for the audited time alone."""
        times = {"since": since and since.isoformat(), "until": until and until.isoformat()}
        is_asked = "time" in self.reading and "table" in self.reading
        reading = {name: value for name, value in self.reading.items() if name != "max_memory"}  # shared by the workers
        return {**reading, **{name: text for name, text in times.items() if text and is_asked}}


def read_connections(path: Text) -> list[tuple[str, str]]:
    """Read a CSV file with the columns `from` and `to`.

    Raises
    ------
    RecordError
        When it cannot be read, has other columns, or a row without one of the two tags.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(f"the connections cannot be read ({reason}); check the path.", where=path) from None
    reader = csv.DictReader(text.splitlines())
    names = [name.strip().lower() for name in reader.fieldnames or []]
    if not {"from", "to"} <= set(names):
        raise RecordError(
            f"has the columns {', '.join(names) or '(none)'}; write from,to in its first line.", where=path
        )
    links = []
    for number, row in enumerate(reader, 2):
        cells = {str(name).strip().lower(): str(cell or "").strip() for name, cell in row.items()}
        if not (cells["from"] and cells["to"]):
            raise RecordError(
                "from or to is empty; write two tags, or delete the line.", where=f"{path}, line {number}"
            )
        links.append((cells["from"], cells["to"]))
    return links

"""Command line options for reading a source, the same for every command, and the function that reads."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from stiction.apps.failure import Failure, program_fault
from stiction.apps.options import option_text
from stiction.errors import ParameterError, RecordError, StictionError

if TYPE_CHECKING:
    from stiction.records import LoopRecord
    from stiction.sources.loops import Loops

__all__ = ["SOURCES", "ReadSources", "ReadingOptions", "columns_of", "read_sources"]

SOURCES = (
    "What to read: files (CSV and other text, Excel, Parquet, Feather, MATLAB; also gz, zst, zip) of one loop or many, "
    'a folder, a pattern such as "data/*.csv", the URL of a database, OPC UA server (opc.tcp://HOST:4840) or PI Web '
    'API (pi+https://HOST/piwebapi), or "-", the standard input.'
)
_LIBRARY_NAMES = {
    "time_column": "time",
    "value_column": "value",
    "quality_column": "quality",
    "column": "columns",
}


@Parameter(name="*", group=Group("Reading", sort_key=1))
@dataclass(frozen=True)
class ReadingOptions:
    """How to read a source.

    Parameters
    ----------
    tag
        Only this loop of a source with several loops; a name for the loop if the source has none.
    dt
        Sampling period in seconds, if the source has no time stamps or wrong ones: its rows are then evenly sampled.
    column
        SIGNAL=NAME, for example op=FIC101.OUT: the column of a signal, if it is not recognised. SIGNAL is time, pv, sp,
        op, mv (valve position), valve_signal (output of a compensator), mode, bad or quality. May be repeated.
    map
        Mapping file with tag, loop, role and unit of every column; `stiction read --write-map` writes one.
    loop_type
        flow, level, pressure, temperature, analyser (or concentration) or other; by default from the tag's letters.
    sheet
        Sheet of a workbook; all by default.
    delimiter
        Character between columns.
    decimal
        Decimal mark, "." or ",".
    time_format
        Format of the time stamps, such as "%d.%m.%Y %H:%M:%S".
    day_first
        Whether 01/02/2026 is 1 February.
    timezone
        Time zone of time stamps without one, such as Europe/Berlin.
    op_range
        OP at 0 % and at 100 % of span, if the column is not in %: two numbers.
    mv_range
        Valve position at 0 % and at 100 % of span, if the column is not in %: two numbers.
    align
        How signals with different time stamps get common ones: last (hold the last value, the default) or interpolate.
    max_gap
        Longest time in seconds over which a value is held or interpolated.
    max_bytes
        Largest size of a file after decompression (2000000000); of Parquet and Feather, of the columns of a loop.
    max_memory
        Most memory for reading, such as 2GB; half of the machine when not given. Of a longer Parquet or Arrow file the
        last rows are read.
    good_codes
        Codes of the quality columns that are good, such as 0,4; all others are then bad. By default, by the schemes of
        the vendors.
    keep_uncertain
        Use values of uncertain quality; they are missing by default.
    query
        Database: a SELECT statement.
    table
        Database: a table or view, instead of a query.
    time_column
        Database: column with the time.
    tag_column
        Database with one row for each tag and time: column with the tag.
    value_column
        Database with one row for each tag and time: column with the value.
    quality_column
        Database with one row for each tag and time: column with the quality.
    tags
        Historian: only tags that match this pattern, such as "FIC*". May be repeated.
    since
        Database or historian: first time to read, such as 2026-03-02T06:00; of a historian the last day by default.
    until
        Database or historian: end of the time to read; the end itself is not included.
    """

    tag: str | None = None
    dt: float | None = None
    column: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    map: str | None = None
    loop_type: str | None = None
    sheet: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    time_format: str | None = None
    day_first: bool | None = None
    timezone: str | None = None
    op_range: tuple[float, float] | None = None
    mv_range: tuple[float, float] | None = None
    align: Literal["last", "interpolate"] | None = None
    max_gap: float | None = None
    max_bytes: int | None = None
    max_memory: str | None = None
    good_codes: str | None = None
    keep_uncertain: Annotated[bool | None, Parameter(negative="")] = None
    query: str | None = None
    table: str | None = None
    time_column: str | None = None
    tag_column: str | None = None
    value_column: str | None = None
    quality_column: str | None = None
    tags: Annotated[tuple[str, ...] | None, Parameter(name="--tags", negative="")] = None
    since: str | None = None
    until: str | None = None

    def arguments(self) -> dict[str, Any]:
        """Return the given options as arguments of `stiction.read`."""
        chosen = {**vars(self), "column": columns_of(self.column)}
        return {_LIBRARY_NAMES.get(name, name): value for name, value in chosen.items() if value is not None}


def columns_of(pairs: tuple[str, ...]) -> dict[str, str | int] | None:
    """Return SIGNAL=NAME pairs as a mapping; a NAME of digits is a column number from 0.

    Examples
    --------
    >>> columns_of(("op=FIC101.OUT", "pv=2"))
    {'op': 'FIC101.OUT', 'pv': 2}
    """
    columns: dict[str, str | int] = {}
    for pair in pairs:
        signal, equals, name = pair.partition("=")
        if not (signal.strip() and equals and name.strip()):
            raise ParameterError(
                f'--column "{pair}" is not of the form SIGNAL=NAME; write for example --column op=FIC101.OUT.'
            )
        columns[signal.strip().lower()] = int(name) if name.strip().isdecimal() else name.strip()
    return columns or None


@dataclass
class ReadSources:
    """Result of reading several sources."""

    records: list["LoopRecord"] = field(default_factory=list)
    """Records of all sources."""
    loops: list["Loops"] = field(default_factory=list)
    """Loops of each source that was read, with the columns of each."""
    failures: list[Failure] = field(default_factory=list)
    """Sources that could not be read."""


def read_sources(sources: Sequence[str], options: dict[str, Any]) -> ReadSources:
    """Read databases and the standard input each, and all files together as one source."""
    from stiction.apps.output import track
    from stiction.sources.database_url import is_database_url
    from stiction.sources.historians.address import is_historian_url

    result = ReadSources()
    alone = [one for one in sources if is_database_url(one) or is_historian_url(one) or one == "-"]
    files = list(dict.fromkeys(source for source in sources if source not in alone))
    together: list[str | list[str]] = [*alone]
    if files:
        together.append(files[0] if len(files) == 1 else files)
    for source in track(together, "Reading"):
        _read_one(source, options, result)
    return result


def _read_one(source: str | list[str], options: dict[str, Any], result: ReadSources) -> None:
    from stiction.sources import open_loops

    name = _shown(source) if isinstance(source, str) else ", ".join(source)
    try:
        loops = open_loops(source, **options)
        records, failures = loops.read_all()
    except RecordError as error:
        result.failures.append(Failure(name, None, error.text(option_text)))
    except StictionError:
        raise
    except Exception as error:
        result.failures.append(program_fault(name, None, error))
    else:
        result.records += records
        result.loops.append(loops)
        for file, tag, error in failures:
            fault = error.__cause__ if isinstance(error.__cause__, Exception) else None
            result.failures.append(Failure(file or name, tag, error.text(option_text), fault))


def _shown(source: str) -> str:
    """Return the name of a source without a password."""
    from stiction.sources.database_url import is_database_url, show_url

    return show_url(source) if is_database_url(source) else source

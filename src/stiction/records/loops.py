"""From a table to loop records: time, signals, bad values, OP scale, mode."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.columns import NUMBERS, Assignment, assign, choose_names, time_unit
from stiction.records.dialects import MISSING_WORDS, loop_type_of
from stiction.records.epochs import parse_numbers
from stiction.records.long_table import LongTable, apart, long_columns, widened
from stiction.records.numbers import to_numbers
from stiction.records.record import LoopRecord, Provenance
from stiction.records.resample import Grid, regular_grid
from stiction.records.signals import automatic, flagged_rows, in_percent
from stiction.records.timestamps import is_clock, is_date, is_stamp, parse_texts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from stiction.records.table import Columns, Table
    from stiction.records.timestamps import Stamps

__all__ = ["MIN_ROWS", "Options", "loops_of"]

MIN_ROWS = 10
SPARSE, LONGEST_BLANK = 0.5, 20
"""Share of the first rows that hold both OP and PV below which each is stored at its own times, and rows in a row
without one of them up to which that is so [-]; more are gaps."""


@dataclass(frozen=True)
class Options:
    """What the user said; see `stiction.records.read`."""

    dt: float | None = None
    tag: str | None = None
    columns: Mapping[str, str | int] | None = None
    loop_type: str | None = None
    time_format: str | None = None
    op_range: tuple[float, float] | None = None
    day_first: bool | None = None


def loops_of(table: Table, options: Options) -> list[LoopRecord]:
    """Every loop of a table that has a controller output.

    Raises
    ------
    RecordError
        With the one thing that keeps the table from being a record.
    """
    name = table.source.name
    table, options = _laid_out(table, options)
    names, units = choose_names(table.header)
    width = len(table.sample[0]) if not names else len(names)
    if not names and not options.columns:
        raise RecordError(
            f"{name}, line {table.first_line}: there is no header above the {width} columns; "
            "say what they are, for example columns={'time': 0, 'pv': 1, 'op': 2}."
        )
    given = assign(names, width, options.columns, name)
    _keep_loops(given, names, table, options)
    _find_time(given, table, options)
    roles = list(given.loops.values())
    text = {*given.time, *(i for s in roles for role, i in s.items() if role not in NUMBERS)}
    text |= {given.tag} if given.tag is not None else set()
    numeric_time = len(given.time) == 1 and table.is_numeric(given.time[0]) and options.time_format is None
    if isinstance(table, LongTable):
        text, numeric_time = text - set(given.time), False
    if numeric_time:
        text -= set(given.time)
    numbers = {s[role] for s in roles for role in NUMBERS if role in s} | set(given.time if numeric_time else [])
    taken = table.take(sorted(text - numbers), sorted(numbers))
    if taken.rows < MIN_ROWS:
        raise RecordError(f"{name}: has {taken.rows} rows of data; {MIN_ROWS} or more are needed, hundreds are useful.")
    shared = {role: i for role, i in given.loops.get("", {}).items() if role in ("bad", "quality", "mode")}
    records, dead = [], []
    for whose, part in _by_tag(taken, given, options, name).items():
        grid = _grid(given, part, table, options, names, units, numeric_time)
        for tag, signals in given.loops.items():
            if "op" not in signals:
                continue
            try:
                records.append(
                    _loop(whose or tag, {**shared, **signals}, table, part, grid, names, units, given, options)
                )
            except RecordError as error:
                dead.append(error)
    if not records:
        raise dead[0]
    told = tuple(f"Left out: {error}" for error in dead)
    return [replace(r, provenance=replace(r.provenance, guesses=(*r.provenance.guesses, *told))) for r in records]


def _laid_out(table: Table, options: Options) -> tuple[Table, Options]:
    """The table with a row for each time and a column for each signal, and the options by its column names."""
    names, units = choose_names(table.header)
    if not names:
        return table, options
    named = {signal: _name_of(column, names) for signal, column in (options.columns or {}).items()}
    given = assign(names, len(names), {s: column for s, column in named.items() if column in names}, table.source.name)
    laid: LongTable | None = None
    if not any(_is_loop(signals) for signals in given.loops.values()):
        if columns := long_columns(names, () if given.chosen else table.sample, table.decimal):
            laid = _widened(table, columns, given, names, units, options)
    elif times := _own_times(given, table):

        def parse(time: int, cells: list[str]) -> Stamps:
            return _stamps([time], {time: cells}, table, names, units, options)

        several = len(set(times.values())) > 1
        laid = apart(table, names, units, times, parse, ("",) if several else MISSING_WORDS)
    if laid is None:
        return table, options
    return laid, replace(options, columns={signal: i for signal, i in named.items() if signal.lower() != "time"})


def _name_of(column: str | int, names: list[str]) -> str | int:
    """The column's name as it is written; what is none stays, lest it be the tag of a long table."""
    if isinstance(column, str):
        same = [name for name in names if name.strip().upper() == column.strip().upper()]
        if same or not column.isdecimal():
            return same[0] if same else column
    return names[int(column)] if 0 <= int(column) < len(names) else column


def _is_loop(signals: dict[str, int]) -> bool:
    return "op" in signals and ("pv" in signals or "mv" in signals)


def _own_times(given: Assignment, table: Table) -> dict[int, int]:
    """Column -> column of its time stamps where the signals of a table are not stored at the same times; else empty."""
    used = sorted({i for signals in given.loops.values() for i in signals.values()})
    times = [max((time for time in given.time if time < i), default=-1) for i in used]
    if len(given.time) > 1:
        return dict(zip(used, times, strict=True)) if set(times) == set(given.time) else {}
    loop = next((signals for signals in given.loops.values() if _is_loop(signals)), None)
    if not given.time or given.tag is not None or loop is None or "pv" not in loop:
        return {}
    stored = np.array([[_stored(row, loop[role]) for role in ("op", "pv")] for row in table.sample])
    if stored.all(axis=1).mean() >= SPARSE or stored.sum(axis=0).min() < MIN_ROWS:
        return {}
    blank = max(int(np.diff(np.flatnonzero(np.r_[True, there, True])).max()) - 1 for there in stored.T)
    return dict.fromkeys(used, given.time[0]) if blank <= LONGEST_BLANK else {}


def _stored(row: list[str], column: int) -> bool:
    return column < len(row) and row[column].strip().upper() not in MISSING_WORDS


def _by_tag(taken: Columns, given: Assignment, options: Options, name: str) -> dict[str, Columns]:
    """Rows of each loop where a column says whose they are; all of them under no tag where none does."""
    if given.tag is None or set(given.loops) != {""}:
        return {"": taken}
    tags = np.array([cell.strip() for cell in taken.text[given.tag]], dtype=object)
    rows = {tag: np.flatnonzero(tags == tag) for tag in dict.fromkeys(tags)}
    rows = {tag: own for tag, own in rows.items() if tag and own.size >= MIN_ROWS}
    if options.tag is not None and rows:
        asked = {tag: own for tag, own in rows.items() if tag.lower() == options.tag.lower()}
        if not asked:
            raise RecordError(f"{name}: has no loop {options.tag!r}; its loops are {', '.join(list(rows)[:20])}.")
        rows = asked
    return {tag: taken.part(own) for tag, own in rows.items()} or {"": taken}


def _find_time(given: Assignment, table: Table, options: Options) -> None:
    """Settle the time column: by name, else a first column of stamps."""
    if not given.time and given.index is None:
        used = {i for signals in given.loops.values() for i in signals.values()}
        first = [row[0] for row in table.sample if row]
        if 0 not in used and first and 2 * sum(map(is_stamp, first)) > len(first):
            given.time = [0]
    if len(given.time) > 1:
        cells = {i: next((row[i] for row in table.sample if i < len(row) and row[i].strip()), "") for i in given.time}
        dates = [i for i in given.time if is_date(cells[i])]
        clocks = [i for i in given.time if is_clock(cells[i])]
        several = len(given.time)
        given.time = [dates[0], clocks[0]] if dates and clocks else given.time[:1]
        if several > len(given.time):
            given.guesses.append(f"Of {several} time columns the first is used for all signals.")
    if not given.time and options.dt is None:
        names, _ = choose_names(table.header)
        known = {given.index, *(i for signals in given.loops.values() for i in signals.values())}
        for i in sorted({*range(len(table.sample[0]))} - known):
            cells = [row[i] for row in table.sample if i < len(row)]
            steps = np.diff(to_numbers(cells, table.decimal)[0])
            one_way = len(steps) > 0 and ((steps > 0).all() or (steps < 0).all())
            if one_way or 2 * sum(map(is_stamp, cells)) > len(cells):
                column = names[i] if names and names[i] else i
                raise RecordError(
                    f"{table.source.name}: no column is known as time; if {column!r} is, say so with "
                    f"columns={{'time': {column!r}}}, or give the sampling period with dt= (--dt) in seconds."
                )
        counted = " only a sample index" if given.index is not None else " no time column"
        raise RecordError(f"{table.source.name}: has{counted}; give the sampling period with dt= (--dt) in seconds.")


def _keep_loops(given: Assignment, names: list[str], table: Table, options: Options) -> None:
    """Drop what is no loop and pick the loop that was asked for."""
    name = table.source.name
    usable = {tag: s for tag, s in given.loops.items() if _is_loop(s)}
    if given.chosen is not None:
        usable = {tag: s for tag, s in usable.items() if tag == given.chosen}
    if not usable:
        seen = ", ".join(f"{names[i]} = {role.upper()}" for s in given.loops.values() for role, i in s.items() if names)
        raise RecordError(
            f"{name}, line {max(1, table.first_line - 1)}: no loop with PV and OP was found among the columns "
            f"{', '.join(names[:20]) or '(no header)'}{f' (recognised: {seen})' if seen else ''}; "
            "say which is which with columns={'pv': ..., 'op': ...}."
        )
    others = {} if given.chosen is not None else given.loops
    if left := [tag for tag, s in others.items() if tag and tag not in usable and set(s) & set(NUMBERS)]:
        given.guesses.append(f"Left out, as PV or OP is missing: {', '.join(left[:10])}{' ...' if left[10:] else ''}.")
    if options.tag is not None and (len(usable) > 1 or "" not in usable):
        chosen = [tag for tag in usable if tag.lower() == options.tag.lower()]
        if not chosen:
            shown = ", ".join(tag or table.source.stem for tag in list(usable)[:20])
            raise RecordError(f"{name}: has no loop {options.tag!r}; its loops are {shown}.")
        usable = {chosen[0]: usable[chosen[0]]}
    if "" in given.loops and "" not in usable:
        usable[""] = {role: i for role, i in given.loops[""].items() if role in ("bad", "quality", "mode")}
    given.loops = usable


def _grid(
    given: Assignment,
    taken: Columns,
    table: Table,
    options: Options,
    names: list[str],
    units: list[str],
    numeric: bool,
) -> Grid:
    name = table.source.name
    if not given.time:
        assert options.dt is not None
        return Grid(np.arange(taken.rows), float(options.dt), guesses=["There is no time column: dt is as given."])
    first, hold, dt = given.time[0], None, options.dt
    if isinstance(table, LongTable):
        stamps, hold, dt = table.stamps, table.hold, options.dt or table.dt or None
    elif numeric:
        stamps = parse_numbers(taken.numbers[first], _unit_of_time(first, names, units))
    else:
        stamps = _stamps(given.time, taken.text, table, names, units, options)
    grid = regular_grid(stamps, dt, name, table.first_line, hold)
    grid.guesses[:0] = stamps.guesses
    return grid


def _unit_of_time(column: int, names: list[str], units: list[str]) -> float | None:
    return time_unit(names[column] if names else "", units[column] if units else "")


def _stamps(
    time: list[int],
    text: Mapping[int, list[str]],
    table: Table,
    names: list[str],
    units: list[str],
    options: Options,
) -> Stamps:
    """Time of each row from the cells of one column, or of a date and a time of day."""
    cells = text[time[0]]
    if len(time) == 2:
        cells = [f"{day} {clock}" for day, clock in zip(cells, text[time[1]], strict=True)]
    elif table.is_numeric(time[0]) and options.time_format is None:
        return parse_numbers(to_numbers(cells, table.decimal)[0], _unit_of_time(time[0], names, units))
    return parse_texts(cells, day_first=options.day_first, time_format=options.time_format)


def _widened(
    table: Table, columns: dict[str, int], given: Assignment, names: list[str], units: list[str], options: Options
) -> LongTable:
    """Lay a long table out wide, by its time column."""
    first = [row for row in table.sample if row]
    stamped = [i for i in range(len(names)) if all(i < len(row) and is_stamp(row[i]) for row in first)]
    time = Assignment(time=given.time or stamped[:1])
    if not time.time:
        raise RecordError(f"{table.source.name}: is a long table without a time column; export the time stamps too.")
    _find_time(time, table, options)
    long = widened(table, columns, time.time, lambda text: _stamps(time.time, text, table, names, units, options))
    long.guesses += time.guesses
    return long


def _made_up(table: Table, grid: Grid, columns: list[int]) -> int:
    """Samples at which a signal stands as it was stored for an earlier one, of the signal that has most of them."""
    most = 0
    for column in columns:
        stored = table.stored_at(column)[grid.pick] if isinstance(table, LongTable) else grid.pick
        most = max(most, int(np.sum((np.diff(stored) == 0) & (grid.pick[1:] >= 0))))
    return most


def _loop(
    tag: str,
    signals: dict[str, int],
    table: Table,
    taken: Columns,
    grid: Grid,
    names: list[str],
    units: list[str],
    given: Assignment,
    options: Options,
) -> LoopRecord:
    source = table.source
    shown = {role: names[i] if names else f"column {i}" for role, i in signals.items()}
    guesses = [*table.guesses, *given.guesses, *grid.guesses]
    bad_rows = flagged_rows(signals, taken, names, guesses)
    if bad_rows.all():
        raise RecordError(
            f"{source.name}: all {taken.rows} rows of {tag or source.stem} are flagged as bad; export good values, or "
            "leave out the column of the flags if it is wrong."
        )
    flagged = int(bad_rows.sum())
    texts: Counter[str] = Counter()
    values: dict[str, NDArray | None] = dict.fromkeys(NUMBERS)
    for role in NUMBERS:
        if role not in signals:
            continue
        column = taken.numbers[signals[role]].copy()
        mine = flagged_rows(signals, taken, names, guesses, role)
        if mine.any():
            guesses.append(f"{int(mine.sum())} values of {shown[role]} are flagged as bad and count as missing.")
        column[bad_rows | mine] = np.nan
        texts += Counter({text: n for text, n in taken.texts[signals[role]].items() if text})
        values[role] = x = np.where(grid.pick >= 0, column[grid.pick], np.nan)
        if role in ("op", "pv") and not np.isfinite(x).any():
            seen = next((row[signals[role]] for row in table.sample if signals[role] < len(row)), "")
            raise RecordError(
                f"{source.name}, line {table.first_line}, column {shown[role]}: holds no number for {role.upper()} "
                f"(it begins with {seen!r}); check the column or name another one with columns=."
            )
    if texts:
        listed = ", ".join(f"{n} x {text!r}" for text, n in texts.most_common(5))
        guesses.append(f"Texts in the place of numbers count as missing: {listed}.")
    if flagged:
        guesses.append(f"{flagged} rows are flagged as bad and count as missing.")
    op = values["op"]
    assert op is not None
    values["op"] = in_percent(op, units[signals["op"]].upper() if units else "", options.op_range, guesses)
    missing = ~np.isfinite(values["op"])
    if values["pv"] is not None:
        missing |= ~np.isfinite(values["pv"])
    tag = options.tag if options.tag is not None else tag or source.stem
    return LoopRecord(
        tag,
        grid.dt,
        op=values["op"],
        pv=values["pv"],
        sp=values["sp"],
        mv=values["mv"],
        valve_signal=values["valve_signal"],
        auto=automatic(signals, taken, grid, guesses),
        loop_type=options.loop_type or loop_type_of(tag),
        start=grid.start,
        provenance=Provenance(
            source=source.name,
            sha256=source.sha256,
            columns=shown,
            guesses=tuple(guesses),
            rows=taken.rows,
            bad=int(missing.sum()),
            bad_texts=dict(texts),
            clock_jumps=grid.clock_jumps,
            made_up=_made_up(table, grid, [signals[role] for role in ("op", "pv") if role in signals]),
            pv_unit=units[signals["pv"]] if units and "pv" in signals else "",
        ),
    )

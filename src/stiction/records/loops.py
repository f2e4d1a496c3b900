"""From a table to loop records: time, signals, bad values, OP scale, mode."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.records.cascade import with_slaves
from stiction.records.columns import NUMBERS, Assignment, assign, choose_names
from stiction.records.dialects import OTHER_OUTPUT_UNITS, loop_type_of
from stiction.records.epochs import parse_numbers
from stiction.records.layout import MIN_ROWS, Options, find_time, is_loop, laid_out, stamps_of, unit_of_time
from stiction.records.long_table import LongTable
from stiction.records.record import LARGEST, LoopRecord, Provenance
from stiction.records.resample import Grid, regular_grid
from stiction.records.signals import automatic, flagged_rows, in_percent, position_in_percent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.table import Columns, Table

__all__ = ["loops_of"]


def loops_of(table: Table, options: Options) -> list[LoopRecord]:
    """Every loop of a table that has a controller output.

    Raises
    ------
    RecordError
        With the one thing that keeps the table from being a record.
    """
    parts = laid_out(table, options)
    records, dead = [], []
    for part, own in parts:
        try:
            found, left = _loops_of_part(part, own)
        except RecordError as error:
            if len(parts) == 1:
                raise
            dead.append(error)
        else:
            records += found
            dead += left
    if not records:
        raise dead[0]
    told = tuple(f"Left out: {error}" for error in dead)
    records = with_slaves(records) if len(records) > 1 else records
    return [
        replace(r, provenance=replace(r.provenance, assumptions=(*r.provenance.assumptions, *told))) for r in records
    ]


def _loops_of_part(table: Table, options: Options) -> tuple[list[LoopRecord], list[RecordError]]:
    """Loops that share their times, and why others of them are none."""
    name = table.source.name
    names, units = choose_names(table.header)
    width = len(table.sample[0]) if not names else len(names)
    if not names and not options.columns:
        raise RecordError(
            f"{name}, line {table.first_line}: there is no header above the {width} columns; "
            "say what they are, for example columns={'time': 0, 'pv': 1, 'op': 2}."
        )
    given = assign(names, width, options.columns, name)
    _keep_loops(given, names, table, options)
    find_time(given, table, options)
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
        rows = count_noun(taken.rows, "row")
        raise RecordError(f"{name}: has {rows} of data; {MIN_ROWS} or more are needed, hundreds are useful.")
    shared = {role: i for role, i in given.loops.get("", {}).items() if role in ("bad", "quality", "mode")}
    records: list[LoopRecord] = []
    dead: list[RecordError] = []
    for whose, rows in _by_tag(taken, given, options, name).items():
        try:
            grid = _grid(given, rows, table, options, names, units, numeric_time)
        except RecordError as error:
            dead.append(error)
            continue
        for tag, signals in given.loops.items():
            if "op" not in signals:
                continue
            every = {**shared, **signals}
            try:
                records.append(_loop(whose or tag, every, table, rows, grid, names, units, given, options))
            except RecordError as error:
                dead.append(error)
    if not records:
        raise dead[0]
    return records, dead


def _by_tag(taken: Columns, given: Assignment, options: Options, name: str) -> dict[str, Columns]:
    """Rows of each loop where a column says whose they are; all of them under no tag where none does."""
    if given.tag is None or set(given.loops) != {""}:
        return {"": taken}
    tags = np.array([cell.strip() for cell in taken.text[given.tag]], dtype=object)
    rows = {tag: np.flatnonzero(tags == tag) for tag in dict.fromkeys(tags) if tag}
    if not _are_loops(tags, rows, taken, given):
        given.guesses.append("The column of names is not taken as one of tags: its rows follow one another in time.")
        return {"": taken}
    if short := [tag for tag, own in rows.items() if own.size < MIN_ROWS]:
        given.guesses.append(f"Left out, as they have fewer than {MIN_ROWS} rows: {', '.join(short[:10])}.")
    rows = {tag: own for tag, own in rows.items() if own.size >= MIN_ROWS}
    if options.tag is not None and rows:
        asked = {tag: own for tag, own in rows.items() if tag.lower() == options.tag.lower()}
        if not asked:
            raise RecordError(f"{name}: has no loop {options.tag!r}; its loops are {', '.join(list(rows)[:20])}.")
        rows = asked
    return {tag: taken.part(own) for tag, own in rows.items()} or {"": taken}


def _are_loops(tags: NDArray, rows: dict[str, NDArray], taken: Columns, given: Assignment) -> bool:
    """Whether names are tags, not batches or operators: they say what is controlled, or have rows at the same time."""
    if sum(own.size for own in rows.values()) < 0.9 * len(tags):
        return False
    if all(loop_type_of(tag) != "other" for tag in rows):
        return True
    times = list(zip(*(taken.text.get(i, taken.numbers.get(i)) for i in given.time), strict=True))
    changes = int(np.sum(tags[1:] != tags[:-1]))
    return len(rows) > 1 and len(times) - len(set(times)) > changes // 2


def _keep_loops(given: Assignment, names: list[str], table: Table, options: Options) -> None:
    """Drop what is no loop and pick the loop that was asked for."""
    name = table.source.name
    usable = {tag: s for tag, s in given.loops.items() if is_loop(s)}
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
        stamps = parse_numbers(taken.numbers[first], unit_of_time(first, names, units))
    else:
        stamps = stamps_of(given.time, taken.text, table, names, units, options)
    grid = regular_grid(stamps, dt, name, table.first_line, hold, taken.differ)
    grid.guesses[:0] = stamps.guesses
    return grid


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
            guesses.append(f"Missing: {count_noun(int(mine.sum()), 'value')} of {shown[role]}, flagged as bad.")
        if mine.all():
            raise RecordError(f"{source.name}: all values of {shown[role]} are flagged as bad; export good ones.")
        column[bad_rows | mine] = np.nan
        texts += Counter({text: n for text, n in taken.texts[signals[role]].items() if text})
        values[role] = x = np.where(grid.pick >= 0, column[grid.pick], np.nan)
        if role in ("op", "pv") and not np.isfinite(x).any():
            seen = next((row[signals[role]] for row in table.sample if signals[role] < len(row)), "")
            raise RecordError(
                f"{source.name}, line {table.first_line}, column {shown[role]}: holds no number up to "
                f"{LARGEST:g} for {role.upper()} (it begins with {seen!r}); check the column or name another one with "
                "columns=."
            )
    if texts:
        listed = ", ".join(f"{n} x {text!r}" for text, n in texts.most_common(5))
        guesses.append(f"Texts in the place of numbers count as missing: {listed}.")
    if flagged:
        guesses.append(f"Missing: {count_noun(flagged, 'row')}, flagged as bad.")
    op = values["op"]
    assert op is not None
    unit = {role: units[i].upper() if units else "" for role, i in signals.items()}
    values["op"] = in_percent(op, units[signals["op"]] if units else "", options.op_range, guesses)
    left = values["op"] is op and unit["op"] in (*OTHER_OUTPUT_UNITS, "MA")
    op = values["op"]
    if values["mv"] is not None:
        own = options.mv_range or (options.op_range if unit["mv"] and unit["mv"] == unit["op"] else None)
        values["mv"] = position_in_percent(values["mv"], unit["mv"], own, op, options.op_range, guesses)
    missing = ~np.isfinite(values["op"])
    if values["pv"] is not None:
        missing |= ~np.isfinite(values["pv"])
    named = options.tag if options.tag is not None else tag
    loop_type = options.loop_type or loop_type_of(named or source.stem, numbered=not named)
    if not (named or options.loop_type or loop_type == "other"):
        kind = f"{'an' if loop_type == 'analyser' else 'a'} {loop_type}"
        guesses.append(f"The file's name speaks of {kind} loop; give loop_type if it is another.")
    return LoopRecord(
        named or source.stem,
        grid.dt,
        op=values["op"],
        pv=values["pv"],
        sp=values["sp"],
        mv=values["mv"],
        valve_signal=values["valve_signal"],
        auto=automatic(signals, taken, grid, guesses),
        loop_type=loop_type,
        start=grid.start,
        provenance=Provenance(
            source=source.name,
            sha256=source.sha256,
            columns=shown,
            assumptions=tuple(guesses),
            rows=taken.rows,
            missing_samples=int(missing.sum()),
            bad_values=dict(texts),
            clock_jumps=grid.clock_jumps,
            summer_time=grid.summer_time,
            held_samples=_made_up(table, grid, [signals[role] for role in ("op", "pv") if role in signals]),
            pv_unit=units[signals["pv"]] if units and "pv" in signals else "",
            op_unit=units[signals["op"]] if left else "",
        ),
    )

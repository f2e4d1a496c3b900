"""From the columns of one loop to a `LoopRecord`: numbers, bad values, one clock, % of span."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError, Setting
from stiction.records.quality.compression import is_stored_on_change
from stiction.records.quality.quantisation import robust_range
from stiction.records.record import LoopRecord, Provenance
from stiction.sources.layouts.headings import table_headings
from stiction.sources.roles.loop_roles import NUMERIC_ROLES, column_label
from stiction.sources.roles.vocabulary import loop_type_of
from stiction.sources.signal_values import EmptySignalError, parse_signals, refuse_without_numbers
from stiction.sources.time.align import TagSeries, align_tags
from stiction.sources.time.grid import Grid, regular_grid
from stiction.sources.time.time_columns import missing_time_error
from stiction.sources.time.time_order import has_two_levels
from stiction.sources.values.bad_values import find_bad_values
from stiction.sources.values.quality_codes import automatic_mask
from stiction.sources.values.span import op_to_percent, position_to_percent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.signal_values import SignalValues
    from stiction.sources.table import TagColumn

    _Sampled = tuple[Grid, dict[str, NDArray[np.float64]], NDArray[np.bool_] | None, int, int]

__all__ = ["MIN_ROWS", "RecordBuilder"]

MIN_ROWS = 10
"""Rows that a loop must have [-]."""


@dataclass(eq=False)
class RecordBuilder:
    """Builds the records of one source; the grid of a clock that loops share is laid once."""

    options: ReadOptions
    grids: dict[int, Grid] = field(default_factory=dict)

    def build(self, loop: LoopRoles) -> LoopRecord:
        """Build the record of one loop; where its quality codes can be read in several ways, with the other records."""
        columns = {role: loop.roles[role] for role in NUMERIC_ROLES if role in loop.roles}
        first, *others = parse_signals(loop, columns, self.options)
        record = self._build(loop, columns, first)
        readable = []
        for other in others:
            with suppress(EmptySignalError):
                readable.append(self._build(loop, columns, other))
        return replace(record, other_readings=tuple(readable)) if readable else record

    def _build(self, loop: LoopRoles, columns: dict[str, TagColumn], parsed: SignalValues) -> LoopRecord:
        """Build the record of one loop for one way to read its quality codes."""
        origin = columns["op"].table.origin
        notes = [*dict.fromkeys(note for column in columns.values() for note in column.table.notes), *loop.notes]
        values, units, bad = parsed.values, parsed.units, parsed.bad
        notes += bad.notes
        grid, signals, auto, held, unchanged = self._sample(loop, columns, values)
        notes += grid.notes
        for role in ("op", "pv"):
            if role in signals and not np.isfinite(signals[role]).any():
                refuse_without_numbers(loop, role, bad)
        position = signals.get("mv")
        op = op_to_percent(
            signals["op"], units["op"],
            op_range=self.options.op_range or loop.spans.get("op"), position=position,
            position_unit=units.get("mv", ""),
        )  # fmt: skip
        notes += op.notes
        if position is not None:
            op_range = self.options.op_range or loop.spans.get("op")
            same_unit = op_range if units["mv"] and units["mv"].upper() == units["op"].upper() else None
            mv_range = self.options.mv_range or loop.spans.get("mv") or same_unit
            mv = position_to_percent(position, units["mv"], op.values, mv_range=mv_range, op_range=op_range)
            signals["mv"], notes = mv.values, [*notes, *mv.notes]
        spreads = {role: _relative_spread(column, values[role]) for role, column in columns.items() if column.spread}
        missing = ~np.isfinite(op.values)
        if "pv" in signals:
            missing |= ~np.isfinite(signals["pv"])
        name = self.options.tag if self.options.tag is not None and loop.tag in ("", self.options.tag) else loop.tag
        loop_type = self.options.loop_type or loop.loop_type
        if loop_type == "other":
            loop_type = loop_type_of(name or origin.stem, numbered=not name)
            if not name and loop_type != "other":
                notes.append(
                    f"The file name says loop type {loop_type}; if that is wrong give the loop type (loop_type)."
                )
        return LoopRecord(
            name or origin.stem,
            grid.dt,
            op=op.values,
            pv=signals.get("pv"),
            sp=signals.get("sp"),
            mv=signals.get("mv"),
            valve_signal=signals.get("valve_signal"),
            auto=auto,
            loop_type=loop_type,
            start=grid.start,
            provenance=Provenance(
                source=origin.name,
                sha256=origin.sha256,
                columns={role: column_label(column) for role, column in loop.roles.items()},
                assumptions=tuple(dict.fromkeys(notes)),
                rows=max(len(x) for x in values.values()),
                missing_samples=int(missing.sum()),
                bad_values=bad.counts,
                clock_jumps=grid.clock_jumps,
                summer_time=grid.dst_changes,
                held_samples=held,
                unchanged_samples=unchanged,
                interval_spread=max(spreads.values(), default=0.0),
                pv_unit=units.get("pv", ""),
                op_unit=op.unit,
                unused_columns=tuple(loop.unused),
                quality_reading=parsed.reading,
            ),
        )

    def _sample(self, loop: LoopRoles, columns: dict[str, TagColumn], values: dict[str, NDArray]) -> _Sampled:
        """Put the signals on one even grid; also give the samples in automatic, those held, and those unchanged."""
        if self.options.dt is None:
            _refuse_two_levels(columns, values)
        clocks = {id(column.clock) for column in columns.values()}
        if len(clocks) > 1 or any(column.own_clock for column in columns.values()):
            return self._align(loop, columns, values)
        key = id(columns["op"].clock)
        if key not in self.grids:
            self.grids[key] = self._lay_grid(columns["op"], [*loop.roles.values()])
        grid, rows = self.grids[key], self.grids[key].source_row
        signals = {role: np.where(rows >= 0, x[rows], np.nan) for role, x in values.items()}
        notes = list(grid.notes)
        auto = _automatic(loop, rows, notes)
        held = int(np.sum((np.diff(rows) == 0) & (rows[1:] >= 0)))
        return replace(grid, notes=notes), signals, auto, held, 0

    def _lay_grid(self, column: TagColumn, shared: list[TagColumn]) -> Grid:
        table = column.table
        if column.clock is None:
            if self.options.dt is None:
                used = {one.position for one in shared if one.position is not None}
                raise missing_time_error(table, table_headings(table).names, used)
            note = "There is no time column: the sampling period is the given one."
            return Grid(np.arange(len(column.cells)), self.options.dt, notes=[note])
        stamps = column.clock.stamps
        if stamps.seconds.size < MIN_ROWS:
            raise RecordError(
                f"has {count_noun(stamps.seconds.size, 'row')} of data; {MIN_ROWS} or more are "
                "needed, hundreds are useful.",
                where=table.origin.name,
            )
        cells = [one.cells for one in shared if one.clock is column.clock]

        def rows_differ(one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
            unlike = np.zeros(len(one), dtype=bool)
            for series in cells:
                unlike |= series.gather(one).ne_missing(series.gather(other)).to_numpy()
            return unlike

        grid = regular_grid(
            stamps, dt=self.options.dt, name=table.origin.name, first_line=table.first_line,
            max_hold=self.options.max_gap, rows_differ=rows_differ,
        )  # fmt: skip
        grid.notes[:0] = stamps.notes
        return grid

    def _align(self, loop: LoopRoles, columns: dict[str, TagColumn], values: dict[str, NDArray]) -> _Sampled:
        """Put signals with time stamps of their own on one grid."""
        tags = {**columns, **({"mode": loop.roles["mode"]} if "mode" in loop.roles else {})}
        method = {"sp": "hold", "mode": "hold"}
        series = []
        for role, column in tags.items():
            if column.clock is None:
                raise RecordError(
                    f"column {column_label(column)} has no time stamps; export them too.",
                    where=column.table.origin.name,
                )
            default = method.get(role, "last" if role == "op" else self.options.align or "last")
            series.append(TagSeries(column_label(column), column.clock.stamps, values.get(role), default))
        table = columns["op"].table
        aligned = align_tags(
            series,
            dt=self.options.dt,
            max_gap=self.options.max_gap,
            name=table.origin.name,
            first_line=table.first_line,
        )
        signals = {role: x for role, x in zip(tags, aligned.values, strict=True) if x is not None}
        states = find_bad_values(signals)
        signals = {role: np.where(states.masks[role], np.nan, x) for role, x in signals.items()}
        notes = [*aligned.notes, *states.notes]
        auto = _automatic(loop, aligned.rows[list(tags).index("mode")], notes) if "mode" in tags else None
        held = {role: n for role, n in zip(tags, aligned.held_samples, strict=True) if role in ("op", "pv")}
        seconds = {role: clock.stamps.seconds for role in held if (clock := tags[role].clock)}
        changing = [role for role, times in seconds.items() if is_stored_on_change(values[role], times)]
        if changing:
            named = " and ".join(column_label(tags[role]) for role in changing)
            notes.append(f"{named}: stored only when it had changed, so it is held until the next value.")
        most = max(held.values())
        unchanged = most - max((n for role, n in held.items() if role not in changing), default=0)
        return replace(aligned, notes=notes), signals, auto, most, unchanged


def _refuse_two_levels(columns: dict[str, TagColumn], values: dict[str, NDArray]) -> None:
    """Raise a RecordError where the values of one time come from two levels, as the series of two loops do."""
    for role, column in columns.items():
        if column.clock is not None and has_two_levels(column.clock.stamps.seconds, values[role]):
            raise RecordError(
                f"{column_label(column)} has values of several levels at each time, as several loops under one name "
                "have",
                remedy=(
                    "export the column that tells the loops apart, or one loop at a time; if it is one loop that is "
                    "sampled several times at each stamp, give ",
                    Setting("dt"),
                ),
                where=column.table.origin.name,
            )  # fmt: skip


def _relative_spread(column: TagColumn, averages: NDArray[np.float64]) -> float:
    """Median range of a signal within the intervals of its averages, over the 98 % range of these [-]."""
    spread = column.spread() if column.spread else np.empty(0)
    known, width = spread[np.isfinite(spread)], robust_range(averages)
    return float(np.median(known)) / width if known.size and width > 0.0 else 0.0


def _automatic(loop: LoopRoles, rows: NDArray[np.int64], notes: list[str]) -> NDArray[np.bool_] | None:
    """Mark the samples in automatic by the rows that stand at them, the last row where none does; add to the notes."""
    if "mode" not in loop.roles or len(loop.roles["mode"].cells) <= rows.max():
        return None
    mask, mode_notes = automatic_mask(loop.roles["mode"].cells)
    notes += mode_notes
    last = np.maximum.accumulate(np.where(rows >= 0, np.arange(rows.size), -1))
    last = np.where(last < 0, int(np.argmax(rows >= 0)), last)
    return None if mask is None else mask[rows[last]]

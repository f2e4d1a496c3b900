"""What the user says about a source, checked once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import NoneType
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, require_finite, require_kind, require_positive
from stiction.sources.memory import parse_memory

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["FIXED_OFFSET", "MAX_BYTES", "MAX_RATIO", "ReadOptions"]

MAX_BYTES = 2_000_000_000
"""Size up to which a file is read, after decompression [bytes]."""
MAX_RATIO = 200
"""Decompressed size over compressed size up to which a file is read [-]."""
FIXED_OFFSET = re.compile(r"([+-])(\d\d):(\d\d)")
"""A time zone as its difference to UTC."""


@dataclass(frozen=True)
class ReadOptions:
    """Options of `stiction.read`, see there; raises ParameterError for one outside its limits."""

    dt: float | None = None
    tag: str | None = None
    columns: Mapping[str, str | int] = field(default_factory=dict)
    loop_type: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    time_format: str | None = None
    timezone: str | None = None
    op_range: tuple[float, float] | None = None
    mv_range: tuple[float, float] | None = None
    day_first: bool | None = None
    map: str | PathLike[str] | None = None
    sheet: str | None = None
    align: str | None = None
    """"last" or "interpolate": how tags with time stamps of their own go on one clock; None chooses per tag."""
    max_gap: float | None = None
    """Longest time over which a value is held or interpolated when tags are aligned [s]."""
    max_bytes: int = MAX_BYTES
    max_memory: int | None = None
    """Memory that the reading of a loop may take [bytes], also as "2GB"; None: half of the machine."""
    good_codes: tuple[str, ...] = ()
    """Codes of the quality columns that are good; all others are bad. Empty: by the schemes of the vendors."""
    keep_uncertain: bool = False
    """Whether values of uncertain quality are used."""

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("dt", "max_gap"):
            if (value := getattr(self, name)) is not None:
                put(self, name, require_positive(name, value, "s"))
        for name in ("tag", "loop_type", "delimiter", "decimal", "time_format", "timezone", "sheet", "align"):
            require_kind(name, getattr(self, name), (str, NoneType), "a text")
        require_kind("day_first", self.day_first, (bool, NoneType), "True or False")
        if self.decimal not in (None, ".", ","):
            raise ParameterError(f"decimal = {self.decimal!r} is not a decimal mark; give '.' or ','.")
        if self.delimiter is not None and (len(self.delimiter) != 1 or self.delimiter in "\r\n\"'"):
            raise ParameterError(
                f"delimiter = {self.delimiter!r} is not one character; give for example ',' or ';' or a tab."
            )
        if self.align not in (None, "last", "interpolate"):
            raise ParameterError(f"align = {self.align!r} is unknown; give 'last' or 'interpolate'.")
        if isinstance(self.max_bytes, bool) or not isinstance(self.max_bytes, int) or self.max_bytes < 1:
            raise ParameterError(
                f"max_bytes = {self.max_bytes!r} is not a positive number of bytes; give for example 2e9."
            )
        if self.max_memory is not None:
            put(self, "max_memory", parse_memory(self.max_memory))
        if not isinstance(self.columns, Mapping):
            raise ParameterError(
                f"columns = {self.columns!r} does not map signals to columns; give for example columns={{'op': 'CO'}}."
            )
        for signal, column in self.columns.items():
            require_kind("a signal of columns", signal, str, "its name, as in columns={'op': 'CO'}")
            if isinstance(column, bool) or not (isinstance(column, str) or hasattr(column, "__index__")):
                raise ParameterError(
                    f"columns[{signal!r}] = {column!r} is neither a name nor a number; give the name or the number of "
                    "a column."
                )
        codes = self.good_codes.split(",") if isinstance(self.good_codes, str) else self.good_codes
        put(self, "good_codes", tuple(text for code in codes if (text := str(code).strip().upper())))
        require_kind("keep_uncertain", self.keep_uncertain, bool, "True or False")
        put(self, "columns", {signal.lower(): column for signal, column in self.columns.items()})
        put(self, "op_range", _span("op_range", "OP", self.op_range))
        put(self, "mv_range", _span("mv_range", "valve position", self.mv_range))
        if self.timezone is not None:
            _require_timezone(self.timezone)


def _span(name: str, what: str, span: Any) -> tuple[float, float] | None:
    """Check the value of a signal at 0 and at 100 % of span."""
    if span is None:
        return None
    try:
        zero, full = span
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} = {span!r} is not a pair of numbers; give the {what} at 0 % and at 100 %, for example (4, 20)."
        ) from None
    low, high = require_finite(name, zero), require_finite(name, full)
    if not low < high:
        raise ParameterError(
            f"{name} = ({low:g}, {high:g}) is an empty range; give the {what} at 0 % and a larger one at 100 %."
        )
    return low, high


def _require_timezone(name: str) -> None:
    from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

    if FIXED_OFFSET.fullmatch(name):
        return
    try:
        ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise ParameterError(
            f"timezone = {name!r} is unknown; give a name such as 'Europe/Berlin', 'UTC' or '+01:00'."
        ) from None

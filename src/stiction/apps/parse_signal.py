"""Make signals from text: ``150,160@600`` for changing levels, ``ramp:start=0,stop=20,rate=0.1`` for test signals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.parse_model import build_model, split_spec
from stiction.errors import ParameterError, RecordError, Setting, require_finite, require_samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records import LoopRecord

__all__ = ["SIGNALS", "parse_levels", "parse_op_signal"]

SIGNALS = ("ramp", "triangle", "sine", "staircase", "random_walk", "binary_sequence")


def parse_levels(name: str, spec: str | float, duration: float, dt: float) -> NDArray[np.float64]:
    """Read a level, or levels that change at given times.

    `name`: name of the signal, for the error. `spec`: ``LEVEL`` or ``LEVEL,LEVEL@TIME,...`` with times in seconds,
    ascending. `duration`, `dt`: length and sampling period [s]. Returns one level for each sample. Raises
    ParameterError when a level or a time cannot be read, the times are not ascending, or the duration is too long.

    Examples
    --------
    >>> parse_levels("sp", "50,55@2", duration=4.0, dt=1.0).tolist()
    [50.0, 50.0, 55.0, 55.0]
    """
    if not (dt > 0.0 and duration >= dt):
        raise ParameterError(f"dt = {dt:g} s does not fit into duration = {duration:g} s; give 0 < dt <= duration.")
    require_samples("duration", duration, dt)
    n = round(duration / dt)
    series = np.empty(n)
    last = 0.0
    for k, part in enumerate(str(spec).split(",")):
        level, at, time = (piece.strip() for piece in part.partition("@"))
        if (not at) != (k == 0):
            raise ParameterError(
                f'{name} = "{spec}" cannot be read; write LEVEL,LEVEL@SECONDS,..., for example 50,55@600.'
            )
        start = require_finite(f"time in {name}", time, "s") if at else 0.0  # pyright: ignore[reportArgumentType]
        if start < last or (at and start >= duration):
            raise ParameterError(f"{name} changes at {start:g} s; give increasing times below {duration:g} s.")
        series[round(start / dt) :] = require_finite(name, level)  # pyright: ignore[reportArgumentType]
        last = start
    return series


def parse_op_signal(spec: str, dt: float) -> tuple[NDArray[np.float64], float]:
    """Make the input of a valve from the name of a test signal or of a CSV file with an OP.

    `spec`: ``NAME:PARAMETER=VALUE,...`` with a name of `SIGNALS`, or the name of a file ("-" is the standard input).
    `dt`: sampling period [s]; not used for a file. Returns `op`: controller output [% of span]; `dt`: sampling period
    [s]. Raises ParameterError when the signal or a parameter is unknown. Raises RecordError when the file cannot be
    read.

    Examples
    --------
    >>> parse_op_signal("staircase:levels=50 51 50,hold=2", dt=1.0)[0].tolist()
    [50.0, 50.0, 51.0, 51.0, 50.0, 50.0]
    """
    name, colon, _ = spec.partition(":")
    if not colon and spec.strip().lower().replace("-", "_") not in SIGNALS:
        return _read_op(spec)
    from stiction.simulation import input_signals

    makers: dict[str, Any] = {known: getattr(input_signals, known) for known in SIGNALS}
    name, given = split_spec("op", spec.replace(name, name.replace("-", "_"), 1))
    seed = given.get("seed")
    if isinstance(seed, str) and seed.isdigit():
        given["seed"] = int(seed)
    lengths = {key: _number(given.get(key)) for key in ("duration", "hold")}
    if (rate := _number(given.get("rate"))) > 0.0:
        lengths["ramp"] = abs(_number(given.get("stop")) - _number(given.get("start"))) / rate
    for what, seconds in lengths.items():
        require_samples(what, seconds, dt)
    return build_model("op signal", name, makers, {"dt": dt, **given}), dt


def _number(text: Any) -> float:
    """Return a number, or 0 for other text, which the function that makes the signal will refuse."""
    try:
        return float(text)
    except (TypeError, ValueError):
        return 0.0


def _read_op(path: str) -> tuple[NDArray[np.float64], float]:
    from stiction.records.quality import find_outliers
    from stiction.sources import read

    try:
        records = read(path)
    except RecordError:
        if path == "-":
            raise
        records = _read_plan(path)
    if len(records) > 1:
        tags = ", ".join(record.tag for record in records)
        raise RecordError(f"contains {len(records)} loops ({tags}); give a file with one OP column.", where=path)
    op = records[0].op
    # A code for a bad value would be a stroke of the valve, far beyond its stops.
    if np.any(codes := find_outliers(op) & ((op < 0.0) | (op > 100.0))):
        seen = float(op[codes][0])
        raise RecordError(
            f"{int(codes.sum())} samples of OP, such as {seen:g} %, lie outside 0 to 100 % and far from "
            "all others; remove or correct them first.",
            where=path,
        )
    if not np.all(np.isfinite(op)):
        raise RecordError(
            f"{int(np.sum(~np.isfinite(op)))} samples of OP are missing; fill or remove them first.", where=path
        )
    return op, records[0].dt


def _read_plan(path: str) -> list[LoopRecord]:
    """Read a plan, which has time and OP only; the OP also stands for the stem that the reader needs."""
    from stiction.sources import read

    try:
        return read(path, columns={"op": "OP", "mv": "OP"})
    except RecordError as error:
        if not any(isinstance(part, Setting) and part.name == "columns" for part in error.remedy):
            raise
        remedy = "give a file with one column of times and one called OP"
        raise RecordError(*error.args, remedy=remedy, where=error.where) from None

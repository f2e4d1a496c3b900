"""One loop's recorded (or simulated) signals: the noun that flows through the whole package."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from datetime import timedelta
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import ParameterError, RecordError, as_floats, import_extra, require_positive
from stiction.records.gaps import missing_mask
from stiction.records.provenance import UNKNOWN_UNIT, Provenance
from stiction.records.quality.op_scale import detect_op_scale
from stiction.records.quality.outliers import find_record_outliers

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "LOOP_TYPES",
    "LOOP_TYPE_SYNONYMS",
    "LoopRecord",
    "Provenance",
    "mask_outliers",
    "missing_pv_hint",
    "require_record",
]

LOOP_TYPES = ("flow", "level", "pressure", "temperature", "analyser", "other")
LOOP_TYPE_SYNONYMS = {"concentration": "analyser"}
"""Other words for a loop type -> the word that a record stores."""
LARGEST = 1e100
"""Size above which a value counts as missing [any unit]."""
_SIGNALS = ("op", "pv", "sp", "mv", "valve_signal", "auto")


@dataclass(frozen=True)
class LoopRecord:
    """Evenly sampled signals of one control loop; NaN marks a missing value.

    Float arrays are stored without a copy. Infinite values, values beyond 1e100 and masked values are missing too.
    Records are equal when all their fields are; NaN equals NaN.

    Parameters
    ----------
    tag : str
        Name of the loop in the plant.
    dt : float
        Sampling period [s].
    op : array_like, shape (n_samples,)
        Controller output [% of span]; `op_unit` tells when it looks like another unit.
    pv : array_like, shape (n_samples,), optional
        Process variable [engineering units].
    sp : array_like, shape (n_samples,), optional
        Set point [engineering units of the PV]; None when all of it is missing, as `mv` and `valve_signal` are then.
    mv : array_like, shape (n_samples,), optional
        Valve position really reached [% of span].
    valve_signal : array_like, shape (n_samples,), optional
        Output of a compensator between controller and valve [% of span]; None when the valve received OP.
    auto : array_like of bool, shape (n_samples,), optional
        True where the controller was in automatic; None when not recorded.
    loop_type : str
        One of `LOOP_TYPES`; "concentration" is stored as "analyser".
    integrating : bool, optional
        Whether the process integrates. By default a level does, type "other" is unknown (None), others do not.
    start : datetime, optional
        Time of the first sample.
    provenance : Provenance
        Where the record comes from.
    other_readings : tuple of LoopRecord
        The same loop, where the source has quality codes that can also be read in another way.

    Raises
    ------
    RecordError
        When the signals are not one-dimensional or differ in length, or `auto` has a missing value.
    ParameterError
        When `dt` is not positive or `loop_type` is unknown.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 1.0, op=[50.0, 51.0], pv=[3.0, 3.1], loop_type="flow")
    >>> len(record), record.duration, record == record.window(0, 2)
    (2, 2.0, True)
    """

    tag: str
    dt: float
    op: NDArray[np.float64]
    pv: NDArray[np.float64] | None = None
    sp: NDArray[np.float64] | None = None
    mv: NDArray[np.float64] | None = None
    auto: NDArray[np.bool_] | None = None
    loop_type: str = "other"
    integrating: bool | None = None
    start: datetime | None = None
    provenance: Provenance = field(default_factory=Provenance)
    valve_signal: NDArray[np.float64] | None = None
    other_readings: tuple[LoopRecord, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "dt", require_positive("dt", self.dt, "s"))
        put(self, "loop_type", LOOP_TYPE_SYNONYMS.get(self.loop_type, self.loop_type))
        if self.loop_type not in LOOP_TYPES:
            raise ParameterError(f"loop_type {self.loop_type!r} is unknown; use one of {', '.join(LOOP_TYPES)}.")
        if self.integrating is None:
            put(self, "integrating", None if self.loop_type == "other" else self.loop_type == "level")
        put(self, "op", _signal("op", self.op, None))
        n = self.op.shape[0]
        for name in ("pv", "sp", "mv", "valve_signal"):
            value = getattr(self, name)
            if value is not None:
                signal = _signal(name, value, n)
                unknown = name != "pv" and n > 0 and bool(np.isnan(signal).all())
                put(self, name, None if unknown else signal)
        if self.auto is not None:
            put(self, "auto", _mode(self.auto, n))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LoopRecord):
            return NotImplemented
        return all(_same(getattr(self, each.name), getattr(other, each.name)) for each in fields(self))

    def __hash__(self) -> int:
        return hash((self.tag, self.dt, len(self)))

    def __len__(self) -> int:
        return int(self.op.shape[0])

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        *,
        tag: str = "frame",
        op: str = "op",
        pv: str = "pv",
        sp: str | None = "sp",
        mv: str | None = "mv",
        auto: str | None = "auto",
        time: str = "time",
        dt: float | None = None,
        loop_type: str = "other",
    ) -> LoopRecord:
        """Make a record of named columns of a data frame with even steps; `stiction.read` guesses and repairs more.

        Parameters
        ----------
        frame : data frame
            Of pandas, polars or pyarrow.
        tag : str
            Name of the loop.
        op, pv : str
            Columns of the controller output [% of span] and the process variable [engineering units].
        sp, mv, auto : str, optional
            Columns of set point, valve position [% of span] and automatic mode; left out when the frame has none.
        time : str
            Column of the time, in seconds or as time stamps; not needed with `dt`.
        dt : float, optional
            Sampling period [s]; the step of the time column when not given.
        loop_type : str
            As in `LoopRecord`.

        Raises
        ------
        RecordError
            When OP, PV or the time is missing, or the time steps differ by more than 1 %.
        ParameterError
            When what is given is no data frame.

        Examples
        --------
        >>> import polars as pl
        >>> from stiction.records import LoopRecord
        >>> frame = pl.DataFrame({"time": [0.0, 2.0, 4.0], "op": [50.0, 51.0, 50.0], "pv": [3.0, 3.1, 3.2]})
        >>> record = LoopRecord.from_frame(frame, tag="FIC-101")
        >>> record.dt, record.pv.tolist()
        (2.0, [3.0, 3.1, 3.2])
        """
        from stiction.records.frames import read_columns

        names = {"op": op, "pv": pv, "sp": sp, "mv": mv, "auto": auto}
        return cls(tag, loop_type=loop_type, **read_columns(frame, names, time=time, dt=dt, tag=tag))

    def to_frame(self, native: str = "polars") -> Any:
        """Make a data frame of "polars", "pandas" or "pyarrow"; see `stiction.records.frames.to_frame`."""
        from stiction.records.frames import to_frame

        return to_frame(self, native)

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write a Parquet file from which `stiction.read` gives an equal record; see `stiction.records.to_parquet`."""
        from stiction.records.parquet_writer import to_parquet

        to_parquet(self, path)

    def plot(self, axes: Any = None) -> NDArray[np.object_]:
        """Draw PV with set point, and below it OP with the valve position, on new or two given Axes; return these."""
        import_extra("matplotlib", "plot")
        from stiction.display.plots import plot_record

        if axes is not None and np.shape(np.asarray(axes, dtype=object)) != (2,):
            raise ParameterError("axes is not a sequence of two Axes; give one for PV and one for OP.")
        return plot_record(self, axes)

    def __repr__(self) -> str:
        """Tag, length and kind in one line."""
        return f"<LoopRecord {self.tag}: {len(self)} samples every {self.dt:g} s, {self.loop_type or 'type unknown'}>"

    def _repr_html_(self) -> str:
        from stiction.display.notebook import record_html

        return record_html(self)

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the start [s], shape (n_samples,)."""
        return np.arange(len(self), dtype=np.float64) * self.dt

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return len(self) * self.dt

    @property
    def missing_percent(self) -> float:
        """Samples in which OP or PV is missing [%]."""
        return 100.0 * float(np.mean(missing_mask(self.op, self.pv))) if len(self) else 0.0

    @property
    def samples_per_stored_value(self) -> int:
        """Samples for which the reader repeats a stored value, on average and rounded up [-]; 1 for an even record."""
        return -(-len(self) // max(1, len(self) - self.provenance.held_samples))

    @cached_property
    def op_in_percent(self) -> bool:
        """Whether OP is in % of span, as far as is known: by its header, and by its values without outliers."""
        if self.provenance.op_unit:
            return False
        op = mask_outliers(self).op
        known = op[np.isfinite(op)]
        return known.size == 0 or detect_op_scale(float(known.min()), float(known.max())) == "percent"

    @property
    def op_unit(self) -> str:
        """Unit of OP, and so of S and J: "% of span", or that of the source, or "OP units" when it is not known.

        Examples
        --------
        >>> from stiction.records import LoopRecord
        >>> LoopRecord("FIC-101", 1.0, op=[50.0, 51.0]).op_unit, LoopRecord("FIC-101", 1.0, op=[0.50, 0.51]).op_unit
        ('% of span', 'OP units')
        """
        if self.op_in_percent:
            return "% of span"
        return self.provenance.op_unit if self.provenance.op_unit not in ("", UNKNOWN_UNIT) else "OP units"

    @property
    def op_unit_short(self) -> str:
        """Unit of OP after a number in a sentence: "%", that of the source, or "OP units"."""
        return self.op_unit.removesuffix(" of span")

    def window(self, first: int, last: int, every: int = 1) -> LoopRecord:
        """Cut the samples `first` <= k < `last`, or every n-th of them, as a record of their own.

        In its provenance `missing_samples` is counted again, `held_samples` is scaled with the length, and
        `clock_jumps` stays as an upper bound.

        Parameters
        ----------
        first, last : int
            First sample and one past the last; a negative one counts from the end.
        every : int, default 1
            Samples from one that is taken to the next.

        Returns
        -------
        LoopRecord
            The signals between them; `start` is the time of the first one.

        Examples
        --------
        >>> from datetime import datetime
        >>> from stiction.records import LoopRecord
        >>> record = LoopRecord("FIC-101", 60.0, op=[50.0, 51.0, 52.0], start=datetime(2026, 3, 2))
        >>> str(record.window(1, 3).start), record.window(1, 3).op
        ('2026-03-02 00:01:00', array([51., 52.]))
        """
        begin, end, _ = slice(first, last).indices(len(self))
        parts: dict[str, Any] = {
            name: None if getattr(self, name) is None else getattr(self, name)[begin:end:every] for name in _SIGNALS
        }
        missing = missing_mask(parts["op"], parts["pv"])
        share, now = missing.size / max(1, len(self)), self.provenance
        held, unchanged = round(now.held_samples * share), round(now.unchanged_samples * share)
        origin = replace(
            now, missing_samples=int(missing.sum()), held_samples=held, unchanged_samples=min(unchanged, held)
        )
        start = self.start and self.start + timedelta(seconds=begin * self.dt)
        others = tuple(other.window(first, last, every) for other in self.other_readings)
        return replace(self, **parts, dt=self.dt * every, start=start, provenance=origin, other_readings=others)


def mask_outliers(record: LoopRecord) -> LoopRecord:
    """Return a record in which outliers of OP, PV and valve position are missing, and counted.

    It is the same record when there are none, or when they were masked before: the rest would show others.
    """
    if record.provenance.outliers:
        return record
    signals = {name: x for name in ("op", "pv", "mv") if (x := getattr(record, name)) is not None}
    masks = find_record_outliers(signals, record.sp, samples_per_value=record.samples_per_stored_value)
    count = int(sum(mask.sum() for mask in masks.values()))
    if not count:
        return record
    masked = {name: np.where(masks[name], np.nan, x) for name, x in signals.items()}
    examples = ", ".join(f"{name.upper()} {signals[name][m][0]:.4g}" for name, m in masks.items() if m.any())
    values = f"{count_noun(count, 'value')} far from all others {'is' if count == 1 else 'are'}"
    added = f"{values} taken as missing (such as {examples})."
    origin = record.provenance
    origin = replace(origin, assumptions=(*origin.assumptions, added), outliers=origin.outliers + count)
    return replace(record, **masked, provenance=origin)


def require_record(record: object) -> None:
    """Raise a RecordError unless `record` is a LoopRecord."""
    if isinstance(record, LoopRecord):
        return
    if isinstance(record, (list, tuple)):
        raise RecordError(
            f"record is a list of {len(record)} records, which stiction.read returns; use them one by one."
        )
    if isinstance(record, (str, PathLike)):
        raise RecordError(
            f"record = {str(record)!r} is a path; read it with stiction.read(...), and use its records one by one."
        )
    raise RecordError(
        f"record is of type {type(record).__name__}, not a LoopRecord; give a record that stiction.read(...) "
        "returned, or st.LoopRecord(tag, dt, op=..., pv=...)."
    )


def missing_pv_hint(record: LoopRecord) -> str:
    """Say how to read a record with its PV: MV is also a measured value (ABB), which is read as the valve position."""
    column = record.provenance.columns.get("mv")
    if column is None:
        return "Read the file again and name the column of the PV (--column, in Python columns=)."
    return (
        f"{column} was taken as the valve position; if it is the PV, name it as the PV (--column, in Python columns=)."
    )


def _signal(name: str, value: ArrayLike, n: int | None) -> NDArray[np.float64]:
    try:
        array = np.ascontiguousarray(as_floats(value))
    except (TypeError, ValueError, OverflowError):
        raise RecordError(f"{name} is not a series of numbers; give a one-dimensional array.") from None
    if array.ndim != 1:
        raise RecordError(f"{name} has {array.ndim} dimensions; give a one-dimensional array.")
    if n is not None and array.shape[0] != n:
        raise RecordError(f"{name} has {array.shape[0]} samples but op has {n}; give signals of equal length.")
    if np.fmax.reduce(array, initial=-np.inf) > LARGEST or np.fmin.reduce(array, initial=np.inf) < -LARGEST:
        return np.where(np.abs(array) <= LARGEST, array, np.nan)
    return array


def _mode(value: ArrayLike, n: int) -> NDArray[np.bool_]:
    mode = _signal("auto", value, n)
    if unknown := int(np.isnan(mode).sum()):
        raise RecordError(f"auto has {unknown} missing values; give True or False for each sample, or leave auto out.")
    return mode.astype(bool)


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return a is b if a is None or b is None else bool(a == b)

"""One loop's recorded (or simulated) signals: the noun that flows through the whole package."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from datetime import timedelta
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, RecordError, as_floats, require_positive
from stiction.records.outliers import outlier_masks
from stiction.records.signals import not_a_percentage

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import ArrayLike, NDArray

__all__ = ["LOOP_TYPES", "LoopRecord", "Provenance", "how_to_name_pv", "require_record"]

LOOP_TYPES = ("flow", "level", "pressure", "temperature", "analyser", "other")
LARGEST = 1e100
"""Size above which a value is no measurement but a sign for a bad one, as is the largest float [any unit]."""
_SIGNALS = ("op", "pv", "sp", "mv", "valve_signal", "auto")


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a record comes from, so that a report can be reproduced."""

    source: str = "memory"
    """File name, or what made the record."""
    sha256: str = ""
    """Digest of the file's bytes; empty when there is no file."""
    columns: dict[str, str] = field(default_factory=dict)
    """Signal name -> column of the source it was read from."""
    guesses: tuple[str, ...] = ()
    """What the reader guessed, a sentence each."""
    rows: int = 0
    """Rows in the source."""
    bad: int = 0
    """Samples in which OP or PV was missing or had a bad status, gaps in the time stamps included."""
    bad_texts: dict[str, int] = field(default_factory=dict)
    """Text found in the place of a number ("Bad Input") -> how often."""
    clock_jumps: int = 0
    """Times that the clock ran backwards or changed to or from summer time."""
    summer_time: int = 0
    """How many of `clock_jumps` were changes to or from summer time, undone, with no row missing beside them."""
    made_up: int = 0
    """Samples for which the reader held an earlier value, as the time stamps were uneven."""
    outliers: int = 0
    """Values that stood alone far off all others and count as missing (see `records.outliers`)."""
    pv_unit: str = ""
    """Unit of the PV, where the source names it."""
    op_unit: str = ""
    """Unit of OP, where the source names one that is not % of span and could not be converted."""
    slave: str = ""
    """Tag of the loop in the same file whose set point OP is: the valve is that loop's."""


@dataclass(frozen=True)
class LoopRecord:
    """Evenly sampled signals of one control loop; NaN marks a missing value.

    Signals given as arrays of floats are kept as they are and not copied, lest a long run be held twice. An infinite
    value, one beyond 1e100, and one that a mask hides are missing too.
    Records are equal when all their fields are, NaN to NaN; equal ones have the same hash.

    Parameters
    ----------
    tag : str
        Name of the loop in the plant.
    dt : float
        Sampling period [s].
    op : array_like, shape (n_samples,)
        Controller output [% of span]; `op_unit` says where it looks like another unit.
    pv : array_like, shape (n_samples,), optional
        Process variable [engineering units]; left out when only a valve was stroked.
    sp : array_like, shape (n_samples,), optional
        Set point [engineering units of the PV]; None when all of it is missing, as `mv` and `valve_signal` are then.
    mv : array_like, shape (n_samples,), optional
        Valve position really reached [% of span].
    valve_signal : array_like, shape (n_samples,), optional
        What a compensator between controller and valve sent [% of span]; None where the valve was given the OP.
    auto : array_like of bool, shape (n_samples,), optional
        True where the controller was in automatic; None when not recorded.
    loop_type : str
        One of `LOOP_TYPES`.
    integrating : bool, optional
        Whether the process integrates. By default a level does, a loop of type "other" is unknown (None)
        and every other type does not.
    start : datetime, optional
        Time of the first sample.
    provenance : Provenance
        Where the record comes from.

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

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "dt", require_positive("dt", self.dt, "s"))
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

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the start [s], shape (n_samples,)."""
        return np.arange(len(self), dtype=np.float64) * self.dt

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return len(self) * self.dt

    @property
    def samples_per_value(self) -> int:
        """Samples for which a stored value stands, on average and rounded up [-]; 1 where the reader held none."""
        return -(-len(self) // max(1, len(self) - self.provenance.made_up))

    @cached_property
    def op_in_percent(self) -> bool:
        """Whether OP is in % of span, as far as is known: by the rule, and of the samples, of the gate "op scale"."""
        if self.provenance.op_unit:
            return False
        seen = np.isfinite(self.op)
        if not self.provenance.outliers:
            signals = {"op": self.op, "pv": self.pv, "sp": self.sp, "mv": self.mv}
            seen &= ~outlier_masks(signals, self.samples_per_value)["op"]
        op = self.op[seen]
        return op.size == 0 or not not_a_percentage(float(op.min()), float(op.max()))

    @property
    def op_unit(self) -> str:
        """Unit of OP, and so of S and J, as it stands in brackets: "% of span", or "OP units" where it is another one.

        Examples
        --------
        >>> from stiction.records import LoopRecord
        >>> LoopRecord("FIC-101", 1.0, op=[50.0, 51.0]).op_unit, LoopRecord("FIC-101", 1.0, op=[0.50, 0.51]).op_unit
        ('% of span', 'OP units')
        """
        return "% of span" if self.op_in_percent else "OP units"

    @property
    def op_unit_short(self) -> str:
        """The same as it stands behind a number in a sentence: "%" or "OP units"."""
        return self.op_unit.removesuffix(" of span")

    def window(self, first: int, last: int, every: int = 1) -> LoopRecord:
        """Cut the samples `first` <= k < `last` as a record of their own, or each so-manyth of them.

        Its provenance tells of the cut: `bad` is counted in it. Which samples were made up, and where the clock jumped,
        is not known: `made_up` is taken in proportion, and `clock_jumps` stays, as the most that there can be.

        Parameters
        ----------
        first, last : int
            First sample and one past the last; a negative one counts from the end, as in a slice.
        every : int, default 1
            Samples from one that is kept to the next.

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
        bad = np.isnan(parts["op"]) if self.pv is None else np.isnan(parts["op"] + parts["pv"])
        made_up = round(self.provenance.made_up * bad.size / max(1, len(self)))
        origin = replace(self.provenance, bad=int(bad.sum()), made_up=made_up)
        start = self.start and self.start + timedelta(seconds=begin * self.dt)
        return replace(self, **parts, dt=self.dt * every, start=start, provenance=origin)


def require_record(record: object) -> None:
    """Refuse what is no record of one loop.

    Parameters
    ----------
    record : object
        What was given in place of one.

    Raises
    ------
    RecordError
        When it is a path, the list that `read` gives, or anything else.

    Examples
    --------
    >>> require_record(LoopRecord("FIC-101", 1.0, op=np.arange(40.0)))
    """
    if isinstance(record, LoopRecord):
        return
    if isinstance(record, (list, tuple)):
        raise RecordError(f"record is a list of {len(record)}, as st.read gives: take them one by one.")
    if isinstance(record, (str, PathLike)):
        raise RecordError(
            f"record = {str(record)!r} is a path; read it, and take the loops of st.read(...) one by one."
        )
    raise RecordError(
        f"record is of type {type(record).__name__}, no LoopRecord; give one of those that st.read(...) gives, or "
        "st.LoopRecord(tag, dt, op=..., pv=...)."
    )


def how_to_name_pv(record: LoopRecord) -> str:
    """Say in a sentence how to read a record with its PV: MV is a measured value too (ABB), and taken for the position.

    Examples
    --------
    >>> how_to_name_pv(LoopRecord("FIC-101", 1.0, op=[50.0]))
    "Read the file again with the column of the PV named: columns={'pv': ...}."
    """
    column = record.provenance.columns.get("mv")
    if column is None:
        return "Read the file again with the column of the PV named: columns={'pv': ...}."
    return f"If {column} is the PV, which was taken for the valve position, say so with columns={{'pv': '{column}'}}."


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
        raise RecordError(f"auto has {unknown} missing values; say True or False of each sample, or leave auto out.")
    return mode.astype(bool)


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return a is b if a is None or b is None else bool(a == b)

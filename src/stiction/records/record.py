"""One loop's recorded (or simulated) signals: the noun that flows through the whole package."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, RecordError, require_positive

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import ArrayLike, NDArray

__all__ = ["LOOP_TYPES", "LoopRecord", "Provenance"]

LOOP_TYPES = ("flow", "level", "pressure", "temperature", "analyser", "other")


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
    made_up: int = 0
    """Samples for which the reader held an earlier value, as the time stamps were uneven."""
    outliers: int = 0
    """Values that stood alone far off all others and count as missing (see `records.outliers`)."""
    pv_unit: str = ""
    """Unit of the PV, where the source names it."""


@dataclass(frozen=True)
class LoopRecord:
    """Evenly sampled signals of one control loop; NaN marks a missing value.

    Parameters
    ----------
    tag : str
        Name of the loop in the plant.
    dt : float
        Sampling period [s].
    op : array_like, shape (n_samples,)
        Controller output [% of span].
    pv : array_like, shape (n_samples,), optional
        Process variable [engineering units]; left out when only a valve was stroked.
    sp : array_like, shape (n_samples,), optional
        Set point [engineering units of the PV].
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
        When the signals are not one-dimensional or differ in length.
    ParameterError
        When `dt` is not positive or `loop_type` is unknown.

    Examples
    --------
    >>> record = LoopRecord("FIC-101", 1.0, op=[50.0, 51.0], pv=[3.0, 3.1], loop_type="flow")
    >>> len(record), record.duration
    (2, 2.0)
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
                put(self, name, _signal(name, value, n))
        if self.auto is not None:
            put(self, "auto", _signal("auto", self.auto, n).astype(bool))

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

    def window(self, first: int, last: int) -> LoopRecord:
        """Cut the samples `first` <= k < `last` as a record of their own."""
        cut = slice(first, last)
        parts: dict[str, Any] = {
            name: None if getattr(self, name) is None else getattr(self, name)[cut]
            for name in ("op", "pv", "sp", "mv", "valve_signal", "auto")
        }
        return replace(self, **parts)


def _signal(name: str, value: ArrayLike, n: int | None) -> NDArray[np.float64]:
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise RecordError(f"{name} is not a series of numbers; give a one-dimensional array.") from None
    if array.ndim != 1:
        raise RecordError(f"{name} has {array.ndim} dimensions; give a one-dimensional array.")
    if n is not None and array.shape[0] != n:
        raise RecordError(f"{name} has {array.shape[0]} samples but op has {n}; give signals of equal length.")
    return array

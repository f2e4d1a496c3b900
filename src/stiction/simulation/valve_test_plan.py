"""A planned valve test: its OP over time and its effect on the plant."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.atomic_write import write_atomically
from stiction.display.duration_format import format_seconds
from stiction.display.json_form import Result
from stiction.errors import ParameterError, require_finite

if TYPE_CHECKING:
    import os
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["TestPlan", "require_range_in_span"]


@dataclass(frozen=True)
class TestPlan(Result):
    """The OP of a valve test, sample by sample."""

    _json_keys = ("kind", "dt as dt_s", "duration as duration_s", "start", "upset", "command", "notes", "settings")

    kind: str
    """`ramp test` or `step test`."""
    dt: float
    """Sampling period [s]."""
    op: NDArray[np.float64] = field(repr=False, compare=False)
    """OP of the test [% of span], shape (n_samples,)."""
    start: float
    """OP before and after the test [% of span]."""
    upset: float
    """Largest departure of the OP from its start [% of span]."""
    notes: tuple[str, ...]
    """Notes on the plan, one sentence each."""
    settings: dict[str, Any]
    """Arguments of the plan."""

    __test__ = False

    @property
    def command(self) -> str:
        """Command line that writes this plan."""
        names = {"fine_step": "fine-step", "fine_range": "fine-range", "hold": "wait"}
        options = {names.get(name, name): value for name, value in self.settings.items()}
        options = {name: value for name, value in options.items() if (name, value) != ("repeats", 1)}
        words = [f"--{name} {_format_option(value)}" for name, value in options.items() if value is not None]
        return f"stiction valve-test plan {self.kind.split()[0]} {' '.join(words)} --dt {self.dt:.9g}"

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample [s], shape (n_samples,)."""
        return np.arange(self.op.size, dtype=np.float64) * self.dt

    @property
    def duration(self) -> float:
        """Length of the test [s]."""
        return self.op.size * self.dt

    def summary(self) -> str:
        """Summary of the plan in words."""
        head = (
            f"{self.kind.capitalize()}: {format_seconds(self.duration)} in manual, OP from {self.op.min():g} to "
            f"{self.op.max():g} %, at most {self.upset:g} % from its start at {self.start:g} %."
        )
        return "\n".join([head, *self.notes])

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write `time_s,OP` for an operator or a control system; an error leaves no incomplete file.

        Raises RecordError when the file cannot be written.
        """
        rows = (f"{t:.9g},{u:.6f}" for t, u in zip(self.time, self.op, strict=True))
        return write_atomically("\n".join(["time_s,OP", *rows, ""]), path)


def _format_option(value: float | list[float]) -> str:
    return " ".join(f"{one:.9g}" for one in (value if isinstance(value, list) else [value]))


def require_range_in_span(low: float, high: float, names: tuple[str, str] = ("low", "high")) -> tuple[float, float]:
    """Return (low, high) as numbers with 0 <= low < high <= 100, or raise when they are not."""
    low, high = require_finite(names[0], low, "% of span"), require_finite(names[1], high, "% of span")
    if not 0.0 <= low < high <= 100.0:
        raise ParameterError(
            f"{names[0]} = {low:g} % and {names[1]} = {high:g} % are not an increasing range from 0 to 100 %; "
            f"give 0 <= {names[0]} < {names[1]} <= 100."
        )
    return low, high

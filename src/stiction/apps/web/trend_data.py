"""Signals of one loop for plots: stored as arrays, cut to the window that is shown, thinned to its pixels."""

from __future__ import annotations

import json
import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records import LoopRecord

__all__ = ["load_trend", "save_signals", "thin_columns", "thin_values"]

SIGNALS = ("pv", "sp", "op", "mv", "model", "position")
"""Signals of a trend: those of the record, PV of the identified loop, estimated valve position."""
MIN_POINTS, MAX_POINTS = 50, 4000
"""Limits of the number of points that a plot may ask for [-]."""
CACHED_LOOPS = 8
"""Loops whose signals a worker holds in memory [-]."""


def save_signals(
    path: str | os.PathLike[str],
    record: LoopRecord,
    extra: dict[str, NDArray[np.float64]] | None = None,
    note: str = "",
) -> None:
    """Write the signals of a loop as arrays; readers see the whole file or none.

    `path`: file to write (.npz). `record`: signals of the loop. `extra`: `model` and `position`, shape (n_samples,).
    `note`: where the samples come from, for the plot's sentence.
    """
    signals = {name: getattr(record, name) for name in SIGNALS[:4] if getattr(record, name) is not None}
    signals |= {name: y for name, y in (extra or {}).items() if np.isfinite(y).any()}
    about = {
        "tag": record.tag, "dt": record.dt, "samples": len(record), "start": _start(record),
        "pv_unit": record.provenance.pv_unit, "op_unit": record.op_unit, "note": note,
    }  # fmt: skip
    draft = f"{os.fspath(path)}.part"
    with open(draft, "wb") as file:
        np.savez(file, about=np.frombuffer(json.dumps(about).encode(), dtype=np.uint8), **signals)
    os.replace(draft, path)


def _start(record: LoopRecord) -> float | None:
    """Time of the first sample as it is written in the source [s since 1970]."""
    from datetime import UTC

    return None if record.start is None else record.start.replace(tzinfo=UTC).timestamp()


@lru_cache(maxsize=CACHED_LOOPS)
def _load(path: str, changed_ns: int) -> tuple[dict[str, Any], dict[str, NDArray[np.float64]]]:
    """Signals of a loop; a file that was written again is read again."""
    del changed_ns
    with np.load(path, allow_pickle=False) as stored:
        about = json.loads(stored["about"].tobytes())
        return about, {name: stored[name] for name in stored.files if name != "about"}


def load_trend(path: str, start: float | None, end: float | None, points: int) -> bytes:
    """Return a window of the signals as JSON, thinned so that no peak is lost.

    `start`, `end`: window [s since the first sample]; the whole record by default. `points`: width of the plot [px].
    Returns ``{"about", "from", "to", "thinned", "time", "signals": {name: [...]}}``; times in seconds since the first
    sample.
    """
    about, signals = _load(path, Path(path).stat().st_mtime_ns)
    dt, n = about["dt"], about["samples"]
    first = 0 if start is None else min(max(int(np.floor(start / dt)), 0), max(n - 2, 0))
    last = n if end is None else max(min(int(np.ceil(end / dt)) + 1, n), min(first + 2, n))
    width = min(max(points, MIN_POINTS), MAX_POINTS)
    part = {name: y[first:last] for name, y in signals.items()}
    samples, thinned = thin_columns(part, width)
    answer = {
        "about": about, "from": first * dt, "to": (last - 1) * dt, "thinned": len(samples) < last - first,
        "time": [round(float(t), 6) for t in (first + samples) * dt],
        "signals": {name: to_list(y) for name, y in thinned.items()},
    }  # fmt: skip
    return json.dumps(answer, separators=(",", ":")).encode()


def thin_columns(
    signals: dict[str, NDArray[np.float64]], width: int
) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """Thin signals of one clock: the smallest and the largest value of each of `width` blocks, in their order.

    `signals`: NaN is a gap. `width`: number of blocks [-]. Returns `samples`: sample number of each point; `thinned`:
    the signals at these points. A block without a value is a gap.

    Examples
    --------
    >>> y = np.zeros(1000)
    >>> y[321] = 5.0
    >>> samples, thinned = thin_columns({"pv": y}, 10)
    >>> len(samples), float(thinned["pv"].max())
    (20, 5.0)
    """
    n = max((len(y) for y in signals.values()), default=0)
    if n <= 2 * width:
        return np.arange(n, dtype=np.float64), signals
    edges = np.linspace(0, n, width + 1).astype(np.intp)
    block = int(np.max(np.diff(edges)))
    index = np.minimum(edges[:-1, None] + np.arange(block), edges[1:, None] - 1)
    samples = np.stack([edges[:-1], (edges[:-1] + edges[1:]) / 2.0], axis=1).ravel().astype(np.float64)
    return samples, {name: _extremes(y[index]) for name, y in signals.items()}


def _extremes(blocks: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest and largest value of each row in the order in which they occur, shape (2 n_rows,)."""
    missing = np.isnan(blocks)
    rows = np.arange(len(blocks))
    low = np.where(missing, np.inf, blocks).argmin(axis=1)
    high = np.where(missing, -np.inf, blocks).argmax(axis=1)
    order = np.stack([np.minimum(low, high), np.maximum(low, high)], axis=1)
    values = blocks[rows[:, None], order]
    values[missing.all(axis=1)] = np.nan
    return values.ravel()


def thin_values(y: NDArray[np.float64], points: int) -> list[float | None]:
    """Return a series as a list of at most `points` values for a small drawing."""
    return to_list(thin_columns({"y": y}, points // 2)[1]["y"])


def to_list(y: NDArray[np.float64]) -> list[float | None]:
    """Return values with seven digits, None for a gap."""
    return [None if value != value else float(f"{value:.7g}") for value in y.tolist()]

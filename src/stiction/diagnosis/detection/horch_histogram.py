"""Horch 2006: is the density of the PV's second derivative one hump or two? (`horch2006`).

In an integrating loop a sticking valve makes the flow jump, so the level's second derivative is quiet but for spikes:
one hump. A sine's second derivative is a sine, whose density has two humps ("camel"). Both densities are fitted to the
histogram. For a self-regulating process the first derivative takes that place. After `horch2006`; the filter here is a
moving average over an eighth of a period, twice, and the index is the camel's share of both misfits. The better
fit decides; within 0.05 of even, a band of our own, neither does.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import judge, objections, swing
from stiction.diagnosis.oscillation.signals import smooth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["camel_index", "horch_histogram"]

EDGES = np.linspace(-3.0, 3.0, 32)


def horch_histogram(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Weigh one hump against two in the density of the PV's derivative (`horch2006`).

    `record`: the control error is used; valid for an integrating process. `oscillation`: what `find_oscillation` says
    of the record. `index` is misfit of two humps over both misfits [-]: above 0.5 one hump fits better.
    """
    error = swing(record, oscillation, "error")
    index = float("nan")
    if error is not None and oscillation.period > 0.0:
        width = max(oscillation.period / record.dt / 8.0, 1.0)
        slope = np.gradient(smooth(smooth(error, width), width))
        index = camel_index(np.gradient(slope) if record.integrating else slope)
    order = "second" if record.integrating else "first"
    why = (
        f"The histogram of PV's {order} derivative has {'one hump' if index >= 0.5 else 'two humps'} "
        f"(index {index:.2f}, one hump from 0.5): a sine gives two humps, a flow that jumps one."
    )
    against = objections(record, oscillation, integrating=True)
    return judge("horch_histogram", index, 0.55, 0.45, why, against, source="horch2006")


def camel_index(x: NDArray[np.float64]) -> float:
    """Misfit of the two-humped density over the sum of both misfits [-]; NaN for a flat signal.

    Examples
    --------
    >>> import numpy as np
    >>> camel_index(np.sin(np.arange(5000.0))) < 0.1
    True
    """
    deviation = float(x.std())
    if not deviation > 0.0:
        return float("nan")
    counts = np.histogram((x - x.mean()) / deviation, EDGES.size - 1, (EDGES[0], EDGES[-1]))[0]
    histogram = counts / (x.shape[0] * (EDGES[1] - EDGES[0]))
    one, two = (float(((humps - histogram) ** 2).sum(axis=1).min()) for humps in _densities())
    return two / (one + two) if one + two > 0.0 else float("nan")


@cache
def _densities() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gaussians, and sines in Gaussian noise, of several widths about deviation 1, each shape (n_densities, n_bins)."""
    middle = (EDGES[1:] + EDGES[:-1]) / 2.0
    scales = np.geomspace(0.1, 1.25, 16)
    gaussians = np.exp(-0.5 * (middle / scales[:, None]) ** 2) / (np.sqrt(2.0 * np.pi) * scales[:, None])
    phases = (np.arange(64) + 0.5) / 64.0 * 2.0 * np.pi
    camels = []
    for share in np.linspace(0.7, 0.99, 8):  # of the variance that is the sine's
        noise = np.sqrt(1.0 - share)
        for scale in np.linspace(0.6, 1.2, 13):  # much narrower, and both humps fall into one bin
            at = (middle[:, None] / scale - np.sqrt(2.0 * share) * np.sin(phases)) / noise
            camels.append(np.exp(-0.5 * at**2).mean(axis=1) / (np.sqrt(2.0 * np.pi) * noise * scale))
    return gaussians, np.array(camels)

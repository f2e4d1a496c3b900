"""A stem that is simulated over OP and corrected by its recorded position: where to look for S and J.

A free simulation that slips one sample late may stay wrong until the stem turns, so that a valve close to the true one
can explain the position badly. Here the simulated stem goes on from the recorded place wherever the two differ by more
than noise, and one wrong slip costs one sample. The search over these errors is smooth, but a very sticky stem follows
any slow position in this way; the valves found are therefore only candidates for the comparison without correction.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.candidates import Candidates, combinations, pattern_search
from stiction.models.component import TIE_TOLERANCE
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CorrectedStems", "corrected_errors", "position_noise", "usual_scale"]


LANES = 16
"""Valves that are simulated side by side: each waits for its own last sample, so that one alone leaves the processor
idle [-]."""
X, DIRECTION, AVERAGED, TOTAL, EDGE, GAP, BREAKS, SHIFT, GOES_ON = range(0, 9 * LANES, LANES)
"""Places of the states and parameters of the valves."""


@kernel
def corrected_errors(op, observed, S, J, rests, shift, cap, limit, out):
    """Fill `out` (n_valves,) with the mean squared one-step error of the `observed` position [% of span, squared].

    `observed` (n_samples,) is on the scale of OP but for a `shift` [% of span], NaN where nothing was recorded. A
    difference above `cap` moves the stem to the observed place; at rest the stem moves to the mean of up to eight
    observations. An error counts up to `limit`. Without branches the compiler computes several valves at once.
    """
    lane = np.empty(GOES_ON + LANES)
    count = 0
    for k in range(1, op.size):
        count += observed[k] == observed[k]
    for first in range(0, out.size, LANES):
        for i in range(LANES):
            v = min(first + i, out.size - 1)
            lane[X + i], lane[DIRECTION + i], lane[AVERAGED + i], lane[TOTAL + i] = op[0], 0.0, 8.0, 0.0
            lane[EDGE + i], lane[GAP + i], lane[SHIFT + i] = 0.5 * (S[v] + J[v]), 0.5 * (S[v] - J[v]), shift[v]
            lane[BREAKS + i] = lane[EDGE + i] * (1.0 + TIE_TOLERANCE)
            lane[GOES_ON + i] = 0.0 if rests[v] else 1.0
        for k in range(1, op.size):
            u, trend, seen = op[k], op[k] - op[k - 1], observed[k]
            known = seen == seen
            for i in range(LANES):
                x, direction, averaged = lane[X + i], lane[DIRECTION + i], lane[AVERAGED + i]
                broken = (1.0 if u > x else -1.0) if abs(u - x) > lane[BREAKS + i] else 0.0
                direction = direction if trend * direction > 0.0 else broken
                x = x if direction == 0.0 else u - direction * lane[GAP + i]
                error = seen - lane[SHIFT + i] - x
                far, near = abs(error) > cap, known and direction == 0.0
                averaged = 1.0 if far else (averaged + 1.0 if averaged < 8.0 else 8.0) if near else averaged
                low, high, place = u - lane[EDGE + i], u + lane[EDGE + i], x + error / averaged
                place = low if place < low else high if place > high else place
                x = place if far or near else x
                way = 1.0 if error > 0.0 else -1.0
                moves = way if abs(u - way * lane[GAP + i] - x) < cap else 0.0
                square = error * error
                lane[X + i], lane[AVERAGED + i] = x, averaged
                lane[DIRECTION + i] = (moves if far else direction) * lane[GOES_ON + i]
                lane[TOTAL + i] += (square if square < limit else limit) if known else 0.0
        for i in range(min(LANES, out.size - first)):
            out[first + i] = lane[TOTAL + i] / max(count, 1)


def position_noise(observed: NDArray[np.float64]) -> float:
    """Standard deviation of the noise of a position, by the median of its third differences [unit of the position].

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noisy = np.where(np.arange(4000) % 400 < 200, 40.0, 43.0) + 0.3 * rng.normal(size=4000)
    >>> round(position_noise(noisy), 1)
    0.3
    """
    third = np.diff(observed[np.isfinite(observed)], 3)
    return float(np.median(np.abs(third)) / (0.6745 * np.sqrt(20.0))) if third.size else 0.0


class CorrectedStems(NamedTuple):
    """OP and the recorded position on its scale, ready for the search."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples,)."""
    observed: NDArray[np.float64]
    """Recorded position on the scale of OP, its delay taken off [% of span]; NaN is missing."""
    noise: float
    """Standard deviation of its noise, at least a thousandth of OP's swing [% of span]."""

    def evaluate(self, rows: NDArray[np.float64], cap: float = 0.0) -> Candidates:
        """Candidates with N ln(mean squared error); a stem is corrected from `cap`, at least four deviations, on."""
        cap = max(cap, 4.0 * self.noise)
        S, ratio, rests, shift = (np.ascontiguousarray(column) for column in rows.T)
        error = np.empty(len(rows))
        corrected_errors(
            self.op, self.observed, S, S * ratio, rests > 0.0, 0.5 * S * (1.0 + ratio) * shift, cap, (3.0 * cap) ** 2,
            error,
        )  # fmt: skip
        n = int(np.isfinite(self.observed).sum())
        return Candidates(rows, n * np.log(np.maximum(error, 1e-8 * float(np.ptp(self.op)) ** 2)))

    def search(self, min_S: float, *, jump: bool = True) -> Candidates:
        """Find the sticky valve, or without `jump` the valve with deadband, with the smallest error."""
        swing = float(np.ptp(self.op))
        zero, S = np.zeros(1), np.geomspace(min_S, swing, 30)
        ratio, rules = (np.array([0.1, 0.25, 0.45, 0.7, 1.0]), np.array([0.0, 1.0])) if jump else (zero, zero)
        rows, found = combinations(S, ratio, rules, zero), None
        for share, steps in CAPS:
            evaluate = partial(self.evaluate, cap=share * swing)
            plain = steps if jump else tuple((S_step, 0.0, start, count) for S_step, _, start, count in steps)
            found = pattern_search(evaluate, evaluate(rows), plain, swing, diagonal=jump)
            rows = found.local_minima(12, 0.01, 0.02)
        assert found is not None
        return found


MIDDLE_STEPS = (0.01, 0.025, 0.02, 4)
"""Steps in ln S, in J / S and in the shift, and candidates refined [-]."""
CAPS = (
    (0.05, ((0.04, 0.1, 0.1, 6), (0.03, 0.05, 0.05, 6))),
    (0.02, ((0.02, 0.05, 0.05, 5), MIDDLE_STEPS)),
    (0.0, (MIDDLE_STEPS, (0.005, 0.01, 0.01, 3), (0.0025, 0.005, 0.005, 2))),
)
"""Difference that corrects a stem, as a share of OP's swing [-], and the steps of the search with it. A large
difference lets a valve with another S slip early or late."""


def usual_scale(slope: float, *, factor: float = 2.5) -> float:
    """Scale of a position in %, in mA of 4 to 20 or in fractions of the span, where a rough slope is near to one.

    Examples
    --------
    >>> usual_scale(-0.8), usual_scale(0.25), usual_scale(12.0)
    (-1.0, 0.16, 12.0)
    """
    unit = min((1.0, 16.0 / 100.0, 1.0 / 100.0), key=lambda one: abs(np.log(abs(slope) / one)))
    return float(np.copysign(unit, slope)) if 1.0 / factor < abs(slope) / unit < factor else slope

"""Histories: one valve and loop over many windows, in which load, set point, noise and operating point change.

The fault of a history is constant, grows, begins, is repaired, or comes and goes. Half of the histories are stored by a
historian, which does the same to each window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.loop_sets import count_stem_turns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from stiction.records import LoopRecord

__all__ = ["FAULTS", "STORED_SHARE", "HistoryPlan", "HistoryWindow", "draw_history", "draw_plan"]

FAULTS = {
    "good": 0.18, "tight": 0.08, "external": 0.1, "sensor": 0.04, "deadband": 0.1,
    "sticky": 0.38, "sticky_external": 0.07, "sticky_tight": 0.05,
}  # fmt: skip
"""Share of each fault [-]."""
COURSES = {"constant": 0.5, "growing": 0.1, "onset": 0.15, "repaired": 0.2, "intermittent": 0.05}
"""How the fault of a sticky history runs, and how often [-]."""
WINDOWS = {"constant": 6, "growing": 9, "onset": 9, "repaired": 9, "intermittent": 9}
"""Windows of a history [-]."""
FIRST_CHANGE, LAST_CHANGE = 3, 6
"""First and last window that may be the first after an onset or a repair [-]."""
REPAIRED_S = (0.05, 0.3)
"""S of a valve before its stiction begins or after its repair [% of span]."""
WINDOW_SAMPLES = (1200, 3000)
"""Fewest and most samples of a window [-]."""
STORED_SHARE = 0.5
"""Share of the histories that a historian stores [-]."""
MIN_TURNS = 6
"""Reversals of the stem from which a window can show stiction [-]."""
MAX_ATTEMPTS = 200
"""Draws after which a history is given up [-]."""


@dataclass(frozen=True, slots=True)
class HistoryWindow:
    """One window of a history, with its truth."""

    record: LoopRecord
    """The record of the window."""
    S: float
    """Deadband plus stickband in it [% of span]."""
    J: float
    """Slip jump in it [% of span]."""

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks and jumps in this window."""
        return self.S >= 1.0 and self.J >= 0.1 * self.S


class HistoryPlan(NamedTuple):
    """What a simulator is asked for."""

    fault: str
    """One of `FAULTS`."""
    course: str
    """One of `COURSES`."""
    samples: int
    """Samples of each window [-]."""
    stored: bool
    """Whether a historian stores the history."""
    shares: NDArray[np.float64]
    """S in each window over the largest S of the history [-]; 0 of a valve in order."""

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks in some window."""
        return self.fault.startswith("sticky")


def draw_plan(rng: np.random.Generator) -> HistoryPlan:
    """Draw what is wrong with a loop, how it runs, and how long its windows are."""
    fault = str(rng.choice(list(FAULTS), p=list(FAULTS.values())))
    sticky = fault.startswith("sticky")
    course = str(rng.choice(list(COURSES), p=list(COURSES.values()))) if sticky else "constant"
    n = WINDOWS[course]
    shares = np.ones(n)
    if course == "growing":
        shares = np.linspace(float(rng.uniform(0.3, 0.6)), 1.0, n)
    elif course == "intermittent":
        shares = np.where(rng.random(n) < 0.6, 1.0, 0.0)
    elif course in ("onset", "repaired"):
        after = np.arange(n) >= int(rng.integers(FIRST_CHANGE, LAST_CHANGE + 1))
        shares = np.where(after == (course == "onset"), 1.0, 0.0)
    return HistoryPlan(fault, course, int(rng.integers(*WINDOW_SAMPLES)), bool(rng.random() < STORED_SHARE), shares)


def draw_history(simulator: str, number: int, seed: int) -> Iterator[tuple[HistoryPlan, HistoryWindow]]:
    """Draw one history.

    Parameters
    ----------
    simulator : str
        `first` or `second`.
    number : int
        Number of the history [-].
    seed : int
        Seed of the whole set.

    Yields
    ------
    tuple of HistoryPlan and HistoryWindow
        The plan of the history, and one window after the other in the order of time.
    """
    if simulator == "second":
        from calibration.second_simulator.histories import try_history
    else:
        from calibration.populations.histories import try_history
    for attempt in range(MAX_ATTEMPTS):
        rng = np.random.default_rng([57, seed, number, simulator == "second", attempt])
        plan = draw_plan(np.random.default_rng([58, seed, number, simulator == "second"]))
        windows = _complete(plan, rng, try_history)
        if windows is not None:
            yield from ((plan, window) for window in windows)
            return
    raise RuntimeError(f"Number {number} of seed {seed} gives no history in {MAX_ATTEMPTS} attempts; use another seed.")


def _complete(
    plan: HistoryPlan, rng: np.random.Generator, draw: Callable[..., Iterator[HistoryWindow]]
) -> list[HistoryWindow] | None:
    """All windows; None where one of them does not move, or the stem of a sticky valve hardly turns in most of them."""
    windows: list[HistoryWindow] = []
    unmoved = 0
    for window in draw(plan, rng):
        windows.append(window)
        if window.S >= 1.0:
            unmoved += count_stem_turns(window.record.op, window.S, window.J) < MIN_TURNS
        if unmoved > 0.5 * plan.shares.size:
            return None
    return windows if len(windows) == plan.shares.size else None

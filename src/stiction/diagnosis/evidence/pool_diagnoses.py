"""One diagnosis of many windows of a loop."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.evidence.changes import evidence_of_today, find_changes
from stiction.diagnosis.evidence.enough import windows_needed
from stiction.diagnosis.evidence.pooling import pool_windows, tabulate
from stiction.diagnosis.verdict.causes import CAUSES, OscillationCause
from stiction.diagnosis.verdict.decision import decide
from stiction.diagnosis.verdict.finding import is_backlash
from stiction.diagnosis.verdict.history import Window
from stiction.diagnosis.verdict.model import Contribution, log_odds, stiction_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.evidence.pooling import Pooled
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.diagnosis.verdict.history import Change

__all__ = ["PooledWindows", "describe_window", "judge_windows"]

DEADBAND_FEATURES = ("over_deadband", "over_deadband_integrating")
"""Features of a slip jump against deadband alone; a process has one of them."""
WINDOWS_FEATURE = "agreement_of_windows"
"""Name of what the number and the agreement of the windows add to the log odds."""


def describe_window(found: Diagnosis, start_s: float) -> Window:
    """Keep of the diagnosis of one window what is needed later.

    Parameters
    ----------
    found : Diagnosis
        Diagnosis of the window alone.
    start_s : float
        Its start, from the first sample of the first record [s].

    Returns
    -------
    Window
        The window; it holds no signals.
    """
    record, one, model = found.record, found.identification, stiction_model()
    about = Window(
        record.start, start_s, start_s + record.duration, found.loop_state.state, found.probability,
        S_detectable=found.S_detectable,
    )  # fmt: skip
    if not found.loop_state.in_control or one is None:
        return about
    total = sum(part.log_odds for part in found.contributions)
    jumps = [found.features[name] for name in DEADBAND_FEATURES if np.isfinite(found.features[name])]
    return replace(
        about, S=one.S, S_low=one.S_low, S_high=one.S_high, J=one.J, J_low=one.J_low, J_high=one.J_high,
        over_deadband=float(sum(jumps)), band_to_swing=float(np.nan_to_num(found.features["band_to_swing"])),
        over_closest=float(np.nan_to_num(found.features["over_closest"])),
        contributions=found.contributions,
        causes=tuple(getattr(found.oscillation_cause, name) for name in (*CAUSES, "seen")),
        evidence=model.intercept + total - log_odds(model.training_prior),
    )  # fmt: skip


class PooledWindows:
    """Windows of one loop as they come, with the diagnoses that stand for them.

    Only two diagnoses are kept, whatever the number of windows: the one with the most evidence, and the last one.
    """

    def __init__(self) -> None:
        self.windows: list[Window] = []
        self._best: tuple[int, Diagnosis] | None = None
        self._last: tuple[int, Diagnosis] | None = None
        self._other: dict[str, Diagnosis] = {}

    def add_known(self, window: Window) -> None:
        """Add a window that was judged before."""
        self.windows.append(window)

    def stand_for(self, found: Diagnosis) -> None:
        """Let a diagnosis stand for the windows where none was judged now."""
        if found.loop_state.in_control:
            self._best = self._last = (len(self.windows) - 1, found)
        self._other.setdefault(found.loop_state.state, found)

    def add(self, found: Diagnosis, start_s: float) -> Window:
        """Add the diagnosis of the next window."""
        window = describe_window(found, start_s)
        number = len(self.windows)
        self.windows.append(window)
        if window.in_control:
            self._last = (number, found)
            best = -np.inf if self._best is None else self.windows[self._best[0]].evidence
            if window.evidence >= best:
                self._best = self._last
        self._other.setdefault(window.state, found)
        return window

    def diagnose(self) -> Diagnosis:
        """Pool the windows since the last change of the fault."""
        if self._last is None or self._best is None:
            states = Counter(one.state for one in self.windows if one.state in self._other)
            state = states.most_common(1)[0][0] if states else next(iter(self._other))
            return replace(self._other[state], windows=tuple(self.windows), history=())
        if len(self.windows) == 1:
            found, table = self._last[1], tabulate(self.windows)
            needed = windows_needed(table, float(table.evidence[0]), found.prior, found.costs, found.S_detectable)
            return replace(found, windows=tuple(self.windows), windows_needed=needed)
        pooled, history, first = judge_windows(self.windows)
        table = tabulate(self.windows[first:])
        chosen = (self._best if self._best[0] >= first else self._last)[1]
        probability = pooled.probability(chosen.prior)
        causes = _mean_causes([one.causes for one in self.windows[first:] if one.causes])
        valve = chosen.identification and replace(
            chosen.identification, S=pooled.S.value, S_low=pooled.S.low, S_high=pooled.S.high, J=pooled.J.value,
            J_low=pooled.J.low, J_high=pooled.J.high,
        )  # fmt: skip
        excluded = pooled.S_detectable is not None and pooled.S_detectable <= chosen.smallest_S
        excluded |= is_backlash(causes, valve, chosen.smallest_S)
        return replace(
            chosen, probability=probability, oscillation_cause=causes, S_detectable=pooled.S_detectable,
            verdict=decide(probability, chosen.costs, excluded=excluded), identification=valve,
            contributions=_pool_contributions(self.windows[first:], chosen, pooled), windows=tuple(self.windows),
            history=history,
            windows_needed=windows_needed(table, pooled.evidence, chosen.prior, chosen.costs, pooled.S_detectable),
        )  # fmt: skip


def judge_windows(windows: Sequence[Window]) -> tuple[Pooled, tuple[Change, ...], int]:
    """Pool the windows since the last change of the fault.

    Parameters
    ----------
    windows : sequence of Window
        Windows of one valve in the order of time, one in control at least.

    Returns
    -------
    tuple
        What they say together, all changes, and the number of the first window that was pooled. The evidence allows
        for a later change that is too unsure to tell.
    """
    history = find_changes(windows)
    first = max((one.first for one in history if one.kind != "growth"), default=0)
    pooled = pool_windows(tabulate(windows[first:]))
    return pooled._replace(evidence=evidence_of_today(windows[first:])), history, first


def _mean_causes(causes: Sequence[tuple[float, ...]]) -> OscillationCause:
    """Mean probability of each cause over windows."""
    return OscillationCause(*(float(np.mean(values)) for values in zip(*causes, strict=True)))


def _pool_contributions(windows: Sequence[Window], chosen: Diagnosis, pooled: Pooled) -> tuple[Contribution, ...]:
    """Mean contributions of the windows, and what their number and agreement add: together the pooled log odds."""
    known = [one for one in windows if one.contributions]
    if not known:
        return chosen.contributions
    sums = dict.fromkeys((part.feature for part in known[0].contributions), 0.0)
    for window in known:
        for part in window.contributions:
            sums[part.feature] += part.log_odds / len(known)
    values = {part.feature: part.value for part in chosen.contributions}
    model = stiction_model()
    rest = pooled.evidence + log_odds(model.training_prior) - model.intercept - sum(sums.values())
    parts = [Contribution(name, values[name], part) for name, part in sums.items()]
    parts.append(Contribution(WINDOWS_FEATURE, float(len(known)), rest))
    return tuple(sorted(parts, key=lambda one: -abs(one.log_odds)))

"""Score the pooled verdict and the change points on histories; a section of docs/validation.md.

Run as a script to print it: ``python -m calibration.validate_histories TABLE [TABLE ...]``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.scores import Scores, calibration_error, weights_of
from calibration.train_pooling import read_histories
from stiction.diagnosis.evidence.pool_diagnoses import judge_windows
from stiction.diagnosis.evidence.pooling import pool_windows, tabulate
from stiction.diagnosis.verdict.decision import DEFAULT_PRIOR, DEFAULT_SMALLEST_S, Costs, decide

if TYPE_CHECKING:
    from calibration.train_pooling import History

__all__ = ["history_lines", "score_changes", "score_verdicts"]

COUNTS = (1, 2, 3, 6)
"""Windows for which the verdict is scored [-]."""
LATEST = 3
"""Windows within which a change must be found [-]."""


class ChangeScores(NamedTuple):
    """How well changes are found."""

    onsets: int
    """Histories in which the fault begins."""
    onsets_found: float
    """Share of them in which it is found within `LATEST` windows [-]."""
    repairs: int
    """Histories in which the valve is repaired."""
    repairs_found: float
    """Share of them in which it is found within `LATEST` windows [-]."""
    windows: int
    """Windows of histories without a change."""
    false_per_50: float
    """Changes found in 50 of them [-]."""


def score_verdicts(histories: list[History], n: int) -> Scores:
    """Score the verdict after `n` windows, on the truth of the last of them."""
    from sklearn.metrics import roc_auc_score

    sticky, probability, calls = [], [], []
    for one in histories:
        windows = one.windows[:n]
        last = [k for k, window in enumerate(windows) if window.in_control]
        if not last:
            continue
        pooled, _, _ = judge_windows(windows)
        p = pooled.probability(DEFAULT_PRIOR)
        shown = pooled.S_detectable is not None and pooled.S_detectable <= DEFAULT_SMALLEST_S
        calls.append(decide(p, Costs(), excluded=shown))
        sticky.append(bool(one.sticky[:n].any() if one.course == "intermittent" else one.sticky[last[-1]]))
        probability.append(p)
    y, p, call = np.array(sticky), np.array(probability), np.array(calls)
    weights = weights_of(y, DEFAULT_PRIOR)
    decided = call != "undecided"
    right = np.where(y, call == "stiction", call == "no_stiction")
    return Scores(
        loops=y.size, auc=float(roc_auc_score(y, p)), brier=float(np.average((p - y) ** 2, weights=weights)),
        calibration_error=calibration_error(y, p, weights),
        undecided=float(np.average((p > 0.3) & (p < 0.7), weights=weights)),
        right=float(np.average(right[decided], weights=weights[decided])),
        found=float(np.mean(call[y] == "stiction")), false_alarms=float(np.mean(call[~y] == "stiction")),
    )  # fmt: skip


def score_changes(histories: list[History]) -> ChangeScores:
    """Score the change points: found with the data of `LATEST` windows after the change, at most one window off."""
    found: dict[str, list[bool]] = {"onset": [], "repaired": []}
    false, quiet = 0, 0
    for one in histories:
        if one.course in found:
            at = int(np.flatnonzero(np.diff(one.sticky.astype(int)))[0]) + 1
            windows = one.windows[: at + LATEST]
            if sum(w.in_control for w in windows[:at]) < 2 or sum(w.in_control for w in windows[at:]) < LATEST - 1:
                continue
            _, history, _ = judge_windows(windows)
            kind = "onset" if one.course == "onset" else "repair"
            found[one.course].append(any(change.kind == kind and abs(change.first - at) <= 1 for change in history))
        elif one.course == "constant" and any(window.in_control for window in one.windows):
            _, history, _ = judge_windows(one.windows)
            false += sum(change.kind != "growth" for change in history)
            quiet += sum(window.in_control for window in one.windows)
    shares = {name: float(np.mean(hits)) if hits else np.nan for name, hits in found.items()}
    return ChangeScores(
        len(found["onset"]), shares["onset"], len(found["repaired"]), shares["repaired"], quiet,
        50.0 * false / max(quiet, 1),
    )  # fmt: skip


def score_sizes(histories: list[History], n: int) -> tuple[int, float, float, float]:
    """Valves, share whose interval of S holds it, median width over S [-], and median error of S, of sticky valves."""
    held, width, error = [], [], []
    for one in histories:
        windows = [w for w in one.windows[:n] if w.in_control]
        if one.course != "constant" or not one.sticky.all() or len(windows) < n:
            continue
        S = pool_windows(tabulate(windows)).S
        held.append(S.low <= one.S[0] <= S.high)
        width.append((S.high - S.low) / one.S[0])
        error.append(abs(np.log(S.value / one.S[0])))
    return len(held), float(np.mean(held)), float(np.median(width)), float(np.median(error))


def history_lines(title: str, path: Path) -> list[str]:
    """The part of the page about one simulator."""
    histories = read_histories(path)
    lines = [f"### {title}: {len(histories)} histories", "",
             "| windows | histories | AUC | calibration error | found | false alarms | undecided |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    for n in COUNTS:
        one = score_verdicts(histories, n)
        lines.append(
            f"| {n} | {one.loops} | {one.auc:.3f} | {one.calibration_error:.3f} | {100.0 * one.found:.0f} % | "
            f"{100.0 * one.false_alarms:.1f} % | {100.0 * one.undecided:.0f} % |"
        )
    change = score_changes(histories)
    lines += ["", f"Changes found within {LATEST} windows: {100.0 * change.onsets_found:.0f} % of {change.onsets} "
              f"onsets, {100.0 * change.repairs_found:.0f} % of {change.repairs} repairs; {change.false_per_50:.2f} "
              f"false changes in 50 windows ({change.windows} windows without a change).", "",
              "| windows | sticky valves | S within its 95 % interval | median width over S | median error of ln S |",
              "|---|---|---|---|---|"]  # fmt: skip
    for n in COUNTS:
        count, held, width, error = score_sizes(histories, n)
        lines.append(f"| {n} | {count} | {100.0 * held:.0f} % | {width:.2f} | {error:.2f} |")
    return [*lines, ""]


def main() -> None:
    """Print the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="+", type=Path)
    for path in parser.parse_args().tables:
        print("\n".join(history_lines(path.stem, path)))


if __name__ == "__main__":
    main()

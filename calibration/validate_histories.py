"""Score the pooled verdict and the change points on histories; a section of docs/validation.md.

Run as a script: ``python -m calibration.validate_histories FIRST SECOND --write``, after `calibration.validate`.
"""

from __future__ import annotations

import argparse
import re
import textwrap
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

ROOT = Path(__file__).resolve().parents[1]
PAGE, README = ROOT / "docs" / "validation.md", ROOT / "README.md"
HEAD = """## Evidence over time

Histories: one valve and loop in up to nine windows, in which load, set point, noise and operating point change; half of
them as a historian stores them. The fault is constant, grows, begins, is repaired, or comes and goes. The verdict after
a number of windows in control is compared with the valve in the last of them. False alarms count all good valves alike,
those with deadband alone included. A valve that began to stick or was repaired less than three windows ago is counted
like all others; how well the rest are told apart stands in "settled".
"""
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


def is_settled(one: History, last: int) -> bool:
    """Whether the valve was the same in the last windows up to window `last`, as many as a change may take to find."""
    recent = one.sticky[max(last + 1 - LATEST, 0) : last + 1]
    return one.course != "intermittent" and bool(recent.all() or not recent.any())


def score_verdicts(histories: list[History], n: int, *, settled: bool = False) -> Scores:
    """Score the verdict after `n` windows in control, on the truth of the last of them.

    `settled`: only valves that have not changed for as many windows as a change may take to find.
    """
    from sklearn.metrics import roc_auc_score

    sticky, probability, calls = [], [], []
    for one in histories:
        judged = [k for k, window in enumerate(one.windows) if window.in_control][:n]
        if len(judged) < n or (settled and not is_settled(one, judged[-1])):
            continue
        pooled, _, _ = judge_windows(one.windows[: judged[-1] + 1])
        p = pooled.probability(DEFAULT_PRIOR)
        shown = pooled.S_detectable is not None and pooled.S_detectable <= DEFAULT_SMALLEST_S
        calls.append(decide(p, Costs(), excluded=shown))
        sticky.append(bool(one.sticky[judged].any() if one.course == "intermittent" else one.sticky[judged[-1]]))
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
        windows = [w for w in one.windows if w.in_control][:n]
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
    names = ("windows", "histories", "AUC", "calibration error", "found", "false alarms", "undecided", "settled", "AUC",
             "found")  # fmt: skip
    lines = [f"### {title}: {len(histories)} histories", "", f"| {' | '.join(names)} |", "|---" * len(names) + "|"]
    for n in COUNTS:
        one, rest = score_verdicts(histories, n), score_verdicts(histories, n, settled=True)
        lines.append(
            f"| {n} | {one.loops} | {one.auc:.3f} | {one.calibration_error:.3f} | {100.0 * one.found:.0f} % | "
            f"{100.0 * one.false_alarms:.1f} % | {100.0 * one.undecided:.0f} % | {rest.loops} | {rest.auc:.3f} | "
            f"{100.0 * rest.found:.0f} % |"
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


def write_page(lines: list[str]) -> None:
    """Put the section into docs/validation.md, before the choices, in place of an older one."""
    text = PAGE.read_text(encoding="utf-8")
    text = re.sub(r"## Evidence over time\n.*?(?=\n## )", "", text, flags=re.S)
    before, choices, after = text.partition("## Choices made by looking")
    section = "\n".join([HEAD, *lines]).rstrip()
    PAGE.write_text(f"{before.rstrip()}\n\n{section}\n\n{choices}{after}", encoding="utf-8")


def write_readme(histories: list[History]) -> None:
    """Put the shares for one window and for six into the README."""
    one, six = score_verdicts(histories, 1), score_verdicts(histories, 6)
    line = (
        f"One record finds **{100.0 * one.found:.0f} %** of the sticky valves with {100.0 * one.false_alarms:.0f} % "
        f"false alarms; six records, as of a week, find **{100.0 * six.found:.0f} %** with "
        f"{100.0 * six.false_alarms:.0f} % ({len(histories)} histories of the second simulator, with loads that "
        "change, half of them as a historian stores them; see "
        "[evidence over time](docs/understand/evidence-over-time.md))."
    )
    text = README.read_text(encoding="utf-8")
    place = re.compile(r"(<!-- history numbers: .*? -->\n).*?(<!-- end of history numbers -->)", re.S)
    wrapped = textwrap.fill(line, 120, break_long_words=False, break_on_hyphens=False)
    README.write_text(place.sub(rf"\g<1>{wrapped}\n\g<2>", text), encoding="utf-8")


def main() -> None:
    """Print the section, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="+", type=Path, help="of the first and of the second simulator")
    parser.add_argument("--write", action="store_true", help="write docs/validation.md and README.md")
    given = parser.parse_args()
    titles = ("First simulator, fresh seed", "Second simulator")
    lines = [line for pair in zip(titles, given.tables, strict=False) for line in history_lines(*pair)]
    print("\n".join(lines))
    if given.write:
        write_page(lines)
        write_readme(read_histories(given.tables[-1]))


if __name__ == "__main__":
    main()

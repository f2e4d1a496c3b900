"""Answers about one loop from its files, made in a worker."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.diagnose_loop import diagnose_file

if TYPE_CHECKING:
    from stiction.compensation import CompensationTrial

__all__ = ["read_content", "read_trend", "try_remedies", "write_loop_report"]


def read_content(folder: str) -> bytes:
    """Return what the page of a loop shows apart from its trends, as JSON."""
    return (Path(folder) / "content.json").read_bytes()


def read_trend(folder: str, start: float | None, end: float | None, points: int) -> bytes:
    """Return a window of the signals of a loop; see `load_trend`."""
    from stiction.apps.web.trend_data import load_trend

    return load_trend(str(Path(folder) / "signals.npz"), start, end, points)


def write_loop_report(record_path: str, folder: str) -> tuple[str, str]:
    """Write the full report of a loop; return its path and the name under which it is saved."""
    from stiction.report import write_report

    path = Path(folder) / "report.html"
    if not path.is_file():
        write_report([diagnose_file(record_path)], path)
    tag = json.loads(read_content(folder))["tag"]
    return str(path), f"{re.sub(r'[^A-Za-z0-9._-]+', '_', tag)[:60] or 'loop'}-report.html"


def try_remedies(record_path: str, folder: str) -> bytes:
    """Try repair, retuning and compensators on the simulated loop; return the table as JSON."""
    from stiction.compensation import compensate

    path = Path(folder) / "remedies.json"
    if not path.is_file():
        trial = compensate(diagnose_file(record_path))
        path.write_text(json.dumps(_remedies(trial), allow_nan=False), encoding="utf-8")
    return path.read_bytes()


def _remedies(trial: CompensationTrial) -> dict[str, Any]:
    """The trials as rows of a table; numbers are relative to doing nothing."""
    from stiction.compensation.remedies import NO_ACTION
    from stiction.report.labels import format_number
    from stiction.report.pages.trial import _change as format_change
    from stiction.report.pages.trial import remedy_note, retuning_text, settings_text
    from stiction.report.pages.trial import trial_line as headline

    rows = []
    if trial.remedies:
        now = trial[NO_ACTION].behaviour
        rows = [
            [
                one.name, format_change(_ratio(one.behaviour.pv_std, now.pv_std)),
                format_number(_ratio(one.behaviour.travel, now.travel)), format_number(one.behaviour.reversals),
                f"{one.cost:.2f}", settings_text(one), remedy_note(one, trial),
            ]
            for one in trial.remedies
        ]  # fmt: skip
    return {
        "headline": headline(trial),
        "reason": trial.reason,
        "risk": "" if trial.refused else trial.risk,
        "retuning": retuning_text(trial),
        "columns": ["Remedy", "PV std", "Valve travel", "Reversals per hour", "Price", "Settings", "Note"],
        "rows": rows,
    }


def _ratio(value: float, base: float) -> float:
    return value / base if base > 0.0 else math.nan

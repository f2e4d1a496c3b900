"""Answers about one loop from its files, made in a worker."""

from __future__ import annotations

import json
import re
from pathlib import Path

from stiction.apps.web.diagnose_loop import diagnose_file

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
    """Try repair, retuning and compensators on the simulated loop; return what is shown of it as JSON."""
    from stiction.compensation import compensate
    from stiction.report.blocks import Figure, SideBySide
    from stiction.report.pages.trial import trial_blocks
    from stiction.report.plain_blocks import blocks_to_plain

    path = Path(folder) / "remedies.json"
    if not path.is_file():
        diagnosis = diagnose_file(record_path)
        blocks = trial_blocks(compensate(diagnosis), diagnosis)
        shown = [block for block in blocks if not isinstance(block, Figure | SideBySide)]
        path.write_text(json.dumps({"blocks": blocks_to_plain(shown)}, allow_nan=False), encoding="utf-8")
    return path.read_bytes()

"""Verdicts counted against labels, by record and by group."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

__all__ = ["by_group", "confusion"]


def confusion(rows: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """Count rows with a "label" and a "verdict"; undecided is neither right nor an alarm.

    Examples
    --------
    >>> confusion([{"label": "stiction", "verdict": "undecided"}])["right"]
    0
    """
    pairs = Counter((row["label"], row["verdict"]) for row in rows)
    cells = {
        "true_alarms": pairs["stiction", "stiction"],
        "missed": pairs["stiction", "no_stiction"],
        "false_alarms": pairs["no_stiction", "stiction"],
        "true_rests": pairs["no_stiction", "no_stiction"],
        "undecided": pairs["stiction", "undecided"] + pairs["no_stiction", "undecided"],
    }
    return {"n": sum(pairs.values()), "right": cells["true_alarms"] + cells["true_rests"], **cells}


def by_group(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each group with its label and the verdict of most of its records; a tie is undecided.

    Examples
    --------
    >>> rows = [{"group": "FV-1", "label": "stiction", "verdict": v} for v in ("stiction", "stiction", "no_stiction")]
    >>> by_group(rows)[0]["verdict"]
    'stiction'
    """
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(row["group"], []).append(row)
    found: list[dict[str, Any]] = []
    for name, members in groups.items():
        votes = Counter(row["verdict"] for row in members)
        verdict, most = votes.most_common(1)[0]
        clear = 2 * most > len(members)
        found.append(
            {
                "group": name,
                "label": members[0]["label"],
                "verdict": verdict if clear else "undecided",
                "n": len(members),
            }
        )
    return found

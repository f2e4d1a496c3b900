"""Compare verdicts with labels, by record and by group."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

__all__ = ["calibration_error", "confusion_counts", "reliability", "score_causes", "score_groups"]

PROBABILITY_BINS = 5
"""Number of equal bins of the probability [-]."""


def confusion_counts(rows: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """Count rows by "label" and "verdict"; undecided is neither right nor an alarm.

    Examples
    --------
    >>> confusion_counts([{"label": "stiction", "verdict": "undecided"}])["right"]
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


def score_groups(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each group with its label and the verdict of most of its records; a tie is undecided.

    Examples
    --------
    >>> rows = [{"group": "FV-1", "label": "stiction", "verdict": v} for v in ("stiction", "stiction", "no_stiction")]
    >>> score_groups(rows)[0]["verdict"]
    'stiction'
    """
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(row["group"], []).append(row)
    scores: list[dict[str, Any]] = []
    for name, members in groups.items():
        votes = Counter(row["verdict"] for row in members)
        verdict, most = votes.most_common(1)[0]
        clear = 2 * most > len(members)
        scores.append(
            {
                "group": name,
                "label": members[0]["label"],
                "verdict": verdict if clear else "undecided",
                "n": len(members),
            }
        )
    return scores


def score_causes(rows: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """Count for each label, or true cause where the rows have one, how often each cause was named.

    Examples
    --------
    >>> score_causes([{"label": "stiction", "cause": "none"}, {"label": "stiction", "cause": "stiction"}])
    {'stiction': {'none': 1, 'stiction': 1}}
    """
    scores: dict[str, Counter[str]] = {}
    for row in rows:
        scores.setdefault(row.get("true_cause") or row["label"], Counter())[row["cause"]] += 1
    return {label: dict(counts) for label, counts in scores.items()}


def reliability(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, float]]:
    """Compare mean probability and share of sticky valves in each bin; rows without a probability are left out.

    Examples
    --------
    >>> reliability([{"label": "stiction", "probability": 0.9}, {"label": "no_stiction", "probability": 0.9}])
    [{'from': 0.8, 'to': 1.0, 'n': 2, 'mean': 0.9, 'sticky': 0.5}]
    """
    bins: dict[int, list[Mapping[str, Any]]] = {}
    for row in rows:
        if row["probability"] is not None:
            bins.setdefault(min(int(row["probability"] * PROBABILITY_BINS), PROBABILITY_BINS - 1), []).append(row)
    return [
        {
            "from": k / PROBABILITY_BINS,
            "to": (k + 1) / PROBABILITY_BINS,
            "n": len(members),
            "mean": sum(row["probability"] for row in members) / len(members),
            "sticky": sum(row["label"] == "stiction" for row in members) / len(members),
        }
        for k, members in sorted(bins.items())
    ]


def calibration_error(bins: Iterable[Mapping[str, float]]) -> float:
    """Return the mean distance of probability and true share over the bins, weighted by rows [-]; NaN without bins.

    Examples
    --------
    >>> calibration_error([{"n": 2, "mean": 0.9, "sticky": 0.5}, {"n": 2, "mean": 0.1, "sticky": 0.1}])
    0.2
    """
    rows = list(bins)
    n = sum(row["n"] for row in rows)
    return sum(row["n"] * abs(row["mean"] - row["sticky"]) for row in rows) / n if n else float("nan")

"""Sentences about the windows of a loop: how many, what changed, and how much more data would decide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from stiction.display.duration_format import format_duration, format_time
from stiction.display.number_format import count_noun, format_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.result import Verdict
    from stiction.diagnosis.verdict.history import Change, Window

__all__ = ["describe_change", "describe_disagreement", "describe_windows", "explain_need", "explain_over_time"]


class OverTime(Protocol):
    """What the sentences need to know; a `Diagnosis` has it."""

    @property
    def verdict(self) -> Verdict:
        """The verdict."""
        ...

    @property
    def windows(self) -> tuple[Window, ...]:
        """The windows."""
        ...

    @property
    def history(self) -> tuple[Change, ...]:
        """The changes."""
        ...

    @property
    def windows_needed(self) -> int | None:
        """Further windows after which there would be a verdict [-]."""
        ...


def explain_over_time(found: OverTime, unit: str = "%") -> str:
    """Say what the windows show, what changed, and how much more data would decide.

    `unit`: unit of S. Empty where there is one window and nothing to add.
    """
    sentences = [describe_windows(found.windows)] if len(found.windows) > 1 else []
    sentences += [describe_change(one, unit) for one in found.history]
    sentences.append(describe_disagreement(found.windows, found.history, unit))
    return " ".join(filter(None, [*sentences, explain_need(found)]))


def describe_windows(windows: Sequence[Window]) -> str:
    """Say how many windows were judged, and how many could not be."""
    judged = [one for one in windows if one.in_control]
    text = f"Judged in {count_noun(len(windows), 'window')} of about {format_duration(windows[-1].duration)}"
    left = len(windows) - len(judged)
    return f"{text}, {left} of them without a valve in control." if left else f"{text}."


def describe_change(change: Change, unit: str = "%") -> str:
    """Say what changed in a sentence.

    Examples
    --------
    >>> from datetime import datetime
    >>> from stiction.diagnosis.verdict.history import Change
    >>> describe_change(Change(datetime(2026, 4, 3), 0.0, "repair", 4.1, 0.5, 0.98))
    'Repaired about 2026-04-03 00:00: S was 4.1 %, and is below 0.5 % since.'
    """
    when = format_time(change.time) or f"{format_duration(change.time_s)} after the begin"
    before, after = (None if size is None else f"{format_number(round(size, 1))} {unit}"
                     for size in (change.S_before, change.S_after))  # fmt: skip
    if change.kind == "onset":
        return f"The valve sticks since about {when}, with S of {after}."
    if change.kind == "growth":
        return f"S grew from {before} to {after} since {when}."
    now = f", and is below {after} since" if after else ""
    return f"Repaired about {when}: S was {before}{now}."


def describe_disagreement(windows: Sequence[Window], history: Sequence[Change], unit: str = "%") -> str:
    """Say which two windows of today's valve disagree most about S; empty where their intervals overlap.

    Only windows that find stiction by themselves count; growth of S is no disagreement.
    """
    first = max((one.first for one in history if one.kind != "growth"), default=0)
    sure = [one for one in windows[first:] if one.in_control and one.probability >= DISAGREES]
    if len(sure) < 2 or any(one.kind == "growth" and one.first >= first for one in history):
        return ""
    small, large = min(sure, key=lambda one: one.S_high or 0.0), max(sure, key=lambda one: one.S_low or 0.0)
    if (small.S_high or 0.0) >= (large.S_low or 0.0):
        return ""
    texts = []
    for one in sorted((small, large), key=lambda one: one.start_s):
        S, low, high = (format_number(x or 0.0, significant=2) for x in (one.S, one.S_low, one.S_high))
        begin = format_time(one.start) or format_duration(one.start_s)
        texts.append(f"{S} {unit} ({low} to {high}) from {begin} on")
    return f"The windows disagree about S: {texts[0]}, and {texts[1]}."


DISAGREES = 0.5
"""Probability of a window from which its S counts in a disagreement [-]."""


def explain_need(found: OverTime) -> str:
    """Say how much more data would decide; empty where there is a verdict or nothing to predict."""
    judged = [one for one in found.windows if one.in_control]
    if found.verdict != "undecided" or not judged:
        return ""
    if found.windows_needed is None:
        return "More data of the same kind would not decide."
    if found.windows_needed == 0:
        return ""
    duration = found.windows_needed * sum(one.duration for one in judged) / len(judged)
    return f"About {format_duration(duration)} more of data like these would decide."

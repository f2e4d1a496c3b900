"""How verdicts, numbers and times are said on a page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stiction.diagnosis.result import Diagnosis, Identification
    from stiction.report.blocks import Mark

__all__ = ["MARKS", "VERDICTS", "confidence", "count", "digits", "headline", "span", "stiction_size"]

VERDICTS = {"stiction": "Stiction", "no_stiction": "No stiction", "undecided": "Cannot tell"}
MARKS: dict[str, Mark] = {"stiction": "alert", "no_stiction": "good", "undecided": "unknown"}


def digits(value: float, unit: str = "", significant: int = 3) -> str:
    r"""Return a number as text with a few significant digits, or a dash; a space before the unit does not break.

    Examples
    --------
    >>> digits(3.14159, "%"), digits(1234.5), digits(float("nan"), "s")
    ('3.14\xa0%', '1234', '–')
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:.0f}" if abs(value) >= 10**significant else f"{value:.{significant}g}"
    return f"{text}\u00a0{unit}" if unit else text


def span(seconds: float) -> str:
    r"""Return a duration in the unit a person would use.

    Examples
    --------
    >>> span(95.0), span(600.0), span(86400.0), span(float("nan"))
    ('95\xa0s', '10\xa0min', '24\xa0h', '–')
    """
    if not math.isfinite(seconds):
        return "–"
    name, size = time_unit(seconds)
    return digits(seconds / size, name)


def time_unit(seconds: float) -> tuple[str, float]:
    """Return name and length [s] of the unit for a duration: s, min, h or d."""
    for name, size, least in (("d", 86400.0, 3 * 86400.0), ("h", 3600.0, 7200.0), ("min", 60.0, 120.0)):
        if seconds >= least:
            return name, size
    return "s", 1.0


def count(n: int, noun: str) -> str:
    """Return a number with its noun: `1 loop`, `2 loops`."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def stiction_size(found: Identification) -> str:
    """Return S with its interval, and J."""
    return (
        f"S\u00a0=\u00a0{digits(found.S)}\u00a0% of span (95\u00a0%: {digits(found.S_low)} to {digits(found.S_high)}), "
        f"J\u00a0=\u00a0{digits(found.J, '%')}"
    )


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one line."""
    found, cause = diagnosis.identification, diagnosis.cause.strip()
    if diagnosis.verdict == "stiction":
        return "Valve stiction" if found is None else f"Valve stiction: {stiction_size(found)}"
    says = "No valve stiction found" if diagnosis.verdict == "no_stiction" else "Cannot tell whether the valve sticks"
    return says if cause in ("", "none", "unknown") else f"{says}; likely cause: {cause}"


def confidence(diagnosis: Diagnosis) -> str:
    """Return the confidence in words and as a number."""
    p = diagnosis.probability
    said = f"probability of stiction {p:.2f}" if math.isfinite(p) else "no probability"
    if diagnosis.verdict == "undecided" or not math.isfinite(p):
        return f"No verdict ({said})"
    certainty = p if diagnosis.verdict == "stiction" else 1.0 - p
    word = "High" if certainty >= 0.9 else "Moderate" if certainty >= 0.75 else "Low"
    return f"{word} confidence ({said})"

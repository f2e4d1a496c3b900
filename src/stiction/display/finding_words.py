"""The finding of a loop in words, and how urgent it looks: one table for every screen, page and file."""

from __future__ import annotations

from typing import Literal

__all__ = ["FINDINGS", "OPEN", "FindingLevel", "can_wait", "finding_level"]

FINDINGS = {
    "sticks": "Valve stiction",
    "probably_sticks": "Probably valve stiction",
    "backlash": "Play in the valve",
    "tuning": "Controller tuning",
    "follows": "Follows its moving set point",
    "external": "Load from outside the loop",
    "set_point": "Moving set point",
    "rate_limit": "Rate limit of OP",
    "dead_zone": "Dead zone at a fixed OP",
    "valve_not_responding": "The valve does not respond",
    "not_in_command": "OP is not what this controller asks for",
    "sensor": "PV sensor",
    "no_data": "The data cannot be used",
    "cause_unknown": "The record does not show the cause",
    "cannot_tell": "Cannot tell whether the valve sticks",
    "nothing_found": "No valve stiction found",
}
"""Finding of a loop -> its line at the head of a page."""

FindingLevel = Literal["alert", "unknown", "good", "plain"]
"""`alert`: a fault of the loop; `unknown`: open; `good`: nothing to do; `plain`: the fault is elsewhere."""
ALERTS = (
    "sticks",
    "probably_sticks",
    "backlash",
    "tuning",
    "rate_limit",
    "dead_zone",
    "sensor",
    "valve_not_responding",
)
OPEN = ("cause_unknown", "cannot_tell")
"""Findings that leave a question open."""


def can_wait(finding: str | None, *, oscillating: bool) -> bool:
    """Whether an open question can wait: nobody has to test a loop that does not oscillate.

    Examples
    --------
    >>> can_wait("cannot_tell", oscillating=False), can_wait("cannot_tell", oscillating=True)
    (True, False)
    """
    return finding in OPEN and not oscillating


def finding_level(finding: str | None) -> FindingLevel:
    """How urgent a finding looks.

    Parameters
    ----------
    finding : str, optional
        Code of the finding; None of a loop that was not diagnosed.

    Returns
    -------
    str
        One of `FindingLevel`.

    Examples
    --------
    >>> [finding_level(code) for code in ("sticks", "cannot_tell", "nothing_found", "follows", None)]
    ['alert', 'unknown', 'good', 'plain', 'plain']
    """
    if finding in ALERTS:
        return "alert"
    return "unknown" if finding in OPEN else "good" if finding == "nothing_found" else "plain"

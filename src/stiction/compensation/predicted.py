"""What a trial predicts of its recommendation, in the words that go out to the plant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.compensation.remedies import NOTHING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.compensation.result import CompensationTrial

__all__ = ["in_words", "predicted"]

UNITS = {
    "amplitude": "%", "S": "%", "J": "%", "deadband": "%", "resolution": "%", "width": "s", "interval": "s",
    "move": "s", "Ti": "s", "Td": "s", "band": "PV units", "full": "PV units", "Kc": "% per PV unit",
}  # fmt: skip
"""Units of the settings that have one."""


def predicted(trial: CompensationTrial) -> str:
    """Say what the recommended remedy does against doing nothing.

    Parameters
    ----------
    trial : CompensationTrial
        A trial that recommends something.

    Returns
    -------
    str
        PV deviation, stem travel, reversals, and the deviation where S and J are off by 30 %.
    """
    chosen, now = trial[trial.recommended or NOTHING], trial[NOTHING].behaviour
    b = chosen.behaviour
    bill = [f"{name} x {_times(value, base)}" for name, value, base in (
        ("PV deviation", b.pv_std, now.pv_std),
        ("stem travel", b.travel, now.travel),
        ("reversals", b.reversals, now.reversals),
    )]  # fmt: skip
    return f"{', '.join(bill)} of now; PV deviation x {chosen.worst:.2f} at worst where S and J are off by 30 %"


def in_words(settings: Mapping[str, Any]) -> str:
    """Settings with their units, three figures each; those left to their default are left out.

    Examples
    --------
    >>> in_words({"amplitude": 1.5, "width": 2.0, "move": None, "cycles": 2})
    'amplitude 1.5 %, width 2 s, cycles 2'
    """
    given = {name: value for name, value in settings.items() if value is not None}
    return ", ".join(f"{name} {value:.3g} {UNITS.get(name, '')}".rstrip() for name, value in given.items())


def _times(value: float, base: float) -> str:
    return f"{value / base:.2f}" if base > 0.0 else "?"

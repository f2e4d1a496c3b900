"""Text for a predicted improvement and for the settings of a remedy, as the plant gets them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.compensation.remedies import NO_ACTION

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.compensation.result import CompensationTrial

__all__ = ["format_settings", "prediction_text"]

UNITS = {
    "amplitude": "%", "S": "%", "J": "%", "deadband": "%", "resolution": "%", "width": "s", "interval": "s",
    "move": "s", "Ti": "s", "Td": "s", "band": "PV units", "full": "PV units", "Kc": "% per PV unit",
}  # fmt: skip
"""Setting -> its unit."""


def prediction_text(trial: CompensationTrial) -> str:
    """Return the predicted effect of the recommended remedy relative to doing nothing.

    `trial`: a trial with a recommendation. Returns PV deviation, stem travel and reversals, and the PV deviation if S
    and J are wrong by 30 %.
    """
    chosen, now = trial[trial.recommended or NO_ACTION], trial[NO_ACTION].behaviour
    b = chosen.behaviour
    effects = [f"{name} x {_format_ratio(value, base)}" for name, value, base in (
        ("PV deviation", b.pv_std, now.pv_std),
        ("stem travel", b.travel, now.travel),
        ("reversals", b.reversals, now.reversals),
    )]  # fmt: skip
    return f"{', '.join(effects)} of now; PV deviation at most x {chosen.worst:.2f} if S and J are wrong by 30 %"


def format_settings(settings: Mapping[str, Any]) -> str:
    """Return settings with their units and three significant digits; unset ones are left out.

    Examples
    --------
    >>> format_settings({"amplitude": 1.5, "width": 2.0, "move": None, "cycles": 2})
    'amplitude 1.5 %, width 2 s, cycles 2'
    """
    given = {name: value for name, value in settings.items() if value is not None}
    return ", ".join(f"{name} {value:.3g} {UNITS.get(name, '')}".rstrip() for name, value in given.items())


def _format_ratio(value: float, base: float) -> str:
    return f"{value / base:.2f}" if base > 0.0 else "?"

"""The identified controller, valve and process in sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.report import labels

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import ControllerFit, Identification, ProcessFit

__all__ = ["describe_controller", "describe_identification"]


def describe_controller(found: ControllerFit, unit: str) -> str:
    """Return form, settings with standard errors and fit of the controller as a sentence; OP in `unit`."""
    if found.form == "unknown":
        return f"No form of controller explains OP. {found.why}"
    settings = [f"Kc {_with_error(found.Kc, found.Kc_error)} {unit} per PV unit"] if found.Kc else []
    if 0.0 < found.Ti < math.inf:
        settings.append(f"Ti {_with_error(found.Ti, found.Ti_error)} s")
    if not found.Kc:
        settings.append(f"Ki {labels.format_number(found.Ki)} {unit} per PV unit and s")
    if found.Td:
        settings.append(f"Td {labels.format_number(found.Td)} s")
    exact = "; the record shows every move of the controller" if found.exact else ""
    return f"{found.form} with {', '.join(settings)}: explains {100.0 * found.explained:.0f} % of OP{exact}."


def _with_error(value: float, error: float) -> str:
    text = labels.format_number(value)
    return f"{text} \u00b1 {labels.format_number(error, significant=1)}" if error > 1e-6 * abs(value) else text


def describe_identification(found: Identification, unit: str) -> list[tuple[str, str]]:
    """Return what was identified, each with its name and a sentence; OP in `unit`."""
    lines = [
        ("Valve", found.summary(unit)),
        ("Process with the sticky valve", f"{_process(found.process, unit)}."),
        ("Process with a good valve", f"{_process(found.linear, unit)}."),
    ]
    if math.isfinite(found.drift) and math.isfinite(found.drift_error):
        drift, error = (labels.format_number(x, significant=2) for x in (found.drift, found.drift_error))
        lines.append(("Drift of S", f"S changes by {drift} {unit} per hour (standard error {error})."))
    remarks = " ".join(text for text in (found.J_remark, found.reason) if text)
    return [*lines, ("Limits", remarks)] if remarks else lines


def _process(found: ProcessFit, unit: str) -> str:
    gain, of_op = labels.format_number(found.gain), unit.removesuffix("s")
    dead_time = f"dead time {labels.format_duration(found.dead_time)}"
    if found.integrating:
        return f"integrating process, gain {gain} PV units per {of_op} and second, {dead_time}"
    lag = labels.format_duration(found.time_constant)
    return f"gain {gain} PV units per {of_op}, time constant {lag}, {dead_time}"

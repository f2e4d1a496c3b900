"""The identified controller, valve and process in sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.report import labels

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import ControllerFit, Identification, ProcessFit

__all__ = ["describe_controller", "describe_drift", "describe_identification"]


def describe_controller(controller: ControllerFit, unit: str) -> str:
    """Return form, settings with standard errors and fit of the controller as a sentence; OP in `unit`."""
    if controller.form == "unknown":
        return f"No form of controller explains OP. {controller.why}"
    settings = [f"Kc {_with_error(controller.Kc, controller.Kc_error)} {unit} per PV unit"] if controller.Kc else []
    if 0.0 < controller.Ti < math.inf:
        settings.append(f"Ti {_with_error(controller.Ti, controller.Ti_error)} s")
    if not controller.Kc:
        settings.append(f"Ki {labels.format_number(controller.Ki)} {unit} per PV unit and s")
    if controller.Td:
        settings.append(f"Td {labels.format_number(controller.Td)} s")
    exact = "; the record shows every move of the controller" if controller.exact else ""
    return f"{controller.form} with {', '.join(settings)}: explains {100.0 * controller.explained:.0f} % of OP{exact}."


def _with_error(value: float, error: float) -> str:
    text = labels.format_number(value)
    return f"{text} \u00b1 {labels.format_number(error, significant=1)}" if error > 1e-6 * abs(value) else text


def describe_identification(identification: Identification, unit: str) -> list[tuple[str, str]]:
    """Return what was identified, each with its name and a sentence; OP in `unit`."""
    lines = [
        ("Valve", identification.summary(unit)),
        ("Process with the sticky valve", f"{_process(identification.process, unit)}."),
        ("Process with a good valve", f"{_process(identification.linear, unit)}."),
    ]
    if drift := describe_drift(identification, unit):
        lines.append(("Drift of S", drift))
    remarks = " ".join(text for text in (identification.J_remark, identification.reason) if text)
    return [*lines, ("Limits", remarks)] if remarks else lines


def describe_drift(identification: Identification, unit: str) -> str:
    """Return the drift of S with its standard error as a sentence; empty when it was not estimated."""
    if not (math.isfinite(identification.drift) and math.isfinite(identification.drift_error)):
        return ""
    drift, error = (labels.format_number(x, significant=2) for x in (identification.drift, identification.drift_error))
    return f"S changes by {drift} {unit} per hour (standard error {error})."


def _process(process: ProcessFit, unit: str) -> str:
    gain, of_op = labels.format_number(process.gain), unit.removesuffix("s")
    dead_time = f"dead time {labels.format_duration(process.dead_time)}"
    if process.integrating:
        return f"integrating process, gain {gain} PV units per {of_op} and second, {dead_time}"
    lag = labels.format_duration(process.time_constant)
    return f"gain {gain} PV units per {of_op}, time constant {lag}, {dead_time}"

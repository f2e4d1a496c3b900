"""The numbers of a loop as its diagnosis identified it, with remarks on what had to be assumed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from stiction.compensation.twin import Twin
    from stiction.diagnosis import Diagnosis

__all__ = ["values_from_diagnosis"]

NO_INTEGRAL_TI = 1e7
"""Integral time that stands for a controller without integral part [s]."""


def values_from_diagnosis(diagnosis: Diagnosis) -> tuple[dict[str, Any], list[str]]:
    """Return values of `WhatIfSettings` as identified, and remarks on them.

    Returns values of the loop's twin, else of the identification with the fitted or a usual controller; the process
    gain has the sign that the controller needs. Sentences on what was assumed.
    """
    from stiction.compensation.twin import build_twin

    try:
        if diagnosis.verdict == "no_stiction":
            known, remarks = _of_identification(diagnosis)
        else:
            known, remarks = _of_twin(build_twin(diagnosis))
    except (RecordError, ParameterError) as error:
        known, remarks = _of_identification(diagnosis)
        remarks.insert(0, f"The simulated loop was not compared with the record: {error}")
    if known.get("Kc", 0.0) * known.get("gain", 0.0) < 0.0:
        known["gain"] = -known["gain"]
        remarks.append(
            "The identified process gain has the wrong sign for the identified controller, so its sign was changed. "
            "Enter your "
            "process gain if you know it."
        )
    return known, remarks


def _of_twin(twin: Twin) -> tuple[dict[str, Any], list[str]]:
    """Settings of the twin, and what its comparison with the record says."""
    from stiction.compensation.repair import stiction_of

    loop = twin.loop
    process: Any = loop.process
    den = np.trim_zeros(np.asarray(process.den, dtype=float), "f")
    S, J = stiction_of(loop.valve) or (0.0, 0.0)
    integrating = bool(den[-1] == 0.0)
    lags = sorted((-1.0 / root.real for root in np.roots(den) if root != 0.0), reverse=True)
    tau, lag = (*lags, 0.0, 0.0)[:2]
    low, high = loop.controller.op_limits
    limits = {"op_low": max(low, -1e9), "op_high": min(high, 1e9)}
    settings = {
        "S": S,
        "J": J,
        "gain": float(process.num[-1] / (den[-2] if integrating else den[-1])),
        "tau": tau,
        "lag": 0.0 if integrating else lag,
        "dead_time": process.dead_time,
        "integrating": integrating,
        "noise": loop.noise,
        "dt": loop.dt,
        "sp": twin.sp,
        "op": twin.op,
        **_of_controller(loop.controller.Kc, loop.controller.Ti, loop.controller.Td),
        **limits,
    }
    if twin.fits:
        return settings, [
            "With the disturbances of the record the simulated loop repeats its cycle; here it is simulated without "
            "them."
        ]
    return settings, [twin.reason]


def _of_identification(diagnosis: Diagnosis) -> tuple[dict[str, Any], list[str]]:
    """Settings of what was identified, and what is missing."""
    identification, controller = diagnosis.identification, diagnosis.controller
    if identification is None:
        return {"model": "ideal"}, ["No valve and no process were identified: the values shown are typical values."]
    good = diagnosis.verdict == "no_stiction"
    process = identification.linear if good else identification.process
    remarks = ["The verdict is no stiction, so the simulated loop starts with a good valve."] if good else []
    settings: dict[str, Any] = {
        "model": "ideal" if good else "kano",
        "S": identification.S,
        "J": identification.J,
        "gain": process.gain,
        "tau": process.time_constant - process.lag,
        "lag": 0.0 if process.integrating else process.lag,
        "dead_time": process.dead_time,
        "integrating": process.integrating,
    }
    if controller is not None and controller.Kc and controller.Ti > 0.0:
        settings |= _of_controller(controller.Kc, controller.Ti, max(controller.Td, 0.0))
    else:
        settings |= _usual_controller(settings)
        remarks.append(
            "No controller was found in the record: Kc and Ti are typical values for this process. Enter your values."
        )
    return settings, remarks


def _of_controller(Kc: float, Ti: float, Td: float) -> dict[str, float]:
    return {"Kc": Kc, "Ti": min(Ti, NO_INTEGRAL_TI), "Td": Td}


def _usual_controller(process: dict[str, Any]) -> dict[str, float]:
    """A PI by the SIMC rule with a closed-loop time constant of the dead time."""
    delay = max(process["dead_time"] + process["lag"] / 2.0, 0.1 * process["tau"], 1e-3)
    if process["integrating"]:
        return {"Kc": 1.0 / (process["gain"] * 2.0 * delay), "Ti": 8.0 * delay}
    tau = max(process["tau"] + process["lag"] / 2.0, 1e-3)
    return {"Kc": tau / (process["gain"] * 2.0 * delay), "Ti": min(tau, 8.0 * delay)}

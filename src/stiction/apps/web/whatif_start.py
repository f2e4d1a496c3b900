"""Where the what-if screen starts: the loop as its diagnosis identified it, and the record to draw behind it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.web.trend_signals import first_rise, measure_swing, thin
from stiction.apps.web.whatif_settings import WhatIfSettings
from stiction.display.duration_format import format_seconds
from stiction.display.number_format import format_number
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.compensation.twin import Twin
    from stiction.diagnosis import Diagnosis

__all__ = ["WhatIfStart", "identified_start"]

PERIODS_SHOWN = 5.0
"""Periods of the record that are shown [-]."""
SHORTEST_RECORD_SAMPLES = 10
"""Fewest samples of the record that are drawn [-]."""
NO_INTEGRAL_TI = 1e7
"""Integral time that stands for a controller without integral part [s]."""


@dataclass(frozen=True, slots=True)
class WhatIfStart:
    """Settings as identified, and the record behind them."""

    settings: WhatIfSettings
    """The loop as identified."""
    remarks: tuple[str, ...]
    """What had to be assumed, and how far the simulated loop can be trusted, in sentences."""
    record: dict[str, NDArray[np.float64]]
    """Part of the record: time [s], pv [PV units], op [% of span], shape (n_points,) each."""
    sentence: str
    """How the record oscillates."""
    tag: str = ""
    """Name of the loop."""
    pv_unit: str = ""
    """Unit of the PV; empty where it is not known."""

    def to_dict(self) -> dict[str, Any]:
        """Plain texts, numbers and arrays."""
        return {
            "settings": self.settings.to_dict(),
            "remarks": list(self.remarks),
            "record": self.record,
            "sentence": self.sentence,
            "tag": self.tag,
            "pv_unit": self.pv_unit,
        }


def identified_start(diagnosis: Diagnosis, *, width: int = 1600) -> WhatIfStart:
    """Return the settings that repeat a diagnosed loop; takes seconds, so that it runs in another process.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    width : int
        Width of the plot [px].

    Returns
    -------
    WhatIfStart
        Settings of the loop's twin where one can be built, else of the identification and the fitted controller, else
        usual ones; `remarks` says which.
    """
    from stiction.compensation.twin import analysed_segment, build_twin

    segment = analysed_segment(diagnosis)
    assert segment.pv is not None
    oscillation = diagnosis.oscillation
    known = np.isfinite(oscillation.period) and oscillation.period > 0.0
    period = oscillation.period if known else segment.duration / PERIODS_SHOWN
    shown = min(PERIODS_SHOWN * period, segment.duration)
    base = {
        "dt": segment.dt,
        "duration": max(shown, SHORTEST_RECORD_SAMPLES * segment.dt),
        "sp": float(np.nanmean(segment.pv if segment.sp is None else segment.sp)),
        "op": float(np.nanmean(segment.op)),
    }
    try:
        if diagnosis.verdict == "no_stiction":
            found, remarks = _of_identification(diagnosis)
        else:
            found, remarks = _of_twin(build_twin(diagnosis))
    except (RecordError, ParameterError) as error:
        found, remarks = _of_identification(diagnosis)
        remarks.insert(0, f"The simulated loop was not compared with the record: {error}")
    rounded: dict[str, Any] = {
        name: _round(value) if isinstance(value, float) else value for name, value in {**base, **found}.items()
    }
    return WhatIfStart(
        WhatIfSettings(**rounded),
        tuple(remarks),
        _part(segment, base["duration"], width),
        _describe(diagnosis, segment.op, segment.dt),
        diagnosis.record.tag,
        diagnosis.record.provenance.pv_unit or "",
    )


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
    return settings, [twin.reason.replace("The twin", "The simulated loop")]


def _of_identification(diagnosis: Diagnosis) -> tuple[dict[str, Any], list[str]]:
    """Settings of what was identified, and what is missing."""
    found, controller = diagnosis.identification, diagnosis.controller
    if found is None:
        return {"model": "ideal"}, ["No valve and no process were identified: the values shown are usual ones."]
    good = diagnosis.verdict == "no_stiction"
    process = found.linear if good else found.process
    remarks = ["The verdict is no stiction, so the simulated loop starts with a good valve."] if good else []
    settings: dict[str, Any] = {
        "model": "ideal" if good else "kano",
        "S": found.S,
        "J": found.J,
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
            "No controller was found in the record: Kc and Ti are usual values for this process. Enter yours."
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


def _part(segment: Any, duration: float, width: int) -> dict[str, NDArray[np.float64]]:
    """The middle of the record, from a rise of OP through its middle."""
    n = min(round(duration / segment.dt), len(segment))
    start = max((len(segment) - 2 * n) // 2, 0)
    first = start + first_rise(segment.op[start : start + n])
    stop = min(first + n, len(segment))
    pv, op = segment.pv[first:stop], segment.op[first:stop]
    keep = thin((pv, op), width)
    return {"time": keep * segment.dt, "pv": pv[keep], "op": op[keep]}


def _describe(diagnosis: Diagnosis, op: NDArray[np.float64], dt: float) -> str:
    oscillation = diagnosis.oscillation
    if not oscillation.oscillating:
        swing = measure_swing(op, dt)
        return f"The record does not oscillate regularly; OP moves between {_ends(swing.middle, swing.amplitude)} %."
    return (
        f"The record oscillates with a period of {format_seconds(oscillation.period)}: OP amplitude "
        f"{format_number(oscillation.amplitude_op, significant=3)} %, PV amplitude "
        f"{format_number(oscillation.amplitude_pv, significant=3)}."
    )


def _round(value: float) -> float:
    """Four significant digits: more than any identification gives."""
    return float(f"{value:.4g}")


def _ends(middle: float, amplitude: float) -> str:
    return f"{middle - amplitude:.4g} and {middle + amplitude:.4g}"

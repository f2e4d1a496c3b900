"""Where the what-if screen starts: the loop as its diagnosis identified it, and the record to compare with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.web.trend_data import thin_columns
from stiction.apps.web.whatif_settings import WhatIfSettings
from stiction.compensation.known_loop import values_from_diagnosis
from stiction.display.duration_format import format_seconds
from stiction.display.number_format import format_number
from stiction.errors import ParameterError, RecordError
from stiction.simulation.swing import find_first_rise, measure_swing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis import Diagnosis

__all__ = ["WhatIfStart", "start_from_diagnosis"]

PERIODS_SHOWN = 5.0
"""Periods of the record that are shown [-]."""
SHORTEST_RECORD_SAMPLES = 10
"""Fewest samples of the record that are drawn [-]."""


@dataclass(frozen=True, slots=True)
class WhatIfStart:
    """Settings as identified, and the record that they were identified from."""

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


def start_from_diagnosis(diagnosis: Diagnosis, *, width: int = 1600) -> WhatIfStart:
    """Return the settings that repeat a diagnosed loop; takes seconds, so that it runs in another process.

    `width`: width of the plot [px]. Returns settings of the loop's twin where one can be built, else of the
    identification and the fitted controller, else usual ones; `remarks` says which. Raises RecordError when the record
    holds no PV, or too few samples.
    """
    segment = diagnosis.segment.part
    if segment.pv is None or len(segment) < SHORTEST_RECORD_SAMPLES:
        raise RecordError(
            f"{len(segment)} samples of PV and OP can be used, too few to simulate; record at "
            "least "
            f"{SHORTEST_RECORD_SAMPLES}.",
            where=diagnosis.record.tag,
        )
    oscillation = diagnosis.oscillation
    known = np.isfinite(oscillation.period) and oscillation.period > 0.0
    period = oscillation.period if known else segment.duration / PERIODS_SHOWN
    found, remarks = values_from_diagnosis(diagnosis)
    longest = min(segment.duration, WhatIfSettings.max_duration(found.get("dt", segment.dt)))
    shown = max(min(PERIODS_SHOWN * period, longest), SHORTEST_RECORD_SAMPLES * segment.dt)
    base = {
        "dt": segment.dt,
        "duration": shown,
        "sp": float(np.nanmean(segment.pv if segment.sp is None else segment.sp)),
        "op": float(np.nanmean(segment.op)),
    }
    try:
        settings = _make_settings({**base, **found})
    except ParameterError as error:
        settings = _make_settings({**base, "model": "ideal"})
        remarks = [f"The identified loop cannot be simulated: {error} The values shown are typical values."]
    return WhatIfStart(
        settings,
        (*remarks, *_find_doubts(settings)),
        _middle_part(segment, shown, width),
        _describe_record(diagnosis, segment.op, segment.dt),
        diagnosis.record.tag,
        diagnosis.record.provenance.pv_unit or "",
    )


def _find_doubts(settings: WhatIfSettings) -> list[str]:
    """What speaks against the settings as they were identified."""
    from stiction.limitcycle.predict import is_unstable

    if not is_unstable(settings.loop):
        return []
    return [
        "The identified loop is unstable even with a good valve, but the record is stable. Enter your process and "
        "controller, or lower the process gain."
    ]


def _make_settings(values: dict[str, Any]) -> WhatIfSettings:
    """Settings of four significant digits: more than any identification gives."""
    rounded: dict[str, Any] = {
        name: float(f"{value:.4g}") if isinstance(value, float) else value for name, value in values.items()
    }
    settings = WhatIfSettings(**rounded)
    _ = settings.loop  # to see whether it can be made
    return settings


def _middle_part(segment: Any, duration: float, width: int) -> dict[str, NDArray[np.float64]]:
    """The middle of the record, from a rise of OP through its middle."""
    n = min(round(duration / segment.dt), len(segment))
    start = max((len(segment) - 2 * n) // 2, 0)
    first = start + find_first_rise(segment.op[start : start + n])
    stop = min(first + n, len(segment))
    samples, thinned = thin_columns({"pv": segment.pv[first:stop], "op": segment.op[first:stop]}, width)
    return {"time": samples * segment.dt, **thinned}


def _describe_record(diagnosis: Diagnosis, op: NDArray[np.float64], dt: float) -> str:
    oscillation = diagnosis.oscillation
    if not oscillation.oscillating:
        swing = measure_swing(op, dt)
        return f"The record does not oscillate regularly; OP moves between {_ends(swing.middle, swing.amplitude)} %."
    return (
        f"The record oscillates with a period of {format_seconds(oscillation.period)}: OP amplitude "
        f"{format_number(oscillation.amplitude_op, significant=3)} %, PV amplitude "
        f"{format_number(oscillation.amplitude_pv, significant=3)}."
    )


def _ends(middle: float, amplitude: float) -> str:
    return f"{middle - amplitude:.4g} and {middle + amplitude:.4g}"

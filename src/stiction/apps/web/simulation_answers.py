"""What a worker process answers to the what-if and textbook screens. Importing this file imports no numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["QUICK_KINDS", "SLOW_KINDS", "answer", "answer_start", "warm_simulations"]

QUICK_KINDS = ("trend", "ramp", "sine", "jump")
"""Questions that are answered within some milliseconds."""
SLOW_KINDS = ("cycles", "nyquist")
"""Questions that take up to some seconds."""
MIN_WIDTH_PX, MAX_WIDTH_PX = 100, 8000
"""Smallest and largest width of a plot [px]."""


def answer(kind: str, request_id: int, values: Mapping[str, Any], width: int) -> bytes:
    """Answer one question of a screen.

    Parameters
    ----------
    kind : str
        One of `QUICK_KINDS` or `SLOW_KINDS`.
    request_id : int
        Number of the question, which the answer repeats.
    values : mapping
        The settings of the screen.
    width : int
        Width of the plot [px].

    Returns
    -------
    bytes
        The answer, see `packed`.

    Raises
    ------
    ParameterError
        When a setting is unknown or outside its limits, or gives no loop.
    """
    from stiction.apps.web import textbook, whatif
    from stiction.apps.web.packed import pack
    from stiction.apps.web.textbook_settings import TextbookSettings
    from stiction.apps.web.whatif_settings import WhatIfSettings

    width = min(max(int(width), MIN_WIDTH_PX), MAX_WIDTH_PX)
    if kind == "trend":
        body = asdict(whatif.simulate_trend(WhatIfSettings.from_mapping(values), width))
    elif kind == "cycles":
        body = whatif.predict_cycles(WhatIfSettings.from_mapping(values))
    else:
        settings = TextbookSettings.from_mapping(values)
        if kind == "ramp":
            body = textbook.simulate_ramps(settings, width)
        elif kind == "sine":
            body = textbook.drive_by_sine(settings)
        elif kind == "jump":
            body = textbook.simulate_jump(settings, width)
        else:
            body = textbook.draw_nyquist(settings)
    return pack({"kind": kind, "id": request_id, **body})


def answer_start(record_path: str) -> bytes:
    """Diagnose the record of a loop and return where the what-if screen starts.

    `record_path`: file that holds one record.
    """
    from stiction.apps.web.diagnose_loop import diagnose_file
    from stiction.apps.web.packed import pack
    from stiction.apps.web.whatif_start import start_from_diagnosis

    return pack(asdict(start_from_diagnosis(diagnose_file(record_path))))


def warm_simulations() -> None:
    """Compile the kernels of each question that is answered at once."""
    from stiction.apps.web.whatif_settings import COMPENSATORS, VALVE_MODELS

    for model in VALVE_MODELS:
        answer("trend", 0, {"model": model, "duration": 100.0}, MIN_WIDTH_PX)
    for compensator in COMPENSATORS:
        answer("trend", 0, {"compensator": compensator, "duration": 100.0}, MIN_WIDTH_PX)
    for kind in ("ramp", "sine", "jump"):
        answer(kind, 0, {}, MIN_WIDTH_PX)

"""What the textbook screen shows: valves under a ramp, the describing function at work, the jump between cycles."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.web.textbook_text import describe_crossings, describe_jump, describe_ramp, describe_sine
from stiction.apps.web.trend_data import thin_columns
from stiction.report.plain_blocks import blocks_to_plain
from stiction.simulation.swing import measure_swing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.apps.web.textbook_settings import TextbookSettings
    from stiction.models import Loop

__all__ = ["draw_nyquist", "drive_by_sine", "simulate_jump", "simulate_ramps"]

RAMP_SAMPLES = 800
"""Samples of the rising part of the ramp, and of the falling part [-]."""
SINE_SAMPLES, SINE_PERIODS = 720, 3
"""Samples of a period of the sine, and periods driven; the last is drawn [-]."""
SINE_OMEGA = 0.3
"""Frequency of the sine [rad/s]."""
JUMP_BEGIN, JUMP_DURATION = 200.0, 500.0
"""Begin of the pulse and length of the simulation [s]."""
REST_LEVELS_PER_BAND = 10.0
"""Rest levels of the stem are counted to this share of the stiction band [1/band]."""


def simulate_ramps(settings: TextbookSettings, width: int = 1200) -> dict[str, Any]:
    """Stroke each valve model up a ramp and down again.

    `settings`: S, J, r, and rate and height of the ramp. `width`: width of the plot [px]. Returns `time` [s], `op` and
    `position` (model -> stem) [% of span], and `behaviour` (model -> sentence).

    Examples
    --------
    >>> from stiction.apps.web.textbook_settings import TextbookSettings
    >>> simulate_ramps(TextbookSettings(S=5.0, J=2.0))["behaviour"]["Ideal"]
    'The stem follows OP.'
    """
    from stiction.simulation import stroke

    rise = np.linspace(0.0, settings.height, RAMP_SAMPLES + 1)
    op = np.concatenate([rise, rise[-2::-1]])
    dt = settings.height / settings.rate / RAMP_SAMPLES
    position: dict[str, NDArray[np.float64]] = {}
    for name, valve in settings.ramp_valves().items():
        mv = stroke(valve, op, dt, mv_start=0.0).mv
        assert mv is not None
        position[name] = mv
    samples, thinned = thin_columns({"": op, **position}, width)
    return {
        "time": samples * dt,
        "op": thinned.pop(""),
        "position": thinned,
        "behaviour": {name: describe_ramp(mv[: RAMP_SAMPLES + 1]) for name, mv in position.items()},
    }


def drive_by_sine(settings: TextbookSettings) -> dict[str, Any]:
    """Drive the valve by a sine and compare the stem with the fundamental that N(A) describes.

    `settings`: model, S, J and amplitude. Returns `phase` [degrees], `op`, `position` and `fundamental` [% of span]
    over one period; `N` as [real, imaginary] and `inverse`, -1/N, None where the stem does not move; `sentence`.
    """
    from stiction.limitcycle import describing_function
    from stiction.simulation import stroke

    valve, amplitude = settings.valve(), settings.amplitude
    angle = 2.0 * math.pi * np.arange(SINE_SAMPLES * SINE_PERIODS + 1) / SINE_SAMPLES
    op = amplitude * np.sin(angle)
    start = settings.first_rest_level()
    mv = stroke(valve, op, 2.0 * math.pi / (SINE_OMEGA * SINE_SAMPLES), mv_start=start).mv
    assert mv is not None
    last = slice(-SINE_SAMPLES - 1, None)
    N = complex(describing_function(valve, amplitude))
    angle = angle[last] - angle[last][0]
    fundamental = amplitude * (N.real * np.sin(angle) + N.imag * np.cos(angle))
    inverse = None if N == 0.0 else -1.0 / N
    return {
        "phase": np.degrees(angle),
        "op": op[last],
        "position": mv[last],
        "fundamental": fundamental,
        "N": [N.real, N.imag],
        "inverse": None if inverse is None else [inverse.real, inverse.imag],
        "sentence": describe_sine(amplitude, N),
    }


def draw_nyquist(settings: TextbookSettings) -> dict[str, Any]:
    """Cross L(j omega) of the paper's example loop with -1/N(A); takes up to 1 s, so that it runs in another process.

    `settings`: model, S, J, factor on the loop gain, dead time. Returns `figure`, and `sentence` that says which limit
    cycles there are.
    """
    from stiction.limitcycle import predict_limit_cycles
    from stiction.report.figures.limit_cycles import nyquist_plot
    from stiction.report.pages.limit_cycles import cycle_table

    loop = _example_loop(settings)
    cycles = predict_limit_cycles(loop)
    figure, table = blocks_to_plain([nyquist_plot(loop, cycles), cycle_table(cycles)])
    return {"figure": figure, "table": table, "sentence": describe_crossings(loop, cycles)}


def simulate_jump(settings: TextbookSettings, width: int = 1200) -> dict[str, Any]:
    """Disturb the paper's example loop in its limit cycle by a pulse of load, as in Fig. 8.

    `settings`: size and length of the pulse. `width`: width of the plot [px]. Returns `time` [s], `op`, `pv` and `mv`,
    the `pulse` as [begin, end] [s], and `sentence`.
    """
    from stiction.paper.fig7 import EXAMPLE_LOOP
    from stiction.simulation import simulate

    dt, level = EXAMPLE_LOOP.dt, EXAMPLE_LOOP.valve.d / 2.0  # pyright: ignore[reportAttributeAccessIssue]
    time = np.arange(round(JUMP_DURATION / dt)) * dt
    end = JUMP_BEGIN + settings.length
    load = np.where((time >= JUMP_BEGIN) & (time < end), settings.pulse, 0.0) + level
    record = simulate(EXAMPLE_LOOP, sp=0.0, duration=JUMP_DURATION, disturbance=load, op_start=level)
    assert record.pv is not None
    assert record.mv is not None
    parts = (slice(round(100.0 / dt), round(JUMP_BEGIN / dt)), slice(-round(120.0 / dt), None))
    swings = [measure_swing(record.op[part], dt) for part in parts]
    levels = [_count_levels(record.mv[part], 2.0 * level) for part in parts]
    samples, thinned = thin_columns({"op": record.op, "pv": record.pv, "mv": record.mv}, width)
    return {
        "time": samples * dt,
        **thinned,
        "pulse": [JUMP_BEGIN, end],
        "sentence": describe_jump(settings, swings, levels),
    }


def _example_loop(settings: TextbookSettings) -> Loop:
    """The paper's example loop with another valve, loop gain and dead time."""
    from stiction.models import TransferFunction
    from stiction.paper.fig7 import EXAMPLE_LOOP

    process: Any = EXAMPLE_LOOP.process
    other = TransferFunction(settings.gain_factor * process.num, process.den, settings.dead_time)
    return replace(EXAMPLE_LOOP, valve=settings.valve(), process=other)


def _count_levels(mv: NDArray[np.float64], band: float) -> int:
    """Positions at which the stem rests."""
    return int(np.unique(np.round(REST_LEVELS_PER_BAND * mv / band)).size)

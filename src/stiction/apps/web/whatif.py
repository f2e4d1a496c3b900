"""What the loop would do: the simulated trend of the what-if screen and its predicted limit cycles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.apps.web.trend_data import thin_columns
from stiction.apps.web.whatif_text import describe_cycles, describe_trend
from stiction.limitcycle.continuous_form import continuous_form
from stiction.simulation.swing import Swing, find_first_rise, measure_swing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.apps.web.whatif_settings import WhatIfSettings
    from stiction.limitcycle import LimitCycle

__all__ = ["Trend", "make_start_load", "predict_cycles", "simulate_trend"]

NOISE_SEED = 0
"""Seed of the simulated noise, so that the same settings give the same picture."""


@dataclass(frozen=True, slots=True)
class Trend:
    """What the screen draws of one simulation."""

    time: NDArray[np.float64]
    """Time [s], shape (n_points,)."""
    pv: NDArray[np.float64]
    """Process variable [PV units], shape (n_points,)."""
    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_points,)."""
    mv: NDArray[np.float64]
    """Valve position [% of span], shape (n_points,)."""
    sentence: str
    """What the loop does, in a sentence or two."""
    op_swing: Swing
    """How OP swings in the part that is shown."""
    pv_swing: Swing
    """How PV swings in it."""


def simulate_trend(settings: WhatIfSettings, width: int = 1200) -> Trend:
    """Simulate the loop until it has settled, and return the next part of it.

    `width`: width of the plot [px]; each signal keeps its lowest and highest value of every pixel. Gives
    `settings.duration` of the loop, from a rise of OP through its middle. Raises ParameterError when the settings give
    no loop.

    Examples
    --------
    >>> from stiction.apps.web.whatif_settings import WhatIfSettings
    >>> trend = simulate_trend(WhatIfSettings(S=5.0, J=2.0))
    >>> trend.sentence.startswith("The simulated loop oscillates")
    True
    """
    from stiction.simulation import simulate

    loop, dt = settings.loop, settings.dt
    settled, shown = round(settings.settling_time / dt), round(settings.duration / dt)
    n = settled + 2 * shown
    load = make_start_load(settings, n)
    record = simulate(
        loop, settings.sp, n * dt, load, NOISE_SEED, pv_start=settings.sp, op_start=settings.op, tag="what-if"
    )
    assert record.pv is not None
    assert record.mv is not None
    first = settled + find_first_rise(record.op[settled : settled + shown])
    pv, op, mv = (x[first : first + shown] for x in (record.pv, record.op, record.mv))
    op_swing, pv_swing = (measure_swing(x, dt, noisy=settings.noise > 0.0) for x in (op, pv))
    samples, thinned = thin_columns({"pv": pv, "op": op, "mv": mv}, width)
    sentence = describe_trend(settings, op_swing, pv_swing, op, pv)
    return Trend(dt * samples, **thinned, sentence=sentence, op_swing=op_swing, pv_swing=pv_swing)


def make_start_load(settings: WhatIfSettings, n: int) -> NDArray[np.float64]:
    """Return the load that starts the oscillation [% of span], shape (n,): a pulse that breaks the stem loose.

    A stem that only rests and jumps would return to the point where it started and stay there, so half a jump of
    load remains after the pulse.
    """
    form, load = continuous_form(settings.loop.valve), np.zeros(n)
    if form is not None and form.staircase:
        load += form.jump / 2.0
    pulse = max(round((settings.dead_time + settings.tau) / settings.dt), 3)
    load[:pulse] += 0.7 * (settings.S + settings.J) if settings.model != "ideal" else 1.0
    return load


def predict_cycles(settings: WhatIfSettings) -> dict[str, Any]:
    """Predict the limit cycles of the loop; takes 0.02 to 1.4 s, so that it runs in another process.

    `settings`: the loop; a compensator is left out, because no describing function covers it. Returns `sentence`, and
    `cycles`: a list of `kind`, `stable`, `period_s`, `amplitude_op` [% of span], `amplitude_pv` [PV units], `family`,
    `exact` and `trust`, the exact cycle where there is one. Raises ParameterError when the settings give no loop, or
    the loop has no point of rest.
    """
    from stiction.limitcycle import predict_limit_cycles

    plain = replace(settings, compensator="none", noise=0.0)
    cycles = predict_limit_cycles(plain.loop)
    rows = [_row(cycle) for cycle in cycles]
    return {"sentence": describe_cycles(settings, plain.loop, rows), "cycles": rows}


def _row(cycle: LimitCycle) -> dict[str, Any]:
    """What the screen shows of one cycle."""
    best = cycle.exact or cycle
    return {
        "kind": cycle.kind,
        "stable": best.stable,
        "period_s": best.period,
        "amplitude_op": best.amplitude,
        "amplitude_pv": best.amplitude_pv,
        "family": cycle.family,
        "exact": cycle.exact is not None or cycle.method != "describing function",
        "trust": cycle.trust,
    }

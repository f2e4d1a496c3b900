"""A physical valve as data-driven models: their parameters, and the error of each model."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import Result
from stiction.errors import MAX_SAMPLES, ParameterError, require_count, require_positive
from stiction.models.valves import Choudhury, He, HeWang, Kano, PhysicalValve, Srinivasan, Stenman
from stiction.models.valves.he_wang import overshoot_factor
from stiction.simulation.critical_rates import critical_rate
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Valve

__all__ = ["Reduction", "ReductionError", "reduce_valve"]

_RATE_FRACTIONS = (0.2, 0.7, 1.5, 5.0)
"""Rates of the input signals over the critical rate [-]."""
_DEFAULT_RATE = 1.0
"""Rate used for a valve without a critical rate [% of span / s]."""


@dataclass(frozen=True, slots=True)
class ReductionError:
    """Error of a data-driven model against the physical valve on one signal."""

    model: str
    """Name of the data-driven model."""
    signal: str
    """Description of the input."""
    rate: float
    """Highest rate of the input [% of span / s]."""
    maximum: float
    """Largest difference of the valve positions [% of travel]."""
    rms: float
    """Root mean square of the difference [% of travel]."""


@dataclass(frozen=True, slots=True)
class Reduction(Result):
    """Parameters of the data-driven models for a physical valve, and the error of each model."""

    fs: float
    """Static friction band, 100 F_s / (A dP) [% of span]."""
    fd: float
    """Dynamic friction band, 100 F_c / (A dP) [% of span]."""
    S: float
    """Deadband plus stickband, fs + fd [% of span]."""
    J: float
    """Slip jump, fs - fd [% of span]."""
    sb: float
    """Stick band, fs [% of span]."""
    sj: float
    """Stick jump, fs - fd [% of span]."""
    r: float
    """Rate below which a ramp gives stairs [% of span / s]."""
    K: float
    """Overshoot of a slip, from the damping ratio [-]."""
    gain: float
    """Steady travel per OP, A dP / (K stroke) [-]."""
    offset: float
    """OP that balances the preload at 0 % of travel [% of span]."""
    errors: tuple[ReductionError, ...]
    """Difference of each model from the physical valve on each signal."""

    def valves(self) -> dict[str, Valve]:
        """Data-driven valves with these parameters, by name.

        Their input is `gain` times (OP - `offset`); their bands are multiplied by `gain` [% of travel].
        """
        fs, fd, S, J, r = (self.gain * band for band in (self.fs, self.fd, self.S, self.J, self.r))
        return {
            "Stenman": Stenman(fs),
            "Choudhury": Choudhury(S, J),
            "Kano": Kano(S, J),
            "He": He(fs, fd),
            "HeWang": HeWang(fs, fd, self.K),
            "Srinivasan": Srinivasan(fs, J, r),
        }

    def best(self, signal: str) -> ReductionError:
        """Error of the best model on one of the signals, by its RMS [% of travel]."""
        return min((error for error in self.errors if error.signal == signal), key=lambda error: error.rms)

    def summary(self) -> str:
        """Summary in two sentences."""
        worst = {name: max(e.rms for e in self.errors if e.model == name) for name in self.valves()}
        errors = ", ".join(f"{name} {rms:.2f} %" for name, rms in sorted(worst.items(), key=lambda item: item[1]))
        return (
            f"S = {self.S:.2f} %, J = {self.J:.2f} %, sb = {self.sb:.2f} %, sj = {self.sj:.2f} %, "
            f"r = {self.r:.3g} %/s. "
            f"Largest RMS error over the signals: {errors}."
        )


def reduce_valve(valve: PhysicalValve, *, samples: int = 4000, amplitude: float = 30.0) -> Reduction:
    r"""Compute the parameters of the data-driven models for a physical valve.

    .. math:: fs = sb = \frac{100 F_s}{A\,\Delta P}, \quad fd = \frac{100 F_c}{A\,\Delta P}, \quad
              S = fs + fd, \quad J = sj = fs - fd

    and r is the critical rate. The error of each model is its difference from the physical valve on ramps and
    sines about the middle of the travel, with peak rates below and above the critical rate.

    Parameters
    ----------
    valve : PhysicalValve
        The valve with its lag and positioner; the parameters depend only on friction, area and spring.
    samples : int
        Samples of each signal, 2 or more [-].
    amplitude : float
        Half of the range that the signals go through [% of span].

    Returns
    -------
    Reduction
        The parameters and the errors.

    Raises
    ------
    ParameterError
        When the valve is not a `PhysicalValve`, `amplitude` is not positive, or `samples` is no whole number of 2 or
        more.

    References
    ----------
    srinivasan2008, section V; the map of parameters is derived in this project.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.models.parameter_sets import nominal
    >>> found = st.reduce_valve(nominal())
    >>> round(found.S, 2), round(found.J, 4)
    (23.99, 1.2968)
    """
    amplitude, samples = require_positive("amplitude", amplitude, "% of span"), require_count("samples", samples)
    if not 2 <= samples <= MAX_SAMPLES:
        raise ParameterError(f"samples = {samples} is out of range; give 2 to {MAX_SAMPLES:,}.")
    critical = critical_rate(valve)
    fs, fd = (100.0 * force / valve.force_span for force in (valve.static, valve.coulomb))
    K = overshoot_factor(valve.damping_ratio)
    bands = Reduction(
        fs, fd, S=fs + fd, J=fs - fd, sb=fs, sj=fs - fd, r=critical.rate, K=K, gain=valve.gain,
        offset=valve.offset, errors=(),
    )  # fmt: skip
    errors: list[ReductionError] = []
    continuous = replace(valve, hold="linear")
    middle = 50.0 / valve.gain + valve.offset if math.isfinite(valve.travel[0]) else valve.offset
    for rate in (fraction * (critical.rate or _DEFAULT_RATE) for fraction in _RATE_FRACTIONS):
        for signal, dt, op in _input_signals(rate, amplitude, samples):
            op = op + middle
            start = valve.gain * (op[0] - valve.offset)
            truth = stroke(continuous, op, dt, mv_start=start).mv
            errors += [
                ReductionError(name, f"{signal}, {rate:.3g} %/s", rate, *_position_error(model, op, dt, bands, truth))
                for name, model in bands.valves().items()
            ]
    return replace(bands, errors=tuple(errors))


def _input_signals(rate: float, amplitude: float, samples: int) -> list[tuple[str, float, NDArray[np.float64]]]:
    """Ramp and sine about 0 that reach `rate`: name, sampling period [s] and values, shape (samples,)."""
    share = np.linspace(0.0, 1.0, samples)
    ramp, period = 2.0 * amplitude / rate, 2.0 * math.pi * amplitude / rate
    sine = amplitude * np.sin(4.0 * math.pi * share)
    return [
        ("ramp", ramp / (samples - 1), amplitude * (2.0 * share - 1.0)),
        ("sine", 2.0 * period / (samples - 1), sine),
    ]


def _position_error(
    model: Valve, op: NDArray[np.float64], dt: float, bands: Reduction, truth: NDArray[np.float64] | None
) -> tuple[float, float]:
    """Largest and RMS difference [% of travel]."""
    mv = stroke(model, bands.gain * (op - bands.offset), dt).mv
    assert mv is not None
    assert truth is not None
    difference = mv - truth
    return float(np.abs(difference).max()), float(np.sqrt(np.mean(difference**2)))

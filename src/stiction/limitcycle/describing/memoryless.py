"""Nonlinearities that are not sticky valves: for comparison, and to check against other software."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stiction.errors import ParameterError, require_not_negative, require_positive

__all__ = ["Deadband", "Quantiser", "Relay", "Saturation"]


@dataclass(frozen=True)
class Saturation:
    """Unit slope up to a limit.

    Parameters
    ----------
    limit : float
        Largest output [% of span].

    Examples
    --------
    >>> complex(Saturation(1.0).describing_function(np.array([2.0]))[0]).real.__round__(4)
    0.609
    """

    limit: float

    def __post_init__(self) -> None:
        require_positive("limit", self.limit, "% of span")

    def describing_function(self, amplitude):
        """N(A), shape of `amplitude` [% of span]."""
        ratio = np.minimum(self.limit / amplitude, 1.0)
        return (2.0 / math.pi * (np.arcsin(ratio) + ratio * np.sqrt(1.0 - ratio**2))).astype(complex)

    def jumps(self, largest: float) -> list[float]:  # noqa: ARG002
        """Amplitudes at which N has a corner or a jump [% of span]."""
        return [self.limit]


@dataclass(frozen=True)
class Relay:
    """Relay with hysteresis: +height above +hysteresis, -height below -hysteresis, the old value between.

    Parameters
    ----------
    height : float
        Output [% of span].
    hysteresis : float
        Input that switches it [% of span].

    Examples
    --------
    >>> complex(Relay(1.0, 0.5).describing_function(np.array([1.0]))[0]).imag.__round__(4)
    -0.6366
    """

    height: float
    hysteresis: float = 0.0

    def __post_init__(self) -> None:
        require_positive("height", self.height, "% of span")
        require_not_negative("hysteresis", self.hysteresis, "% of span")

    def describing_function(self, amplitude):
        """N(A), shape of `amplitude` [% of span]; 0 below the hysteresis."""
        ratio = self.hysteresis / amplitude
        root = np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
        return np.where(ratio > 1.0, 0.0, 4.0 * self.height / (math.pi * amplitude) * (root - 1j * ratio))

    def jumps(self, largest: float) -> list[float]:  # noqa: ARG002
        """Amplitudes at which N has a corner or a jump [% of span]."""
        return [self.hysteresis] if self.hysteresis else []


@dataclass(frozen=True)
class Deadband:
    """Deadband (play, backlash): the stem follows at half the width and rests for the full width after a reversal.

    Parameters
    ----------
    width : float
        Deadband [% of span], the S of a two-parameter valve with J = 0.

    Examples
    --------
    >>> complex(Deadband(1.0).describing_function(np.array([1.0]))[0]).imag.__round__(4)
    -0.3183
    """

    width: float

    def __post_init__(self) -> None:
        require_positive("width", self.width, "% of span")

    def describing_function(self, amplitude):
        """N(A), shape of `amplitude` [% of span]; 0 below half the width."""
        x = 1.0 - np.minimum(self.width / amplitude, 2.0)
        real = 0.5 + (np.arcsin(x) + x * np.sqrt(np.maximum(1.0 - x**2, 0.0))) / math.pi
        return real - 1j * (1.0 - x**2) / math.pi

    def jumps(self, largest: float) -> list[float]:  # noqa: ARG002
        """Amplitudes at which N has a corner or a jump [% of span]."""
        return [self.width / 2.0]


@dataclass(frozen=True)
class Quantiser:
    """Rounds to the nearest multiple of a step: like Stenman's valve, but without memory.

    Parameters
    ----------
    step : float
        Distance between levels [% of span].

    Notes
    -----
    N(A) = (4 q / (pi A)) sum_i sqrt(1 - ((2 i - 1) q / (2 A))^2) is real: without memory there is no phase lag
    (srinivasan2008, section V.B).

    Examples
    --------
    >>> complex(Quantiser(1.0).describing_function(np.array([1.0]))[0]).real.__round__(4)
    1.1027
    """

    step: float

    def __post_init__(self) -> None:
        require_positive("step", self.step, "% of span")

    def describing_function(self, amplitude):
        """N(A), shape of `amplitude` [% of span]."""
        amplitude = np.asarray(amplitude, dtype=float)
        n = int(np.max(amplitude, initial=0.0) / self.step + 0.5)
        if n > 1_000_000:
            raise ParameterError(f"amplitude is {n} steps of {self.step:g} %; give at most 1000000 steps.")
        total = np.zeros(amplitude.shape)
        for i in range(1, n + 1):
            total += np.sqrt(np.maximum(1.0 - ((2 * i - 1) * self.step / (2.0 * amplitude)) ** 2, 0.0))
        return (4.0 * self.step / (math.pi * amplitude) * total).astype(complex)

    def jumps(self, largest: float) -> list[float]:
        """Amplitudes at which N has a corner or a jump [% of span]."""
        return [(i + 0.5) * self.step for i in range(int(largest / self.step + 0.5))]

"""Haegglund's knocker: short pulses on the controller's output, in the direction in which the output moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.models.compensators.component import (
    Compensator,
    CompensatorState,
    StictionEstimate,
    advance_pulse_train,
    pulse_state,
    sign,
)
from stiction.models.numba_compile import inline_kernel

__all__ = ["Knocker", "knocker_step"]


@inline_kernel
def knocker_step(op: float, s: CompensatorState, amplitude: float, width: float, interval: float) -> CompensatorState:
    """One sample; `width` and `interval` in samples."""
    reference, latest, elapsed, phase = advance_pulse_train(op, s, interval)
    pulse = 0.0
    if phase > 0.0 and elapsed < width:
        pulse = amplitude * sign(op - reference)
    return pulse_state(op, pulse, 0.0, reference, latest, elapsed, phase)


@dataclass(frozen=True)
class Knocker(Compensator):
    r"""Pulses of constant amplitude.

    .. math:: u(t) = u_c(t) + a\,\mathrm{sgn}(u_c(t) - u_c(t_p)) \quad\text{in the pulse},
              \qquad u(t) = u_c(t) \quad\text{between pulses},

    where :math:`t_p` is the onset of the previous pulse. The first pulse comes one interval after the start.

    Parameters
    ----------
    amplitude : float
        Height of a pulse [% of span].
    width : float
        Length of a pulse [s], rounded to whole samples.
    interval : float
        Time from the start of one pulse to the start of the next [s], rounded to whole samples; above `width`.

    Raises
    ------
    ParameterError
        When a value is outside its limits.

    Notes
    -----
    Needs integral action: the pulses follow the direction of the OP. Stem travel and reversals rise. For J < S, pulses
    as high as S are worse than none, in PV and in stem travel. The loop can lock to the pulses in more than one way,
    with PV deviations that differ by about 10 %.

    `for_stiction` gives amplitude S / 2 (after Srinivasan and Rengaswamy, 2005: half the stiction band), a width of 2
    samples and an interval of 5 samples (Haegglund: amplitude 1 to 4 %, width 1 to 2 samples, interval 2 to 5).

    References
    ----------
    After haegglund2002 and srinivasan2005c.

    Examples
    --------
    >>> import stiction as st
    >>> st.Knocker.for_stiction(S=3.0, J=1.0, dt=1.0)
    Knocker(amplitude=1.5, width=2.0, interval=5.0)
    """

    code: ClassVar[int] = 1

    amplitude: float
    width: float
    interval: float

    def __post_init__(self) -> None:
        self._require(positive={"width": "s", "interval": "s"}, not_negative={"amplitude": "% of span"})
        self._pauses(self.width, self.interval)

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(estimate.S / 2.0, 2.0 * estimate.dt, 5.0 * estimate.dt)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Amplitude [% of span], width and interval [samples]."""
        return (self.amplitude, self._samples("width", dt), self._samples("interval", dt))

"""Four moves without a model (after Cuadros, Munaro and Munareto): sizes from the observed cycle, not from S and J."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.errors import ParameterError
from stiction.models.compensators.component import Compensator, CompensatorState, StictionEstimate
from stiction.models.compensators.observe_and_move import observe_and_move, signal_to_valve
from stiction.models.numba_compile import inline_kernel

__all__ = ["FourMove", "four_move_step"]


@inline_kernel
def four_move_step(
    op: float,
    sp: float,
    pv: float,
    s: CompensatorState,
    band: float,
    reach: float,
    share: float,
    move: float,
    cycles: float,
    tries: float,
) -> CompensatorState:
    """One sample; `move` in samples."""
    s = observe_and_move(op, sp, pv, op, s, 4.0, band, move, cycles, tries)
    if s.phase == 0.0:
        return s
    mean = s.total / s.samples
    swing = s.high - s.low
    signal = mean
    if s.phase == 1.0:
        signal = mean + reach * swing
    elif s.phase == 2.0:
        signal = mean - reach * swing
    elif s.phase == 3.0:
        signal = mean + share * swing
    return signal_to_valve(signal, mean, s)


@dataclass(frozen=True)
class FourMove(Compensator):
    """Open the loop and centre the stem by four moves, sized by the swing A of the OP in the cycle.

    With m the mean of the OP over whole cycles, the signal goes to ``m + reach A``, ``m - reach A``, ``m + share A``
    and ``m``. A sticky valve cycles only if the OP swings by S or more, so that A >= S: the first two moves break the
    stem away whatever its state, the third carries it up to m + share A - fd with fd = (S - J) / 2, the fourth is too
    small to move it, and leaves the signal in the middle. As 0 <= fd <= A / 2, share = 1/4 leaves the stem within A / 4
    of m.

    Parameters
    ----------
    band : float
        The controller takes over when the error leaves this band, and a cycle counts when it does [PV units].
    reach : float
        Height of the first two moves, in swings of the OP, 1 or more [-].
    share : float
        Height of the third move, in swings of the OP, at most 1/2 [-].
    move : float, optional
        How long each of the first three moves holds [s], rounded to whole samples; one sample by default.
    cycles : int
        Cycles over which the mean is taken, after a first cycle that gives the swing of the OP [-].
    tries : int
        Successive failed moves after which the compensator waits for a change of set point [-].

    Raises
    ------
    ParameterError
        When a value is outside its limits.

    Notes
    -----
    The paper has four moves and no model; their sizes are derived above. The cycle must be symmetric: if the stem rests
    longer on one side, the mean of the OP is not the OP at which the PV equals the set point. Observation, hand-over to
    the controller and limits are those of `TwoMove`.

    `for_stiction` uses S and J for the band alone: J / 2 in PV units (at least S / 40) plus five standard deviations of
    the noise. With a band that is too wide no cycle is detected, and nothing happens. The method works well for J < S
    and poorly for J = S.

    References
    ----------
    After cuadros2012b.

    Examples
    --------
    >>> import stiction as st
    >>> st.FourMove.for_stiction(S=3.0, J=1.0, dt=1.0, gain=3.0)
    FourMove(band=1.5, reach=1.0, share=0.25, move=None, cycles=2, tries=3)
    """

    code: ClassVar[int] = 7

    band: float
    reach: float = 1.0
    share: float = 0.25
    move: float | None = None
    cycles: int = 2
    tries: int = 3

    def __post_init__(self) -> None:
        self._require(positive={"band": "PV units"}, not_negative={"share": "-"})
        if self.share > 0.5:
            raise ParameterError(
                f"share = {self.share:g} is above 1/2: every stem would end above the middle; give 1/2 or less."
            )
        if self.move is not None:
            self._require(positive={"move": "s"}, not_negative={})
        self._at_least("reach", 1.0)
        self._at_least("cycles", 1)
        self._at_least("tries", 1)

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(estimate.gain * max(estimate.J, estimate.S / 20.0) / 2.0 + 5.0 * estimate.noise)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """Band [PV units], reach and share [-], move [samples], cycles and tries [-]."""
        move = 1.0 if self.move is None else self._samples("move", dt)
        return (self.band, self.reach, self.share, move, float(self.cycles), float(self.tries))

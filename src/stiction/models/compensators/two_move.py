"""Two moves (after Srinivasan and Rengaswamy, 2008) that bring the stem to its mean position and leave it there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from stiction.errors import ParameterError
from stiction.models.compensators.component import Compensator, CompensatorState, StictionEstimate, sign
from stiction.models.compensators.observe_and_move import observe_and_move, signal_to_valve
from stiction.models.numba_compile import inline_kernel

__all__ = ["TwoMove", "two_move_step"]


@inline_kernel
def two_move_step(
    op: float,
    sp: float,
    pv: float,
    s: CompensatorState,
    S: float,
    J: float,
    band: float,
    reach: float,
    move: float,
    cycles: float,
    tries: float,
) -> CompensatorState:
    """One sample; `move` in samples."""
    size = S
    if s.cycle_count > 1.0:
        size = min(S, 0.9 * (s.high - s.low))
    fd = 0.5 * (size - size * J / S)
    position = s.position
    if abs(op - position) > size - fd:
        position = op - fd * sign(op - position)
    s = observe_and_move(op, sp, pv, position, s, 2.0, band, move, cycles, tries)
    if s.phase == 0.0:
        return s
    position = s.total / s.samples
    signal = position - fd
    if s.phase == 1.0:
        signal = signal + reach * size
    return signal_to_valve(signal, position, s)


@dataclass(frozen=True)
class TwoMove(Compensator):
    """Open the loop and move the stem to the mean of its cycle by two moves.

    While the loop cycles, He's model with the bands of S and J estimates the stem position. Its mean over whole cycles
    is the position that holds the PV at the set point. Then the controller tracks, and the signal goes

    1. up to ``x - fd + reach S``, which breaks the stem away whatever its state,
    2. down to ``x - fd``: after more than S of travel the stem follows, fd above its input, and stops at x,

    with x the mean and fd = (S - J) / 2. The process then has one cycle's time to settle, and the valve rests.
    No loop cycles with an OP swing below S. An S above 0.9 times the observed swing is therefore too large, and S and
    J are reduced in proportion.

    Parameters
    ----------
    S : float
        Deadband plus stickband, identified [% of span].
    J : float
        Slip jump, identified, at most S [% of span].
    band : float
        The controller takes over when the error leaves this band, and a cycle counts when it does [PV units].
    reach : float
        Height of the first move over the second, in bands S, above 1 [-].
    move : float, optional
        How long the first move holds [s], rounded to whole samples; one sample by default.
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
    The published method leaves the loop open and does not react to load or set point afterwards. Here the controller
    takes over without a bump when the set point changes or the error leaves `band` (not in the first cycle's time after
    the moves). Then a new observation begins. The compensator never acts while the set point keeps changing (the
    secondary loop of a cascade) or while the error is within the band, and not for long on an integrating process.

    `for_stiction` gives a band of J / 3 in PV units (of S / 60 at least) and five standard deviations of the noise.

    Results with these settings (Kano valve, FOPDT 3 / (10 s + 1) with 10 s dead time, PI 0.2, 10 s, dt 1 s, 12 set
    points, 8 000 s): runs that end at rest, and root mean square error after 2 000 s over the error without a
    compensator:

    =====  ===============  ===============  ===============
    S, J   30 % too low     exact            30 % too high
    =====  ===============  ===============  ===============
    3, 3   12 of 12, 0.15   12 of 12, 0.21   10 of 12, 0.49
    5, 2    9 of 12, 0.49   12 of 12, 0.19   12 of 12, 0.28
    3, 1    3 of 12, 0.81   12 of 12, 0.15   12 of 12, 0.23
    =====  ===============  ===============  ===============

    The other runs oscillate as without a compensator. If the cycle is smaller than the error of the moves, (S - J) / 2
    times the relative error of S, the moves cost more than they bring: this is so for J far below S.

    References
    ----------
    After srinivasan2008b; stem by he2007.

    Examples
    --------
    >>> import stiction as st
    >>> st.TwoMove.for_stiction(S=3.0, J=1.0, dt=1.0, gain=3.0)
    TwoMove(S=3.0, J=1.0, band=1.0, reach=1.5, move=None, cycles=2, tries=3)
    """

    code: ClassVar[int] = 6

    S: float
    J: float
    band: float
    reach: float = 1.5
    move: float | None = None
    cycles: int = 2
    tries: int = 3

    def __post_init__(self) -> None:
        self._require(positive={"S": "% of span", "band": "PV units"}, not_negative={"J": "% of span"})
        if self.J > self.S:
            raise ParameterError(
                f"J = {self.J:g} % exceeds S = {self.S:g} %: the rest position of such a stem cannot be computed from "
                "its "
                "input; give J <= S."
            )
        if self.move is not None:
            self._require(positive={"move": "s"}, not_negative={})
        self._at_least("reach", 1.0)
        self._at_least("cycles", 1)
        self._at_least("tries", 1)

    @classmethod
    def _settings(cls, estimate: StictionEstimate) -> Self:
        return cls(
            estimate.S,
            min(estimate.J, estimate.S),
            estimate.gain * max(estimate.J, estimate.S / 20.0) / 3.0 + 5.0 * estimate.noise,
        )

    def parameters(self, dt: float) -> tuple[float, ...]:
        """S and J [% of span], band [PV units], reach [-], move [samples], cycles and tries [-]."""
        move = 1.0 if self.move is None else self._samples("move", dt)
        return (self.S, self.J, self.band, self.reach, move, float(self.cycles), float(self.tries))

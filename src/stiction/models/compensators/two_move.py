"""Two moves (after Srinivasan and Rengaswamy, 2008): push the stem away, bring it to where it belongs, and stop."""

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
    if s.begun > 1.0:
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
    """Open the loop and put the stem where the cycle was about: two moves, then rest.

    While the loop cycles, the stem is followed by He's rule with the bands of S and J. Over whole cycles its mean is
    the position that holds the PV at the set point. Then the controller tracks, and the signal goes

    1. up to ``x - fd + reach S``, which breaks the stem away whatever its state,
    2. down to ``x - fd``: after more than S of travel the stem follows, fd above its input, and stops at x,

    with x the mean and fd = (S - J) / 2. After one more cycle's time for the process to settle the valve stands still.
    No loop cycles on a swing of the OP below S: an S above 0.9 of the swing seen is taken for an overestimate, and S
    and J are reduced to it in proportion.

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
        Cycles over which the mean is taken, after a first that shows the swing of the OP [-].
    tries : int
        Moves in a row without success after which the controller is left alone until the set point changes [-].

    Raises
    ------
    ParameterError
        When a value is outside its limits.

    Notes
    -----
    The published method opens the loop for good, and is blind to load and set point from then on. Here the controller
    takes over, bumpless, at once when the set point changes and when the error leaves `band`, except in the first
    cycle's time after the moves. It watches, and moves again. It never acts while the set point keeps changing (a
    cascade's slave), while the error stays within the band, or on an integrating process for long.

    `for_stiction` gives a band of J / 3 in PV units (of S / 60 at least) and five standard deviations of the noise.
    Simulated with it (Kano valve, FOPDT 3 / (10 s + 1) with 10 s dead time, PI 0.2, 10 s, dt 1 s, 12 set points, 8 000
    s): at rest in the end, and root mean square error after 2 000 s over that of the bare cycle:

    =====  ===============  ===============  ===============
    S, J   30 % too low     exact            30 % too high
    =====  ===============  ===============  ===============
    3, 3   12 of 12, 0.15   12 of 12, 0.21   10 of 12, 0.49
    5, 2    9 of 12, 0.49   12 of 12, 0.19   12 of 12, 0.28
    3, 1    3 of 12, 0.81   12 of 12, 0.15   12 of 12, 0.23
    =====  ===============  ===============  ===============

    The others cycle on as without a compensator. Where the cycle is smaller than the error of the moves, (S - J) / 2
    times the relative error of S, trying costs more than it brings: J far below S.

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
                f"J = {self.J:g} % exceeds S = {self.S:g} %: where such a stem comes to rest cannot be told from its "
                "input; give J <= S."
            )
        if self.move is not None:
            self._require(positive={"move": "s"}, not_negative={})
        self._at_least("reach", 1.0)
        self._at_least("cycles", 1)
        self._at_least("tries", 1)

    @classmethod
    def _settings(cls, given: StictionEstimate) -> Self:
        return cls(given.S, min(given.J, given.S), given.gain * max(given.J, given.S / 20.0) / 3.0 + 5.0 * given.noise)

    def parameters(self, dt: float) -> tuple[float, ...]:
        """S and J [% of span], band [PV units], reach [-], move [samples], cycles and tries [-]."""
        move = 1.0 if self.move is None else self._samples("move", dt)
        return (self.S, self.J, self.band, self.reach, move, float(self.cycles), float(self.tries))

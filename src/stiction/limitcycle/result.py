"""One limit cycle: amplitude, period, rest levels, stability and reliability."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stiction.display.json_form import Result

__all__ = ["LimitCycle"]


@dataclass(frozen=True)
class LimitCycle(Result):
    """A limit cycle of a loop, predicted by a describing function or solved exactly.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> cycle = st.predict_limit_cycles(loop, exact=False)[0]
    >>> round(cycle.amplitude, 4), round(cycle.period, 2), cycle.stable
    (0.573, 21.11, True)
    """

    _json_keys = (
        "method", "kind", "family", "amplitude", "period as period_s", "omega as omega_rad_per_s", "amplitude_pv",
        "amplitude_mv", "levels", "stable", "multipliers", "offset", "turns", "period_error", "amplitude_error",
        "trust", "exact",
    )  # fmt: skip

    method: str
    """"describing function", "continuous" (solved exactly in continuous time) or "sampled" (as simulated)."""
    kind: str
    """"cycle", or "boundary": at this amplitude N jumps; larger starts grow and smaller ones shrink from it."""
    family: str
    """Rest levels of a staircase: "half", "integer", or the offset [% of span] of another; else empty."""
    amplitude: float
    """Half peak to peak of the OP [% of span]."""
    period: float
    """Period [s]."""
    amplitude_pv: float
    """Half peak to peak of the PV [PV units]."""
    amplitude_mv: float
    """Half peak to peak of the stem [% of span]."""
    levels: tuple[float, ...]
    """Positions at which the stem rests, ascending [% of span]."""
    stable: bool | None
    """Whether small disturbances die out; None when it could not be decided."""
    multipliers: tuple[complex, ...] = ()
    """Factors on a small disturbance in one period, largest first; exact cycles only [-]."""
    offset: float | None = None
    """Offset of the rest levels from the point of rest of the frictionless loop [% of span]."""
    turns: int = 1
    """Oscillations after which the motion repeats; more than one when successive swings differ [-]."""
    exact: LimitCycle | None = None
    """The exact cycle of this prediction, if there is one."""
    section: tuple[float, ...] = ()
    """States of the linear part and the stem position [% of span] at the rest at the top, in deviations."""
    warning: str = ""
    """Warning about this cycle; empty when there is none."""

    @property
    def omega(self) -> float:
        """Frequency [rad/s]."""
        return 2.0 * math.pi / self.period

    @property
    def period_error(self) -> float | None:
        """Relative error of the predicted period against the exact cycle [-]."""
        return None if self.exact is None else self.period / self.exact.period - 1.0

    @property
    def amplitude_error(self) -> float | None:
        """Relative error of the predicted OP amplitude against the exact cycle [-]."""
        return None if self.exact is None else self.amplitude / self.exact.amplitude - 1.0

    @property
    def trust(self) -> str:
        """Reliability of the describing function for this cycle, in words."""
        if self.kind == "boundary":
            return "Where N jumps: it separates the cycles below and above, and is not an oscillation."
        if self.method != "describing function":
            return self.warning or "Exact."
        if self.exact is None:
            return self.warning or "Not checked against an exact cycle."
        worst = max(abs(self.period_error or 0.0), abs(self.amplitude_error or 0.0))
        off = f"period {_change(self.period_error)}, OP amplitude {_change(self.amplitude_error)}"
        if worst <= 0.02:
            return f"Good: {off} against the exact cycle."
        if worst <= 0.10:
            return f"Rough: {off} against the exact cycle."
        return f"Do not trust the describing function here: {off} against the exact cycle. Use the exact one."

    @property
    def description(self) -> str:
        """Kind, stability, period and amplitudes, for a sentence."""
        fate = {True: "stable", False: "unstable", None: "stability unknown"}[self.stable]
        name = f" ({self.family})" if self.family else ""
        return (
            f"{self.kind}{name}, {fate}: period {self.period:.4g} s, OP amplitude {self.amplitude:.4g} %, "
            f"PV amplitude {self.amplitude_pv:.4g}"
        )

    def summary(self) -> str:
        """Summary in one line."""
        return f"{self.description}, by {self.method}. {self.trust}"


def _change(error: float | None) -> str:
    """A relative error in percent, without a sign where it rounds to nothing."""
    percent = round(100.0 * (error or 0.0), 1)
    return f"{percent:+.1f} %" if percent else "0.0 %"

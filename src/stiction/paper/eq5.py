"""Eq. 5, the three-parameter valve, as printed and repaired, on a step, a ramp and a random input."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.json_form import Result
from stiction.models import Choudhury, He, Kano, Srinivasan
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["EQ5_SB", "EQ5_SJ", "Equation5", "InputReply", "Response", "equation5"]

EQ5_SB = 2.0
"""Stick band of the compared valve [% of span]."""
EQ5_SJ = 1.0
"""Jump of the compared valve [% of span]."""
EQ5_R = 0.1
"""Rate of the compared valve [% of span / s]."""
DT_S = 1.0
"""Sampling period [s]."""


@dataclass(frozen=True)
class InputReply:
    """Final stem position of a model after a step of the OP from 0 to 10 %."""

    model: str
    """The model, with its parameters."""
    last: float
    """Stem position twenty samples after the step [% of span]."""


@dataclass(frozen=True)
class Response:
    """Eq. 5 as printed and repaired under one input."""

    name: str
    """The input, in words."""
    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    op: NDArray[np.float64] = field(repr=False)
    """OP [% of span], shape (n_samples,)."""
    position: dict[str, NDArray[np.float64]] = field(repr=False)
    """Stem, `printed` and `corrected` [% of span], each of shape (n_samples,)."""
    difference: float
    """Largest difference of the two [% of span]."""
    increment: float
    """Largest change of the OP in a sample [% of span]."""


@dataclass(frozen=True)
class Equation5(Result):
    """Eq. 5 as printed and repaired."""

    replies: tuple[InputReply, ...]
    """Final stem position of each model after a step."""
    responses: tuple[Response, ...]
    """Step, ramp up and down, random walk."""

    def summary(self) -> str:
        """Summary in two sentences."""
        printed, repaired = self.replies[:2]
        apart = ", ".join(f"{response.name} {response.difference:.3g} %" for response in self.responses)
        return (
            f"After a step from 0 to 10 %, eq. 5 as printed stays at {printed.last:g} %. Repaired it ends at "
            f"{repaired.last:g} %, like the other models. Largest difference: {apart}."
        )


def equation5(seed: int = 0) -> Equation5:
    """Drive eq. 5 as printed and repaired, with sb = 2 %, sj = 1 %.

    `seed`: seed of the random walk. Returns as printed, the stem jumps by sj in the direction of du and keeps the
    excess of the OP over sb. After a step it never moves again, because du is 0 in the next sample. Repaired, it jumps
    to sb - sj from the OP, like the valves of Kano, He and Choudhury with S = 2 sb - sj, J = sj.

    References
    ----------
    srinivasan2008, eq. 5 (E6); kano2004, he2007, choudhury2005.

    Examples
    --------
    >>> from stiction.paper import equation5
    >>> [(reply.model, reply.last) for reply in equation5().replies[:2]]
    [('eq. 5, printed', 1.0), ('eq. 5, repaired', 9.0)]
    """
    step = np.r_[np.zeros(5), np.full(20, 10.0)]
    up = np.arange(0.0, 20.0, 0.15)
    ramp = np.r_[up, np.full(10, up[-1]), up[::-1]]
    walk = np.cumsum(np.random.default_rng(seed).normal(0.0, 0.7, 300))
    valves = {
        "eq. 5, printed": Srinivasan(EQ5_SB, EQ5_SJ, EQ5_R, as_printed=True),
        "eq. 5, repaired": Srinivasan(EQ5_SB, EQ5_SJ, EQ5_R),
        "Choudhury, S = 3, J = 1": Choudhury(2.0 * EQ5_SB - EQ5_SJ, EQ5_SJ),
        "Kano, S = 3, J = 1": Kano(2.0 * EQ5_SB - EQ5_SJ, EQ5_SJ),
        "He, fs = 2, fd = 1": He(EQ5_SB, EQ5_SB - EQ5_SJ),
    }
    replies = tuple(InputReply(name, float(_stem(valve, step)[-1])) for name, valve in valves.items())
    inputs = (("step", step), ("ramp up and down", ramp), ("random walk", walk))
    return Equation5(replies, tuple(_response(name, op) for name, op in inputs))


def _response(name: str, op: NDArray[np.float64]) -> Response:
    forms = {"printed": True, "corrected": False}
    position = {
        form: _stem(Srinivasan(EQ5_SB, EQ5_SJ, EQ5_R, as_printed=printed), op) for form, printed in forms.items()
    }
    apart = float(np.abs(position["printed"] - position["corrected"]).max())
    return Response(
        name, DT_S * np.arange(op.size, dtype=np.float64), op, position, apart, float(np.abs(np.diff(op)).max())
    )


def _stem(valve: Any, op: NDArray[np.float64]) -> NDArray[np.float64]:
    mv = stroke(valve, op, DT_S).mv
    assert mv is not None
    return mv

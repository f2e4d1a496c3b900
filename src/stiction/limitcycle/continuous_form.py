"""The continuous-time form of the data-driven valves: break away at sb, slip to a lag, follow while fast enough.

In continuous time the data-driven models differ only in when the stem rests again. Stenman's and He's never
follow (a staircase), Kano's and Choudhury's follow until the input turns, Srinivasan's while |du/dt| >= r.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from stiction.errors import ParameterError
from stiction.models import Choudhury, He, HeWang, Ideal, Kano, Srinivasan, Stenman, Table, Valve

__all__ = ["ContinuousValve", "continuous_form", "is_frictionless", "require_continuous_form"]


class ContinuousValve(NamedTuple):
    """A data-driven valve in continuous time."""

    sb: float
    """Input away from the resting stem that breaks it loose [% of span]."""
    lag: float
    """Distance of the moving stem from its input [% of span]; the slip jump is sb - lag."""
    rate: float
    """Rate of the input below which the stem rests again [% of span / s]."""

    @property
    def jump(self) -> float:
        """Slip jump [% of span]."""
        return self.sb - self.lag

    @property
    def staircase(self) -> bool:
        """True when the stem only rests and jumps; its rest levels are then `jump` apart."""
        return math.isinf(self.rate) and self.jump > 0.0


def continuous_form(valve: Valve) -> ContinuousValve | None:
    """Return the continuous-time form of a valve, or None when it has none.

    Returns None for physical valves, tables, eq. 5 as printed and Choudhury's valve with J > S.

    Examples
    --------
    >>> import stiction as st
    >>> continuous_form(st.Kano(S=3.0, J=1.0))
    ContinuousValve(sb=2.0, lag=1.0, rate=0.0)
    """
    if isinstance(valve, Stenman):
        form = ContinuousValve(valve.d, 0.0, math.inf)
    elif isinstance(valve, He):
        form = ContinuousValve(valve.fs, valve.fd, math.inf)
    elif isinstance(valve, HeWang):
        form = ContinuousValve(valve.fs, valve.fs - valve.K * (valve.fs - valve.fd), math.inf)
    elif isinstance(valve, Kano) or (isinstance(valve, Choudhury) and valve.J <= valve.S):
        form = ContinuousValve((valve.S + valve.J) / 2.0, (valve.S - valve.J) / 2.0, 0.0)
    elif (
        isinstance(valve, Srinivasan)
        and not valve.as_printed
        and not isinstance(valve.sb, Table)
        and not isinstance(valve.sj, Table)
    ):
        form = ContinuousValve(valve.sb, valve.sb - valve.sj, valve.r)
    else:
        return None
    if form.jump <= 1e-12 * form.sb:
        return ContinuousValve(form.sb, form.sb, 0.0)
    return form


def is_frictionless(valve: Valve) -> bool:
    """Whether a valve follows its input without friction: the ideal valve, or any with bands of 0."""
    form = continuous_form(valve)
    return isinstance(valve, Ideal) or (form is not None and form.sb == 0.0)


def require_continuous_form(valve: Valve) -> ContinuousValve:
    """Return the continuous-time form of a valve; raise when it has none."""
    form = continuous_form(valve)
    if form is None:
        raise ParameterError(
            f"{valve!r} has no continuous-time form; give Stenman, Kano, Choudhury (J <= S), He, HeWang or "
            "Srinivasan with constant bands, or search the sampled loop with sampled_limit_cycles."
        )
    return form

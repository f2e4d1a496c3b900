"""Eqs. 6 and 7, the describing function of eq. 4, as printed, corrected, and measured on the valve."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.json_form import Result
from stiction.limitcycle import describing_function
from stiction.models import Stenman
from stiction.simulation.stroke import stroke

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["EXAMPLE_D", "Equations6and7", "df_with_single_roots", "equations6and7", "measure_df"]

EXAMPLE_D = 0.5
"""Stiction band of the paper's example [% of span]."""
SAMPLES_PER_PERIOD = 20_000
"""Samples in a period of the sine [-]."""
PERIODS = 3
"""Periods of the sine; N is measured in the last [-]."""


@dataclass(frozen=True)
class Equations6and7(Result):
    """N(A) of eq. 4 over the amplitude in bands d; N depends on A / d alone."""

    ratio: NDArray[np.float64] = field(repr=False)
    """A / d [-], shape (n,)."""
    n: dict[str, NDArray[np.complex128]] = field(repr=False)
    """N by form [-], each of shape (n,): `printed` letter by letter, `roots repaired` (without E3), `corrected`, and
    `integer`, the other family of rest levels 0, +-d, ...; NaN beyond what the paper prints."""
    checked: NDArray[np.float64]
    """A / d at which N was measured [-], shape (n_checked,)."""
    numeric: dict[str, NDArray[np.complex128]]
    """N measured on the valve driven by a sine, families `half` and `integer` [-], each of shape (n_checked,)."""
    worst: dict[str, float]
    """Largest distance of each form from N measured on its family [-]."""

    def summary(self) -> str:
        """Summary in a sentence."""
        distances = ", ".join(f"{form} {apart:.2g}" for form, apart in self.worst.items())
        return f"Eqs. 6 and 7, largest distance from N measured on the valve: {distances}."


def equations6and7() -> Equations6and7:
    """Compare eqs. 6 and 7 with the valve of eq. 4.

    Returns Eq. 7 is right. Eq. 6 has its roots misprinted (E3) and misses a factor 2 on the inner root of its second
    branch (E4). Both hold for rest levels +-d/2, +-3d/2, ... only (E5).

    References
    ----------
    srinivasan2008, eqs. 4, 6, 7.

    Examples
    --------
    >>> from stiction.paper import equations6and7
    >>> worst = equations6and7().worst
    >>> worst["corrected"] < 1e-3, worst["roots repaired"] > 0.3
    (True, True)
    """
    valve = Stenman(EXAMPLE_D)
    ratio = np.linspace(0.4, 3.4, 601)
    n = {
        "printed": describing_function(valve, ratio * EXAMPLE_D, as_printed=True),
        "roots repaired": describing_function(valve, ratio * EXAMPLE_D, as_printed="roots repaired"),
        "corrected": describing_function(valve, ratio * EXAMPLE_D),
        "integer": describing_function(valve, ratio * EXAMPLE_D, family="integer"),
    }
    checked = np.array([0.6, 0.8, 0.95, 1.1, 1.4, 1.6, 1.8, 1.95, 2.2, 2.4])
    numeric = {family: measure_df(checked, family) for family in ("half", "integer")}
    forms = {
        "printed": describing_function(valve, checked * EXAMPLE_D, as_printed=True),
        "roots repaired": describing_function(valve, checked * EXAMPLE_D, as_printed="roots repaired"),
        "corrected": describing_function(valve, checked * EXAMPLE_D),
    }
    worst = {form: float(np.abs(values - numeric["half"]).max()) for form, values in forms.items()}
    integer = describing_function(valve, checked * EXAMPLE_D, family="integer")
    worst["integer"] = float(np.abs(integer - numeric["integer"]).max())
    return Equations6and7(ratio, n, checked, numeric, worst)


def measure_df(ratio: Any, family: str = "half") -> NDArray[np.complex128]:
    """N of eq. 4 at A / d = `ratio`, shape (n,): first harmonic of the valve's motion over its input.

    Examples
    --------
    >>> from stiction.paper.eqs6to7 import measure_df
    >>> [f"{n:.2f}" for n in measure_df([1.0, 2.0])]
    ['0.55-0.32j', '0.83-0.24j']
    """
    level = 0.5 * EXAMPLE_D if family == "half" else 0.0
    turn = 2.0 * math.pi * np.arange(PERIODS * SAMPLES_PER_PERIOD) / SAMPLES_PER_PERIOD
    last = turn[-SAMPLES_PER_PERIOD:]
    values = []
    for amplitude in np.atleast_1d(ratio) * EXAMPLE_D:
        mv = stroke(Stenman(EXAMPLE_D), amplitude * np.sin(turn), 1.0, mv_start=level).mv
        assert mv is not None
        values.append(
            2.0
            / (SAMPLES_PER_PERIOD * amplitude)
            * np.sum(mv[-SAMPLES_PER_PERIOD:] * (np.sin(last) + 1j * np.cos(last)))
        )
    return np.array(values)


def df_with_single_roots(ratio: float) -> float:
    """Real part of N at A / d = `ratio` if every root counted once, as in the printed second branch [-].

    Examples
    --------
    >>> from stiction.paper.eqs6to7 import df_with_single_roots
    >>> round(df_with_single_roots(1000.0), 3)
    0.5
    """
    levels = np.arange(1, math.floor(ratio + 0.5) + 1)
    return float(2.0 / (math.pi * ratio) * np.sum(np.sqrt(1.0 - ((2 * levels - 1) / (2.0 * ratio)) ** 2)))

"""The laboratory valve of the paper, section III, as its text describes it, and the ramps it was given.

The recorded data of the paper are not available: Figs. 3 and 4 are simulated here. From the text come the range (5 to
15 %), the four rates, which of them went in stairs, and a static friction of about 5 % of span (d = 5.1 % in section
V). The text gives no jump; `SJ` is this project's choice, small enough for several stairs within the range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Valve

__all__ = ["FOLLOWED", "SJ", "STAIRS", "D", "LabRamp", "lab_models", "lab_ramp"]

LOW, HIGH = 5.0, 15.0
D = 5.1
"""Stiction band [% of span]."""
SJ = 2.0
"""Jump [% of span]: assumed, the text gives none."""
FOLLOWED = (0.0667, 0.0167)
"""Rates that the stem followed, Fig. 3 [% of span / s]."""
STAIRS = (0.0125, 0.01)
"""Rates at which it went in stairs, Fig. 4 [% of span / s]."""


@dataclass(frozen=True)
class LabRamp:
    """One ramp of the laboratory valve and what each model makes of it."""

    rate: float
    """Rate of the OP [% of span / s]."""
    paper: str
    """What the paper saw: `follow` or `staircase`."""
    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    op: NDArray[np.float64] = field(repr=False)
    """OP [% of span], shape (n_samples,)."""
    position: dict[str, NDArray[np.float64]] = field(repr=False)
    """Stem by model [% of span], each of shape (n_samples,)."""
    behaviour: dict[str, str]
    """What `analyse_ramp` calls it, by model."""


def lab_models() -> dict[str, Valve]:
    """One, two and three parameters with the same d; eq. 5 as printed and repaired."""
    from stiction.models import Choudhury, Srinivasan, Stenman

    r = math.sqrt(max(STAIRS) * min(FOLLOWED))
    return {
        "one parameter (eq. 4)": Stenman(D),
        "two parameters": Choudhury(S=2.0 * D - SJ, J=SJ),
        "three parameters, printed (eq. 5)": Srinivasan(D, SJ, r, as_printed=True),
        "three parameters, corrected (eq. 5)": Srinivasan(D, SJ, r),
    }


def lab_ramp(rate: float, paper: str, dt: float = 1.0) -> LabRamp:
    """Ramp the laboratory valve from 5 to 15 % at `rate` [% of span / s], sampled every `dt` [s]."""
    from stiction.simulation import stroke
    from stiction.valvetests import analyse_ramp

    time = np.arange(0.0, (HIGH - LOW) / rate + dt, dt)
    op = np.minimum(LOW + rate * time, HIGH)
    records = {name: stroke(valve, op, dt, mv_start=LOW) for name, valve in lab_models().items()}
    behaviour = {name: analyse_ramp(record).ramps[0].behaviour for name, record in records.items()}
    position = {name: np.asarray(record.mv) for name, record in records.items()}
    return LabRamp(rate, paper, time, op, position, behaviour)

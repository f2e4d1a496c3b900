"""The laboratory valve of the paper, section III, as its text describes it, and its ramp tests.

The recorded data of the paper are not available: Figs. 3 and 4 are simulated here. From the text come the range (5 to
15 %), the four rates, which of them gave stairs, and a static friction of about 5 % of span (d = 5.1 % in section
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

__all__ = ["FOLLOWED_RATES", "LAB_D", "LAB_SJ", "STAIRCASE_RATES", "LabRamp", "lab_models", "lab_ramp"]

RAMP_START = 5.0
"""OP at the start of a ramp [% of span]."""
RAMP_END = 15.0
"""OP at the end of a ramp [% of span]."""
LAB_D = 5.1
"""Stiction band [% of span]."""
LAB_SJ = 2.0
"""Jump, assumed because the text gives none [% of span]."""
FOLLOWED_RATES = (0.0667, 0.0167)
"""Rates that the stem followed, Fig. 3 [% of span / s]."""
STAIRCASE_RATES = (0.0125, 0.01)
"""Rates at which the stem moved in stairs, Fig. 4 [% of span / s]."""


@dataclass(frozen=True)
class LabRamp:
    """One ramp of the laboratory valve and the stem of each model on it."""

    rate: float
    """Rate of the OP [% of span / s]."""
    paper: str
    """Behaviour in the paper: `follow` or `staircase`."""
    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    op: NDArray[np.float64] = field(repr=False)
    """OP [% of span], shape (n_samples,)."""
    position: dict[str, NDArray[np.float64]] = field(repr=False)
    """Stem by model [% of span], each of shape (n_samples,)."""
    behaviour: dict[str, str]
    """Behaviour by `analyse_ramp`, for each model."""


def lab_models() -> dict[str, Valve]:
    """One, two and three parameters with the same d; eq. 5 as printed and repaired."""
    from stiction.models import Choudhury, Srinivasan, Stenman

    r = math.sqrt(max(STAIRCASE_RATES) * min(FOLLOWED_RATES))
    return {
        "one parameter (eq. 4)": Stenman(LAB_D),
        "two parameters": Choudhury(S=2.0 * LAB_D - LAB_SJ, J=LAB_SJ),
        "three parameters, printed (eq. 5)": Srinivasan(LAB_D, LAB_SJ, r, as_printed=True),
        "three parameters, corrected (eq. 5)": Srinivasan(LAB_D, LAB_SJ, r),
    }


def lab_ramp(rate: float, paper: str, dt: float = 1.0) -> LabRamp:
    """Ramp the laboratory valve from 5 to 15 % at `rate` [% of span / s], sampled every `dt` [s]."""
    from stiction.simulation import stroke
    from stiction.valvetests import analyse_ramp

    time = np.arange(0.0, (RAMP_END - RAMP_START) / rate + dt, dt)
    op = np.minimum(RAMP_START + rate * time, RAMP_END)
    records = {name: stroke(valve, op, dt, mv_start=RAMP_START) for name, valve in lab_models().items()}
    behaviour = {name: analyse_ramp(record).ramps[0].behaviour for name, record in records.items()}
    position = {name: np.asarray(record.mv) for name, record in records.items()}
    return LabRamp(rate, paper, time, op, position, behaviour)

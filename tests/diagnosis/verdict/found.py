"""A valve as if it had been found, for tests of what is made of one."""

from __future__ import annotations

import math

import numpy as np

from stiction.diagnosis.identified import ErrorSurface, Identification, ProcessFit

NONE = np.empty(0)
FOUND = Identification(
    "kano", 3.0, 1.0, 2.7, 3.3, 0.7, 1.4, ProcessFit(3.0, 10.0, 10.0, False), 93.0, 41.0,
    ErrorSurface(NONE, NONE, NONE, math.nan), NONE, NONE,
)  # fmt: skip
"""One that was compared with no rival."""

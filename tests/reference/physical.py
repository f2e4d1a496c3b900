"""PhysicalValve and HeWang: slips, thresholds, stem positions and bands.

N-numbers are the project's numeric checks. "derived" rows come of independent simulations (a slow Karnopp code of its
own, converged in its step) or of closed forms worked by hand; the stem positions are those of public C++ code of
another group, built and run.
"""

from __future__ import annotations

from tests.reference import Row

_RUN = "independent Karnopp simulation of srinivasan2008, eqs. 1-3 (E1, E2 mended), Table I"

STAIRS = (
    Row("N1", {"set": "table1_reading_a", "slope": 4.0}, {"first": 3.840, "slips": 5, "slip": 0.950}, 0.002, _RUN),
    Row("N4", {"set": "table1_reading_b", "slope": 4.0 / 60.0},
        {"first": 3.840, "slips": 22, "slip": 0.2147}, 0.001, _RUN),
)  # fmt: skip
"""Slope [psi/s] to 18 psi; pressure at the first slip [psi], slips, slip [in]."""

FOLLOW = (
    Row("N2", {"set": "table1_reading_a", "slope": 9.0}, {"slowest": 0.368}, 0.005, _RUN),
    Row("N4", {"set": "table1_reading_b", "slope": 9.0 / 60.0}, {"slowest": 0.0500}, 0.001, _RUN),
)
"""Slope [psi/s]; lowest speed after the first peak of the speed [in/s]."""

SLIP_OVER_RATE = Row(
    "slip grows with slope", {"slope": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)},
    (0.506, 0.637, 0.786, 0.950, 1.126, 1.312), 0.002, _RUN,
)  # fmt: skip
"""Reading A: slope [psi/s], slip [in]."""

CRITICAL = (
    Row("N3", {"set": "table1_reading_a"}, {"psi_per_s": 6.82, "mechanism": "inertial"}, 0.003, _RUN),
    Row("N4", {"set": "table1_reading_b"}, {"psi_per_s": 0.0916, "mechanism": "stribeck"}, 0.01, _RUN),
)

_CODE = "public C++ code of the USP group, built and run: triangle 0-100-0 % in 100 s, Ts 1 ms, dt 1e-5 s"

POSITIONS = (
    Row("Karnopp", {"set": "nominal"}, (0.00751544439, 0.0221696417, 0.0221788896, 0.000459529474), 0.0, _CODE),
    Row("LuGre", {"set": "nominal_lugre"}, (0.00751544439, 0.0221696417, 0.0221863220, 0.000459529474), 0.0, _CODE),
)
"""Stem position [m] at 25, 50, 60 and 99.9 s; to be met to 1e-7 m."""

OVERSHOOT = Row(
    "N19", {"damping_ratio": (0.058, 0.008, 1.15)}, (1.832, 1.974, 1.0), 0.001, "closed form, and simulation"
)

NOMINAL_BANDS = Row(
    "N20", {"set": "nominal"}, {"fs": 12.644, "fd": 11.347, "S": 23.990, "J": 1.2968, "offset": 11.4947}, 1e-4,
    "hand: 100 F / (A dP) with the numbers of garcia2008's group",
)  # fmt: skip

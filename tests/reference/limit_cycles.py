"""Limit cycles of loops with a sticky valve: period [s] and peak-to-peak amplitudes.

The numbers are those of an independent simulation (slow code of its own, step sizes down to 5 ms) of loops that are
recalled from the literature: the loops are after choudhury2005, the numbers are not published ones.
"""

from __future__ import annotations

from tests.reference import Row

_SELF_REGULATING = {"K": 3.0, "tau": 10.0, "dead_time": 10.0, "Kc": 0.2, "Ti": 10.0, "sp": 10.0}
_INTEGRATING = {"K": 1.0, "Kc": 0.4, "Ti": 2.0, "sp": 10.0}
_SOURCE = "independent simulation, dt -> 0; loop after choudhury2005"

CONTINUOUS = tuple(
    Row(f"FOPDT S={S} J={J}", {**_SELF_REGULATING, "S": S, "J": J, "dt": 0.02}, expected, 0.002, _SOURCE)
    for S, J, expected in (
        (3.0, 1.0, {"period": 166.0, "op": 3.430, "pv": 4.286, "mv": 1.430}),
        (5.0, 2.0, {"period": 142.7, "op": 5.860, "pv": 8.563, "mv": 2.860}),
        (5.0, 5.0, {"period": 72.71, "op": 7.150, "pv": 20.11, "mv": 7.150}),
    )
)
"""Check N15; the integral is updated after the output (`integral="forward"`)."""

SAMPLED = tuple(
    Row(
        f"FOPDT at 1 s S={S} J={J}",
        {**_SELF_REGULATING, "S": S, "J": J, "dt": 1.0},
        expected,
        0.006,
        "independent simulation, dt = 1 s; loop after choudhury2005",
        note="the sampled cycle is not quite periodic, so peak to peak depends on the window by some 0.5 %",
    )
    for S, J, expected in (
        (3.0, 1.0, {"period": 162.8, "op": 3.499}),
        (5.0, 5.0, {"period": 71.5, "op": 7.549}),
    )
)
"""Check N16: e = SP - y; I += Kc dt / Ti e; u = Kc e + I; valve; ten samples of delay; y = a y + K (1 - a) x."""

INTEGRATING = tuple(
    Row(f"integrator S={S} J={J}", {**_INTEGRATING, "S": S, "J": J, "dt": 0.005}, expected, 0.002, _SOURCE)
    for S, J, expected in (
        (5.0, 0.0, {"period": 18.42, "op": 8.465}),
        (3.0, 1.0, {"period": 16.87, "op": 3.746}),
        (5.0, 2.0, {"period": 16.14, "op": 5.984}),
        (5.0, 5.0, {"period": 9.81, "op": 5.076}),
    )
)
"""Check N17; the deadband alone (J = 0) cycles with two integrators in the loop."""

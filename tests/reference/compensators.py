"""Compensated loops, simulated beforehand by code of their own: Kano's valve, FOPDT 3 / (10 s + 1) with 10 s of dead
time, PI 0.2 (1 + 1 / 10 s), sampled every second; PV standard deviation, stem travel and reversals in 2 000 s.

The set point steps from rest to 24 and the numbers are those of the second 2 000 s: the loop locks to a train of pulses
in one of a few ways, and that step leads to the one that was tabled.
"""

from __future__ import annotations

from tests.reference import Row

import stiction as st

SP = 24.0
_SOURCE = "own simulation by independent code, noise-free"

TABLE = tuple(
    Row(
        f"{type(compensator).__name__} of {height}, S = {S:g}, J = {J:g}",
        {"valve": st.Kano(S, J), "compensator": compensator},
        numbers,
        0.05,
        _SOURCE,
    )
    for S, J, rows in (
        (3.0, 3.0, ((4.36, 247, 55), (2.30, 284, 87), (3.25, 733, 132), (1.38, 733, 182))),
        (5.0, 2.0, ((3.66, 85, 28), (1.54, 189, 88), (3.79, 855, 133), (0.92, 487, 181))),
        (3.0, 1.0, ((1.87, 36, 24), (0.77, 95, 87), (2.29, 767, 133), (0.46, 244, 182))),
    )
    for compensator, height, numbers in zip(
        (None, st.Knocker(S / 2.0, 2.0, 5.0), st.Knocker(S, 2.0, 5.0), st.ConstantReinforcement(S / 2.0)),
        ("none", "S / 2", "S", "S / 2"),
        rows,
        strict=True,
    )
)

NOISY = tuple(
    Row(
        f"ConstantReinforcement, noise 0.2, S = {S:g}, J = {J:g}",
        {"valve": st.Kano(S, J), "compensator": st.ConstantReinforcement(S / 2.0)},
        numbers,
        0.05,
        "own simulation by independent code; stem travel and reversals, other seeds",
    )
    for S, J, numbers in ((3.0, 3.0, (3482, 1093)), (5.0, 2.0, (2554, 1204)), (3.0, 1.0, (1441, 1330)))
)

SIGNALS = (
    # Worked by hand: op, sp - pv, and what is sent.
    Row(
        "VariablePulses",
        {"compensator": st.VariablePulses(2.0, 1.0, 2.0, 4.0), "op": (1, 2, 3, 4, 3, 1), "error": (0, 1, 2, 8, 9, 1)},
        (1.0, 2.5, 3.0, 6.0, 3.0, 0.5),
        0.0,
        "rule of the page; height 2 min(1, e / 4), every other sample, against the output two samples before",
    ),
    Row(
        "Cuadros",
        {"compensator": st.Cuadros(2.0, 1.0, 2.0, 4.0), "op": (1, 2, 3, 4, 3, 1), "error": (0, 1, 2, 8, 9, 5)},
        (1.0, 2.0, 3.0, 6.0, 3.0, -1.0),
        0.0,
        "rule of the page; no pulse while e < 4",
    ),
    Row(
        "IntegralDeadband",
        {"compensator": st.IntegralDeadband(4.0), "op": (1, 2, 3, 4, 3, 1), "error": (0, 1, 2, 8, 9, 5)},
        (1.0, 2.0, 3.0, 4.0, 3.0, 1.0),
        0.0,
        "the signal is the controller's",
    ),
)

TWO_MOVES = (
    # S, J, factor of the identified S and J: set points of 12 that end at rest, RMS error over the bare cycle's.
    Row("TwoMove", {"S": 3.0, "J": 3.0, "factor": 1.0}, (12, 0.21), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 5.0, "J": 2.0, "factor": 1.0}, (12, 0.19), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 3.0, "J": 1.0, "factor": 1.0}, (12, 0.15), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 3.0, "J": 3.0, "factor": 0.7}, (12, 0.15), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 5.0, "J": 2.0, "factor": 0.7}, (9, 0.49), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 3.0, "J": 1.0, "factor": 0.7}, (3, 0.81), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 3.0, "J": 3.0, "factor": 1.3}, (10, 0.49), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 5.0, "J": 2.0, "factor": 1.3}, (12, 0.28), 0.05, "docstring of TwoMove"),
    Row("TwoMove", {"S": 3.0, "J": 1.0, "factor": 1.3}, (12, 0.23), 0.05, "docstring of TwoMove"),
)

FOUR_MOVES = (
    Row("FourMove", {"S": 3.0, "J": 3.0}, 0.77, 0.05, "docstring of FourMove"),
    Row("FourMove", {"S": 5.0, "J": 2.0}, 0.01, 0.5, "docstring of FourMove"),
    Row("FourMove", {"S": 3.0, "J": 1.0}, 0.21, 0.05, "docstring of FourMove"),
)

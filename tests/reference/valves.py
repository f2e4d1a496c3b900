"""The valve alone: inputs of a few samples, worked by hand from the rules."""

from __future__ import annotations

import math

from tests.reference import Row

import stiction as st

STEPS = (
    # A step from 0 to 10 with sb = 2, sj = 1: 10 - (sb - sj) = 9 for every model with that map, and 10 for Stenman,
    # whose one band leaves no lag. Eq. 5 as printed moves by sj and then finds sgn(du) = 0 for ever.
    Row("Kano", {"valve": st.Kano(S=3.0, J=1.0)}, 9.0, 0.0, "kano2004, rule; srinivasan2008, sec. III"),
    Row("Choudhury", {"valve": st.Choudhury(S=3.0, J=1.0)}, 9.0, 0.0, "choudhury2005, flow chart"),
    Row("He", {"valve": st.He(fs=2.0, fd=1.0)}, 9.0, 0.0, "he2007, rule"),
    Row("HeWang", {"valve": st.HeWang(fs=2.0, fd=1.0, K=1.0)}, 9.0, 0.0, "hewang2014, rule with K = 1", "recalled"),
    Row("Stenman", {"valve": st.Stenman(d=2.0)}, 10.0, 0.0, "srinivasan2008, eq. 4"),
    Row("Srinivasan, repaired", {"valve": st.Srinivasan(2.0, 1.0, 0.0)}, 9.0, 0.0, "srinivasan2008, eq. 5, repaired"),
    Row("Srinivasan, r", {"valve": st.Srinivasan(2.0, 1.0, 5.0)}, 9.0, 0.0, "srinivasan2008, eq. 5, repaired"),
    Row("Srinivasan, inf", {"valve": st.Srinivasan(2.0, 1.0, math.inf)}, 9.0, 0.0, "srinivasan2008, eq. 5, repaired"),
    Row(
        "Srinivasan, printed",
        {"valve": st.Srinivasan(2.0, 1.0, 0.0, as_printed=True)},
        1.0,
        0.0,
        "srinivasan2008, eq. 5 as printed (erratum E6)",
    ),
)

STAIRS = (
    # Held 0.1 % steps up from the middle of the band's lower edge, S = 3, J = 1, x0 = -(S - J) / 2: a move whenever
    # the input has gone on by J, that is on the first step beyond it; after the last move at 5.5 the input climbs to
    # 7.5... and back, and S must be gone back from there.
    Row(
        "up in held steps",
        {"S": 3.0, "J": 1.0, "start": -1.0, "step": 0.1, "top": 5.9},
        (1.1, 2.2, 3.3, 4.4, 5.5),
        1e-9,
        "kano2004, rule; each move asks for the first step beyond J",
    ),
)

JUMP_ABOVE_S = (
    # From rest at 0 with S = 1, J = 3: break-away needs (S + J) / 2 = 2, and the stem lands (J - S) / 2 = 1 beyond.
    Row("Kano overshoots", {"valve": st.Kano(S=1.0, J=3.0)}, 3.5, 0.0, "kano2004, rule: x = u - d (S - J) / 2"),
    Row(
        "Srinivasan overshoots",
        {"valve": st.Srinivasan(sb=2.0, sj=3.0, r=0.0)},
        3.5,
        0.0,
        "srinivasan2008, eq. 5, repaired: x = u - m (sb - sj)",
    ),
)

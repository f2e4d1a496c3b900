"""Describing functions and limit cycles from outside the code under test.

"derived": an independent derivation and slow simulation of the equations, dt -> 0, not published values.
"python-control": python-control 0.10.2, run separately.
"""

from __future__ import annotations

STENMAN_HALF = {0.5: 0.5513 - 0.3183j, 0.7: 0.4247 - 0.1624j, 1.0: 0.8269 - 0.2387j, 5.0: 0.984 - 0.0605j}
"""N(A), d = 0.5, levels +-d/2, ...: derived, four digits (check N5)."""
STENMAN_INTEGER = {0.55: 0.8199 - 0.5261j, 0.9: 0.6478 - 0.1965j}
"""The same with levels 0, +-d, ... (check N6)."""
STENMAN_CONTROL = {
    0.5: 0.55133 - 0.31831j, 0.8: 0.89438 - 0.37302j, 1.0: 0.82695 - 0.23873j, 1.3: 0.94781 - 0.23544j,
    1.5: 0.90333 - 0.17684j,
}  # fmt: skip
"""python-control's numeric describing function of eq. 4, d = 0.5, 1e5 points."""
TWO_PARAMETER = (
    (3.0, 1.0, 2.4, 0.5994 - 0.3647j),
    (3.0, 1.0, 4.5, 0.8416 - 0.2358j),
    (3.0, 1.0, 9.0, 0.9432 - 0.1297j),
    (3.0, 0.0, 4.5, 0.7082 - 0.2829j),
    (3.0, 5.0, 3.5, 1.4908 - 0.1818j),
)
"""S, J, amplitude, N: derived, four digits (check N12)."""
DEADBAND = {
    0.6: 0.109551 - 0.176839j, 0.75: 0.291791 - 0.282942j, 1.0: 0.5 - 0.318310j, 2.0: 0.804499 - 0.238732j,
    5.0: 0.947956 - 0.114592j,
}  # fmt: skip
"""python-control, backlash b = 1."""
RELAY = {
    0.6: 1.173016 - 1.768388j, 1.0: 1.102658 - 0.636620j, 2.0: 0.616404 - 0.159155j, 5.0: 0.253371 - 0.025465j,
}  # fmt: skip
"""python-control, relay with hysteresis b = 1, c = 0.5."""
PAPER_DF = (
    ("half", 2, 0.57305, 21.112), ("half", 4, 0.94479, 16.281), ("integer", 3, 0.77886, 17.659),
    ("integer", 5, 1.08869, 15.656),
)  # fmt: skip
"""Family, levels, A, period of 1 + L N = 0 in the paper's loop: derived (checks N8-N10)."""
PAPER_EXACT = (
    ("half", 2, 0.571, 21.115, 0.367), ("half", 4, 0.938, 16.234, 0.7385), ("integer", 3, 0.772, 17.595, None),
    ("integer", 5, 1.083, 15.663, None),
)  # fmt: skip
"""Family, levels, OP amplitude, period, PV peak to peak: independent simulation (checks N8-N10)."""
KANO_FOPDT = (
    (3.0, 1.0, 166.0, 3.430, 4.286, 1.430),
    (5.0, 2.0, 142.7, 5.860, 8.563, 2.860),
    (5.0, 5.0, 72.71, 7.150, 20.11, 7.150),
)
"""S, J, period, OP, PV and stem peak to peak of FOPDT 3, 10 s, 10 s with PI 0.2, 10 s: independent (check N15)."""
KANO_INTEGRATING = (
    (5.0, 0.0, 18.42, 8.465), (3.0, 1.0, 16.87, 3.746), (5.0, 2.0, 16.14, 5.984), (5.0, 5.0, 9.81, 5.076),
)  # fmt: skip
"""S, J, period, OP peak to peak of 1/s with PI 0.4, 2 s: independent (check N17)."""

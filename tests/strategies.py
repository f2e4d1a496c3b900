"""Inputs and valves that arithmetic keeps exact: multiples of 1/16 in modest ranges."""

from __future__ import annotations

from hypothesis import strategies as st

import stiction

STEP = 1.0 / 16.0


def dyadic(low: float, high: float) -> st.SearchStrategy[float]:
    """Multiples of 1/16 from `low` to `high`."""
    return st.integers(round(low / STEP), round(high / STEP)).map(lambda k: k * STEP)


def inputs(size: int = 40) -> st.SearchStrategy[list[float]]:
    """Input series [% of span]: small and large moves and held samples."""
    moves = st.one_of(dyadic(-1.0, 1.0), dyadic(-10.0, 10.0), st.just(0.0))
    return st.tuples(dyadic(-20.0, 20.0), st.lists(moves, min_size=1, max_size=size)).map(_added_up)


def _added_up(start_and_moves: tuple[float, list[float]]) -> list[float]:
    start, moves = start_and_moves
    series = [start]
    for move in moves:
        series.append(series[-1] + move)
    return series


BANDS = dyadic(0.0, 5.0)
PAIRS = st.tuples(BANDS, BANDS)
ORDERED = PAIRS.map(lambda pair: (max(pair), min(pair)))
"""Two bands, the larger first."""

VALVES: dict[str, st.SearchStrategy[stiction.models.Valve]] = {
    "Ideal": st.just(stiction.Ideal()),
    "Stenman": BANDS.map(stiction.Stenman),
    "Kano": PAIRS.map(lambda p: stiction.Kano(*p)),
    "Choudhury": PAIRS.map(lambda p: stiction.Choudhury(*p)),
    "He": ORDERED.map(lambda p: stiction.He(*p)),
    "HeWang": st.tuples(ORDERED, st.sampled_from([1.0, 2.0])).map(lambda q: stiction.HeWang(*q[0], K=q[1])),
    "Srinivasan": st.tuples(BANDS, st.floats(0.0, 2.0), dyadic(0.0, 2.0)).map(
        lambda q: stiction.Srinivasan(q[0], round(q[0] * q[1] / STEP) * STEP if q[0] else 0.0, q[2])
    ),
}
"""Class name -> valves with dyadic parameters; a K between 1 and 2 would add bits to the position with every slip."""

"""Valves watched side by side, against a slow twin that takes one after the other."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.diagnosis.identification.watched import (
    AVERAGED,
    HOPELESS,
    LANES,
    LIMIT,
    TOLERANCE,
    decays,
    turns_of,
    watched,
    work_space,
)
from stiction.models.component import TIE

N, BEGIN, MEAN = 240, 8, 50.0


def one_by_one(op, y, rows, cap, loose, least):
    """What each row leaves and how often its stem sets out another way; a row is given up as soon as it is hopeless."""
    told = []
    each = len(rows) // len(least)
    least = list(least)
    for i, (S, share, slope, level, lag, late, stops) in enumerate(rows):
        late, offset, J = int(late), level - slope * MEAN, S * share
        behind, reach = 0.5 * (S - J), 0.5 * (S + J) * (1.0 + TIE)
        decay, inverse = float(decays(np.array([lag]))[0]), 1.0 / slope
        x = (y[late] - offset) / slope
        z = x = min(max(x, op[0] - reach), op[0] + reach) if np.isfinite(x) else op[0]
        moving = last = total = 0.0
        averaged, turns, compared = 100.0, 0, 0
        for k in range(1, len(op) - late):
            u = op[k]
            du = u - op[k - 1]
            if du * moving > 0.0 and not stops:
                x = u - moving * behind
            else:
                moving, way = 0.0, 1.0 if u > x else -1.0
                slips = abs(u - x) > reach
                if S > 0.0 and abs(abs(u - x) - reach) < loose * (TOLERANCE * reach + abs(du)):
                    seen = (y[k + late] - offset) * inverse
                    slipped = decay * z + (1.0 - decay) * (u - way * behind)
                    slips = abs(seen - slipped) < abs(seen - (decay * z + (1.0 - decay) * x))
                if slips:
                    moving, x = way, u - way * behind
                    turns += moving * last < 0.0
                    last = moving
            z = decay * z + (1.0 - decay) * x
            r = y[k + late] - offset - slope * z
            if np.isnan(r):
                continue
            if k >= BEGIN:
                compared += 1
                total += min(r * r, LIMIT * LIMIT * cap * cap)
                if total > HOPELESS * least[i // each] * len(op):
                    break
            if abs(r) > cap:
                way = 1.0 if r * slope > 0.0 else -1.0
                x = min(max(x + r * inverse / (1.0 - decay), u - reach), u + reach)
                z += r * inverse
                moving = way if abs(u - way * behind - x) * abs(slope) < cap else 0.0
                averaged = 1.0
            elif moving == 0.0 and averaged < AVERAGED:
                averaged += 1.0
                x = min(max(x + r * inverse / averaged, u - reach), u + reach)
        told.append((total / max(compared, 1), turns))
        if least[i // each] < np.inf:
            least[i // each] = min(least[i // each], told[-1][0])
    left, turns = zip(*told, strict=True)
    return np.array(left), np.array(turns)


@settings(deadline=None, max_examples=25)
@given(
    seed=some.integers(0, 10_000), n=some.sampled_from([1, 7, 20, LANES, 2 * LANES + 5]),
    searches=some.sampled_from([1, 2]), cap=some.sampled_from([0.2, 0.8, np.inf]),
    loose=some.sampled_from([0.0, 0.3, 1.0]), least=some.sampled_from([np.inf, 1e300, 0.05]),
    missing=some.sampled_from([0.0, 0.2]),
)  # fmt: skip
def test_valves_side_by_side_leave_what_they_leave_one_by_one(seed, n, searches, cap, loose, least, missing):
    rng = np.random.default_rng(seed)
    op = MEAN + 4.0 * np.sin(np.cumsum(rng.uniform(0.5, 1.5, N)) / 8.0) + 0.1 * rng.normal(size=N)
    y = 4.0 + 0.16 * (np.round(op / 3.0) * 3.0 + 0.1 * rng.normal(size=N))
    y[rng.random(N) < missing] = np.nan
    n *= searches
    rows = np.column_stack([
        rng.choice([0.0, 1.0, 2.0, 4.0], n) * rng.uniform(0.8, 1.2, n), rng.choice([0.0, 0.5, 1.0], n),
        0.16 * rng.uniform(0.9, 1.1, n), 4.0 + 0.16 * MEAN + 0.05 * rng.normal(size=n),
        rng.choice([0.0, 0.3, 2.0], n), rng.integers(0, 4, n), rng.integers(0, 2, n),
    ])  # fmt: skip
    known, w = np.concatenate([[0], np.cumsum(~np.isnan(y))]), work_space(N)
    left, of_each = np.empty(n), np.full(searches, least)
    watched(op, y, known, MEAN, rows, decays(rows[:, 4]), 0.16 * cap, loose, BEGIN, of_each, left, *w)
    slow, turns = one_by_one(op, y, rows, 0.16 * cap, loose, np.full(searches, least))
    np.testing.assert_array_equal(left, slow)
    if least == np.inf:
        some_row = int(rng.integers(n))
        decay = decays(rows[some_row, 4:5])[0]
        assert turns_of(op, y, MEAN, rows[some_row], decay, 0.16 * cap, loose, w[0]) == turns[some_row]
    else:
        assert (of_each <= least).all()
        assert of_each.min() == min(least, left.min())

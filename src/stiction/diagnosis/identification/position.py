r"""A valve whose position was recorded: the S and J that explain it, and how well a good valve does.

The position is held against the stem of Kano's valve on the recorded OP, watched (see `watched`), behind a lag, late by
whole samples, on a scale of its own. Three kinds are searched for: a good valve, whose S is at most `LEAST` of OP's
swing; a deadband, with a larger S and J below `JUMP` S; and a valve that sticks, with a larger J. A search begins at
the best valves of a grid and of those that plain moves of the position tell (see `moves`), and goes closer by chance.
"""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.moves import told_by_moves
from stiction.diagnosis.identification.watched import watched

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LEAST", "LONGEST", "Watched", "Watching", "longest_seen", "noise_of", "swing_of", "watch"]

FINEST = 0.03
"""Least noise that what a valve leaves is measured by, as a share of the position's swing [-]: no model is a stem of
steel to the last decimal of a good transmitter."""
CAP = 4.0
"""c: deviation at which the stem is taken to be where it is seen, in standard deviations of the noise [-]."""
LEAST = 0.1
"""S over OP's swing up to which a valve is good [-]."""
JUMP = 0.1
"""J over S up to which a valve has a deadband and does not stick [-]."""
UNITS = (0.01, 0.16, 1.0, 6.25, 100.0)
"""Slope of the position over OP where each is in %, in mA or a share of one [-]."""
SWINGS = (0.18, 1.8)
"""Standard deviation of the stem over OP's that are looked for [-]: they tell which units are meant. A square of OP's
height has 1.73 of a triangle's."""
PLAINLY = 0.7
"""Correlation with OP below which the position may also go the other way [-]."""
CALIBRATED, FREE = 0.04, 0.5
"""How far a slope may be from a known one, and from one guessed from the swings [-]."""
DELAYS = ((0.3, 0), (2.0, 0), (0.3, 1), (0.3, 2))
"""Lags and whole samples late that are tried at first, with every valve [samples]."""
LAGS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Lags tried at first with a good valve [samples]."""
SOME_LAGS = (0.3, 2.0)
"""Lags tried at first with a valve that the moves tell [samples]."""
OFF = np.array([-0.04, 0.0, 0.04])
"""Levels tried at first, about that on which the position lies evenly, as shares of OP's swing [-]."""
LATEST = 3
"""Latest samples that a position may come [-]."""
FIRST_LOOK, LONGEST = 1000, 6000
"""Samples of the first look, and the most that are compared [-]."""
CLOSER = (
    (0.03, 1.0, 1.0, 24, 3, 20, FIRST_LOOK), (0.015, 0.3, 1.0, 6, 6, 30, 2000), (0.01, 0.0, 0.5, 2, 10, 40, LONGEST),
)  # fmt: skip
"""Of each closer search: least noise that the position is taken to have, as a share of its swing, how loose slips are,
size of the first steps, valves it starts from, rounds, valves tried in each, and samples that are looked at [-]."""
FEWER = 3
"""One valve in so many of those is gone on from where a good one is searched: its band hardly tells [-]."""
STEPS = np.array([0.06, 0.06, 0.02, 0.08, 0.4, 0.8, 0.0])
"""First steps of a closer search: of how far OP goes from a resting stem before it slips and of how far a moving one
stays behind OP (both in S), of the slope (relative), of the level (in S), of the lag (relative) and of how late it is
[samples]."""


class Watched(NamedTuple):
    """What one kind of valve makes of a recorded position."""

    S: float
    """Deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""
    slope: float
    """Scale of the position [its unit per % of span]."""
    level: float
    """Position where the stem is at OP's mean [its unit]."""
    lag: float
    """Lag of the position behind the stem [samples]."""
    late: int
    """Samples that it comes late [-]."""
    stops: float
    """1 for a stem that rests after every sample, as He's and Stenman's do, 0 for one that goes on [-]."""
    left: float
    """What the valve leaves [squares of the noise, or of `FINEST` where that is more]."""
    turns: int
    """How often its stem sets out in another direction [-]."""
    tried: NDArray[np.float64]
    """S, J [% of span] and what is left of all valves tried in the last closer search [squares of the noise that the
    position is taken to have there], shape (n, 3)."""


class Watching(NamedTuple):
    """What each kind of valve makes of a recorded position."""

    good: Watched
    """The best valve that follows."""
    deadband: Watched
    """The best one with play."""
    stiction: Watched
    """The best one that sticks."""
    noise: float
    """Standard deviation of the position's noise and rounding [% of span]."""
    explained: float
    """Share of the position's variance that the best of them explains by simulation alone, not watched [-]."""
    spread: float
    """Variance of the position [squares of the same noise as what is left]."""

    def share(self, valve: Watched) -> float:
        """Share of the position's variance that a valve explains when watched [%]."""
        return 100.0 * max(1.0 - valve.left / self.spread, 0.0)


class _Sight(NamedTuple):
    """What is compared."""

    op: NDArray[np.float64]
    y: NDArray[np.float64]
    mean: float
    noise: float
    swing: float
    cap: float = np.inf

    def sigma(self, share: float) -> float:
        """Noise of the position, or that share of its swing where it is less."""
        return max(self.noise, share * self.swing)

    def by(self, share: float) -> _Sight:
        """The same with a stem that is taken to be where it is seen when it is off by `CAP` of that."""
        return self._replace(cap=CAP * self.sigma(share))

    def left(
        self, rows: NDArray[np.float64], n: int, loose: float, least: float = np.inf
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What rows of S, J / S, slope, level, lag and lateness leave of the first `n` samples, and their turns."""
        asked = rows.copy()
        asked[:, 1] *= rows[:, 0]
        asked[:, 3] -= rows[:, 2] * self.mean
        with np.errstate(divide="ignore"):
            asked[:, 4] = np.exp(-1.0 / rows[:, 4])
        left, turns = np.empty((2, len(rows)))
        n = min(n, self.op.size)
        watched(self.op[:n], self.y[:n], asked, self.cap, loose, n // 50 + LATEST, least, left, turns)
        return left, turns

    def explained(self, found: Watched) -> float:
        """Share of the position's variance that a valve explains when it is not corrected by what is seen [-]."""
        row = np.array([[found.S, found.J / found.S if found.S > 0.0 else 0.0, *found[2:7]]])
        left, _ = self._replace(cap=np.inf).left(row, self.op.size, 0.0)
        return 1.0 - float(left[0]) / float(np.nanvar(self.y))


def longest_seen(y: NDArray[np.float64]) -> slice:
    """The part of a position that is compared.

    Parameters
    ----------
    y : ndarray, shape (n_samples,)
        Position [any unit]; NaN where it was not recorded.

    Returns
    -------
    slice
        Of `LONGEST` samples in a row those from the first to the last that was recorded, where most were, and nearest
        to the middle of the record; empty where none was.

    Examples
    --------
    >>> import numpy as np
    >>> longest_seen(np.where(np.arange(14_000) < 6500, 50.0, np.nan))
    slice(500, 6500, None)
    """
    spare = max(y.size - LONGEST, 0)
    recorded = np.concatenate([[0], np.cumsum(np.isfinite(y))])
    count = recorded[recorded.size - 1 - spare :] - recorded[: spare + 1]
    most = np.flatnonzero(count == count.max())
    first = int(most[np.argmin(np.abs(most - spare // 2))])
    there = first + np.flatnonzero(np.isfinite(y[first : first + LONGEST]))
    return slice(int(there[0]), int(there[-1]) + 1) if there.size else slice(0, 0)


def swing_of(x: NDArray[np.float64]) -> float:
    """98 % range of a signal, in its unit, which a few spikes do not widen."""
    return float(np.subtract(*np.nanpercentile(x, (99, 1))))


def noise_of(y: NDArray[np.float64], step: float) -> float:
    """Standard deviation of a position's noise and rounding, in its unit.

    Parameters
    ----------
    y : ndarray, shape (n_samples,)
        The position, or what a valve leaves of it.
    step : float
        Its resolution [unit of the position].

    Returns
    -------
    float
        From the smaller quarter of its moves, in which a stem rests: they are the noise's.

    Examples
    --------
    >>> import numpy as np
    >>> bool(abs(noise_of(np.random.default_rng(0).normal(0.0, 0.2, 4000), 0.0) - 0.2) < 0.02)
    True
    """
    spread = y + step * np.random.default_rng(0).uniform(-0.5, 0.5, y.size)  # lest most moves be none
    moves = np.abs(np.diff(spread))
    moves = moves[moves > 0.0]  # what was held says nothing of the noise
    return float(np.quantile(moves, 0.25)) / (0.3186 * 2.0**0.5) if moves.size else 0.0


def _slopes(op: NDArray[np.float64], y: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], bool]:
    """Slopes that the position may have over OP, and whether they are those of known units."""
    op, y = (np.clip(x, *np.nanpercentile(x, (1, 99))) for x in (op, y))  # spikes would widen them
    alike = []
    for late in range(LATEST + 1):
        ok = np.isfinite(y[late:])
        alike.append(float(np.corrcoef(op[: op.size - late][ok], y[late:][ok])[0, 1]))
    way = max(alike, key=abs)
    spread = float(np.nanvar(y))
    moved = spread - min(noise_of(y, step) ** 2, 0.9 * spread)
    ratio = float(np.sqrt(moved / np.var(op)))
    known = [unit for unit in UNITS if SWINGS[0] <= ratio / unit <= SWINGS[1]]
    slopes = np.copysign(known or [ratio], way)
    return slopes if abs(way) > PLAINLY else np.concatenate([slopes, -slopes]), bool(known)


def watch(op: NDArray[np.float64], y: NDArray[np.float64], step: float) -> Watching:
    """Search the best valve of each kind.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output without gaps [% of span]; no more than `LONGEST` samples are compared (see `longest_seen`).
    y : ndarray, shape (n_samples,)
        Position [any unit]; NaN are passed over.
    step : float
        Resolution of the position [its unit]; 0 where it has none.

    Returns
    -------
    Watching
        The best valve of each kind.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> op = 50.0 + 4.0 * np.sin(np.arange(1500.0) / 15.0)
    >>> stem = st.stroke(st.Kano(3.0, 1.5), op, dt=1.0).mv + np.random.default_rng(0).normal(0.0, 0.1, 1500)
    >>> found = watch(op, 4.0 + 0.16 * stem, 0.0).stiction
    >>> bool(abs(found.S - 3.0) < 0.1 and abs(found.J - 1.5) < 0.15)
    True
    """
    seen = longest_seen(y)
    op, y = np.ascontiguousarray(op[seen]), np.ascontiguousarray(y[seen])
    slopes, of_unit = _slopes(op, y, step)
    noise = min(noise_of(one, step) for one in (y, *(y - slope * op for slope in slopes)))
    sight = _Sight(op, y, float(op.mean()), noise, swing_of(y))
    wide, whole, least = CALIBRATED if of_unit else FREE, float(np.ptp(op)), LEAST * swing_of(op)
    bands, shares = np.geomspace(1.1 * least, whole, 26), np.array([0.2, 0.5, 0.8, 1.0])
    plain, good = np.zeros(1), [(lag, late) for lag in LAGS for late in range(LATEST + 1)]
    searches = (
        (_grid(sight, plain, plain, slopes, good), (0.0, least), (0.0, 1.0)),
        (_grid(sight, bands, plain, slopes, DELAYS), (least, whole), (0.0, JUMP)),
        (_grid(sight, bands, shares, slopes, DELAYS, (0.0, 1.0)), (least, whole), (JUMP, 1.0)),
    )
    told, found = _told(sight, slopes), []
    for rows, S, J in searches:
        inside = np.clip(told, (S[0], J[0], *5 * [-np.inf]), (S[1], J[1], *5 * [np.inf]))
        found.append(_best(sight, np.concatenate([rows, inside]), S, J, slopes, wide))
    return Watching(
        good=found[0], deadband=found[1], stiction=found[2], noise=noise / abs(found[0].slope),
        explained=max(map(sight.explained, found)), spread=float(np.nanvar(y)) / sight.sigma(FINEST) ** 2,
    )  # fmt: skip


def _grid(
    sight: _Sight,
    S: NDArray[np.float64],
    ratio: NDArray[np.float64],
    slopes: NDArray[np.float64],
    delays: list[tuple[float, int]] | tuple[tuple[float, int], ...],
    stops: tuple[float, ...] = (0.0,),
) -> NDArray[np.float64]:
    """All rows of these, each on the level about which the position lies evenly."""
    rows = []
    for slope in slopes:
        off = np.nanpercentile(sight.y - slope * sight.op, (2, 98) if S[-1] > 0.0 else (50, 50))
        level = 0.5 * float(np.sum(off)) + slope * sight.mean
        for lag, late in delays:
            levels = level + slope * OFF * swing_of(sight.op)
            axes = np.meshgrid(S, ratio, slope, levels, lag, late, stops, indexing="ij")
            rows.append(np.stack([axis.ravel() for axis in axes], axis=1))
    return np.concatenate(rows)


def _told(sight: _Sight, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows of the valves that the plain moves of the position tell, with stems that go on and that rest."""
    rows = []
    for slope in slopes:
        for late in range(LATEST + 1):
            told = told_by_moves(sight.op[: sight.op.size - late], sight.y[late:], slope, sight.noise)
            if told is not None:
                S, J, level = told
                at_mean = level + slope * sight.mean
                rows += [[S, J / S, slope, at_mean, lag, late, stops] for lag in SOME_LAGS for stops in (0.0, 1.0)]
    return np.array(rows).reshape(-1, 7)


def _best(
    sight: _Sight,
    rows: NDArray[np.float64],
    S: tuple[float, float],
    ratio: tuple[float, float],
    slopes: NDArray[np.float64],
    wide: float,
) -> Watched:
    """The best valve within bounds, searched closer and closer from the best of `rows`."""
    rng, tried = np.random.default_rng(0), []
    left, _ = sight.by(FINEST).left(rows, FIRST_LOOK, 1.0)
    rows = rows[np.argsort(left)]
    starts, best = [row for stops in (0.0, 1.0) for row in _apart(rows[rows[:, 6] == stops])], rows[0]
    for share, loose, wide_at_first, keep, rounds, tries, n in CLOSER:
        valleys, close = [], sight.by(share)
        for row in _by_turns(starts)[: keep if S[0] > 0.0 else -(-keep // FEWER)]:
            left, _ = close.left(row[np.newaxis], n, loose)
            best, error, near = row, float(left[0]), wide_at_first
            slope = min(slopes, key=lambda one: abs(one - row[2]))
            for _ in range(rounds):
                near_by = _about(best, rng, near, tries, S, ratio, sight.sigma(FINEST))
                near_by[:, 2] = slope * np.clip(near_by[:, 2] / slope, 1.0 - wide, 1.0 + wide)
                left, _ = close.left(near_by, n, loose, error if n == LONGEST else 0.5 * error)
                if share == CLOSER[-1][0]:
                    tried.append(np.column_stack([near_by[:, 0], near_by[:, 0] * near_by[:, 1], left]))
                i = int(left.argmin())
                if left[i] < error:
                    best, error = near_by[i], float(left[i])
                else:
                    near *= 0.65
            valleys.append((error, tuple(best)))
        starts = [np.array(one) for _, one in sorted(valleys)]
        best = starts[0]
    left, turns = sight.by(FINEST).left(best[np.newaxis], LONGEST, 0.0)
    band, share, slope, level, lag, late, stops = (float(x) for x in best)
    return Watched(
        S=band, J=band * share, slope=slope, level=level, lag=lag, late=round(late), stops=stops,
        left=float(left[0]) / sight.sigma(FINEST) ** 2, turns=int(turns[0]),
        tried=np.concatenate(tried) / (1.0, 1.0, sight.sigma(CLOSER[-1][0]) ** 2),
    )  # fmt: skip


def _apart(rows: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The first rows that are apart from those before them in S, J / S or scale."""
    found: list[NDArray[np.float64]] = []
    for row in rows:
        if all(
            abs(row[0] - one[0]) > 0.1 * one[0] or abs(row[1] - one[1]) > 0.25 or row[2] != one[2]
            or abs(row[4] + row[5] - one[4] - one[5]) > 1.0 + 0.3 * one[4]
            for one in found
        ):  # fmt: skip
            found.append(row)
            if len(found) == CLOSER[0][3]:
                break
    return found


def _by_turns(rows: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Rows with stems that go on and with such as rest by turns: no step of a search leads from one to the other."""
    goes_on, rests = ([row for row in rows if row[6] == stops] for stops in (0.0, 1.0))
    return [row for pair in zip_longest(goes_on, rests) for row in pair if row is not None]


def _about(
    row: NDArray[np.float64],
    rng: np.random.Generator,
    near: float,
    tries: int,
    S: tuple[float, float],
    ratio: tuple[float, float],
    noise: float,
) -> NDArray[np.float64]:
    """Rows about one, some of its entries changed.

    S and J are changed by (S + J) / 2, which says when a stem slips, and by (S - J) / 2, which says where it then is:
    what the position tells of one it hardly tells of the other.
    """
    rows = np.repeat(row[np.newaxis], tries, axis=0)
    change = near * STEPS * rng.normal(size=rows.shape) * (rng.random(rows.shape) < 0.5)
    size = max(row[0], 0.3 * S[1])
    reach = 0.5 * row[0] * (1.0 + row[1]) + size * change[:, 0]
    behind = 0.5 * row[0] * (1.0 - row[1]) + size * change[:, 1]
    rows[:, 0] = np.clip(reach + behind, *S)
    rows[:, 1] = np.clip((reach - behind) / np.maximum(rows[:, 0], np.finfo(float).tiny), *ratio)
    rows[:, 2] *= 1.0 + change[:, 2]
    rows[:, 3] += np.copysign(max(size * abs(row[2]), noise / STEPS[3]), row[2]) * change[:, 3]
    rows[:, 4] = np.clip((rows[:, 4] + 0.3) * np.exp(change[:, 4]) - 0.3, 0.0, LAGS[-1])
    rows[:, 5] = np.clip(rows[:, 5] + np.round(change[:, 5]), 0, LATEST)
    return rows

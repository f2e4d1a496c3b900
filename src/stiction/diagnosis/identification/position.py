r"""A valve whose position was recorded: the S and J that explain it, and how well a good valve does.

The position is held against the stem of Kano's valve on the recorded OP, watched (see `watched`), behind a lag, late by
whole samples, on a scale of its own. Three kinds are searched for: a good valve, whose S is at most `LEAST` of OP's
swing, and no larger than `SMALL` or hidden in the noise; a deadband, with a larger S and J below `JUMP` S; and a valve
that sticks, with a larger J. A search begins at the best valves of a grid and of those that plain moves of the position
tell (see `moves`), and goes closer by chance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.position_trials import (
    DELAYS,
    LAGS,
    by_turns,
    draws,
    first_apart,
    grid,
    near_by,
    told,
)
from stiction.diagnosis.identification.watched import LATEST, decays, turns_of, watched, work_space
from stiction.records.quality.quantisation import robust_range
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LONGEST", "SMALL", "Watched", "Watching", "longest_seen", "noise_of", "watch"]

FINEST = 0.03
"""Least noise that what a valve leaves is measured by, as a share of the position's swing [-]: no model is a stem of
steel to the last decimal of a good transmitter."""
CAP = 4.0
"""c: deviation at which the stem is taken to be where it is seen, in standard deviations of the noise [-]: noise alone
is off by so much once in 16 000 samples. Of 240 loops of He's and Kano's valves (half of them slower than their
controller; a script not kept) S is within 10 % in 232, with 3 in 233 and with 6 in 224."""
LEAST, SMALL, HIDDEN = 0.1, 0.5, 2.0
"""S up to which a valve is good: as a share of OP's swing [-], but no more than so large [% of span], or so many
standard deviations of the position's noise where that is more [-]. A load that drifts widens the swing, not the band.
Flow loops of another hand's simulator under such loads, S 0.8 to 3 % and 0.08 or 0.04 of OP's swing (scripts not kept):
of 40 with a position of two decimals 39 show a band, by the share alone none; of 40 with noise and rounding of 0.05 to
0.4 % 34, as many without the noise's part, 29 with three deviations. Without that part six more of 450 loops that do
not stick (`simulation.population`, seed 711) are no longer told so surely. None of 600 good valves, whose OP swings by
5 to 60 %, is newly taken for one with a band, slow, bent and rate-limited ones among them."""
BANDS = 26
"""S tried at first between `LEAST` of OP's swing and all of it [-]; as close to each other below."""
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
"""How far a slope may be from a known one, and from one guessed from the swings [-]. With half and with twice the first
S is within 10 % in 229 and 231 of the same 240 loops."""
FIRST_LOOK, LONGEST = 1000, 6000
"""Samples of the first look, and the most that are compared [-]: the time of a search grows with both."""
CLOSER = (
    (0.03, 1.0, 1.0, 24, 3, 20, FIRST_LOOK), (0.015, 0.3, 1.0, 6, 6, 30, 1200), (0.01, 0.0, 0.5, 2, 10, 40, LONGEST),
)  # fmt: skip
"""Of each closer search: least noise that the position is taken to have, as a share of its swing, how loose slips are,
size of the first steps, valves it starts from, rounds, valves tried in each, and samples that are looked at [-]. Of 128
sticky loops of `simulation.population` (seed 9711) whose position shows anything of the stem or nothing S is within
10 % in 92, with 2000 samples in the second in 91; from one valve alone in the last in 79."""
SLOWER = 0.65
"""Factor of the steps after a round in which no better valve was found [-]: ten rounds in a row make them 0.013."""
MUCH = 1e300
"""More than any valve leaves [squares of the position's unit]."""
FEWER = 3
"""One valve in so many of those is gone on from where a good one is searched: its band hardly tells [-]."""


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

    @property
    def row(self) -> NDArray[np.float64]:
        """It as a row of S, J / S, slope, level, lag, lateness and rests."""
        return np.array([self.S, self.J / self.S if self.S > 0.0 else 0.0, *self[2:7]])


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
    finer: float
    """Square of that noise over the least that is taken where OP swings no further than a good valve's S lets it [-]:
    what is left, by that."""

    def share(self, valve: Watched) -> float:
        """Share of the position's variance that a valve explains when watched [%]."""
        return 100.0 * max(1.0 - valve.left / self.spread, 0.0)


class _Sight(NamedTuple):
    """What is compared, and room for it."""

    op: NDArray[np.float64]
    y: NDArray[np.float64]
    known: NDArray[np.int64]
    mean: float
    noise: float
    swing: float
    work: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]
    cap: float = np.inf

    def sigma(self, share: float) -> float:
        """Noise of the position, or that share of its swing where it is less."""
        return max(self.noise, share * self.swing)

    def by(self, share: float, n: int) -> _Sight:
        """The first `n` samples, with a stem that is taken to be where it is seen when it is off by `CAP` of that."""
        return self._replace(op=self.op[:n], y=self.y[:n], cap=CAP * self.sigma(share))

    def left(
        self, rows: NDArray[np.float64], loose: float, least: float | NDArray[np.float64] = np.inf
    ) -> NDArray[np.float64]:
        """What rows of S, J / S, slope, level, lag, lateness and rests leave; see `watched`."""
        left = np.empty(len(rows))
        watched(
            self.op, self.y, self.known, self.mean, rows, decays(rows[:, 4]), self.cap, loose,
            self.op.size // 50 + LATEST, np.array(least, dtype=float, ndmin=1), left, *self.work,
        )  # fmt: skip
        return left

    def turns(self, row: NDArray[np.float64]) -> int:
        """How often the stem of such a row sets out in another direction."""
        return turns_of(self.op, self.y, self.mean, row, decays(row[4:5])[0], self.cap, 0.0, self.work[0])

    def explained(self, found: Watched) -> float:
        """Share of the position's variance that a valve explains when it is not corrected by what is seen [-]."""
        left = self._replace(cap=np.inf).left(found.row[np.newaxis], 0.0)
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
    # A quarter of normal deviations is below 0.3186, and a move is the difference of two.
    return quantiles(moves, 0.25)[0] / (0.3186 * 2.0**0.5) if moves.size else 0.0


def _slopes(op: NDArray[np.float64], y: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], bool]:
    """Slopes that the position may have over OP, and whether they are those of known units."""
    ends = (quantiles(x, 0.01, 0.99) for x in (op, y))  # spikes would widen them
    op, y = (np.clip(x, low, high) for x, (low, high) in zip((op, y), ends, strict=True))
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


def watch(op: NDArray[np.float64], y: NDArray[np.float64], step: float, small: float = SMALL) -> Watching:
    """Search the best valve of each kind.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output without gaps [% of span]; no more than `LONGEST` samples are compared (see `longest_seen`).
    y : ndarray, shape (n_samples,)
        Position [any unit]; NaN are passed over.
    step : float
        Resolution of the position [its unit]; 0 where it has none.
    small : float, default 0.5
        S up to which a valve may be good in any case but that of a smaller swing [% of span]; infinite where OP is in
        another unit, so that its swing alone tells.

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
    known = np.concatenate([[0], np.cumsum(~np.isnan(y))])
    sight = _Sight(op, y, known, float(op.mean()), noise, robust_range(y), work_space(y.size))
    swing, whole = robust_range(op), float(np.ptp(op))
    wide, share = CALIBRATED if of_unit else FREE, LEAST * swing
    least = min(share, max(small, HIDDEN * noise / float(np.abs(slopes).max())))
    bands, shares = _bands(least, share, whole), np.array([0.2, 0.5, 0.8, 1.0])
    plain, good = np.zeros(1), [(lag, late) for lag in LAGS for late in range(LATEST + 1)]
    searches = (
        (grid(op, y, swing, plain, plain, slopes, good), (0.0, least), (0.0, 1.0)),
        (grid(op, y, swing, bands, plain, slopes, DELAYS), (least, whole), (0.0, JUMP)),
        (grid(op, y, swing, bands, shares, slopes, DELAYS, (0.0, 1.0)), (least, whole), (JUMP, 1.0)),
    )
    by_moves, found = told(op, y, noise, slopes), []
    for rows, S, J in searches:
        inside = np.clip(by_moves, (S[0], J[0], *5 * [-np.inf]), (S[1], J[1], *5 * [np.inf]))
        found.append(_best(sight, np.concatenate([rows, inside]), S, J, slopes, wide))
    if least < share and found[0].left > min(found[1].left, found[2].left):
        # A good valve whose band is just small enough is found from one whose band is just too large.
        rows = np.minimum([one.row for one in found[1:]], (least, *6 * [np.inf]))
        found[0] = min(found[0], _best(sight, rows, (0.0, least), (0.0, 1.0), slopes, wide), key=lambda one: one.left)
    fine = sight._replace(swing=sight.swing * least / share)
    return Watching(
        good=found[0], deadband=found[1], stiction=found[2], noise=noise / abs(found[0].slope),
        explained=max(map(sight.explained, found)), spread=float(np.nanvar(y)) / sight.sigma(FINEST) ** 2,
        finer=(sight.sigma(FINEST) / fine.sigma(FINEST)) ** 2,
    )  # fmt: skip


def _bands(least: float, share: float, whole: float) -> NDArray[np.float64]:
    """S tried at first: `BANDS` from a share of OP's swing to all of it, and as close to each other down to `least`."""
    bands = np.geomspace(1.1 * share, whole, BANDS)
    closer = bands[0] / bands[1]
    return np.concatenate([bands[0] * closer ** np.arange(int(np.log(least / share) / np.log(closer)), 0, -1), bands])


def _best(
    sight: _Sight,
    rows: NDArray[np.float64],
    S: tuple[float, float],
    ratio: tuple[float, float],
    slopes: NDArray[np.float64],
    wide: float,
) -> Watched:
    """The best valve within bounds, searched closer and closer from the best of `rows`."""
    left = sight.by(FINEST, FIRST_LOOK).left(rows, 1.0, MUCH)
    rows, tried = rows[np.argsort(left)], []
    starts = [row for stops in (0.0, 1.0) for row in first_apart(rows[rows[:, 6] == stops], CLOSER[0][3])]
    shapes = _searches(len(starts), FEWER if S[0] == 0.0 else 1)
    for (share, loose, wide_at_first, _, rounds, tries, n), chance in zip(CLOSER, draws(shapes), strict=True):
        close, some = sight.by(share, n), np.arange(chance.shape[1])
        best = np.array(by_turns(starts)[: some.size])
        error, near, tried = close.left(best, loose), np.full(some.size, wide_at_first), []
        slope = slopes[np.abs(slopes - best[:, 2:3]).argmin(axis=1)]
        bounds = np.array([(*S, *ratio, one, 1.0 - wide, 1.0 + wide) for one in slope])
        for k in range(rounds):  # of all searches at once: none knows of another
            others = near_by(best, near, chance[:, :, k], bounds, sight.sigma(FINEST))
            left = close.left(others.reshape(-1, 7), loose, error if n == LONGEST else 0.5 * error).reshape(-1, tries)
            tried.append((others, left))
            i = left.argmin(axis=1)
            better = left[some, i] < error
            best = np.where(better[:, np.newaxis], others[some, i], best)
            error, near = np.where(better, left[some, i], error), np.where(better, near, SLOWER * near)
        starts = [np.array(one) for _, one in sorted(zip(error, map(tuple, best), strict=True))]
    best, last = starts[0], sight.by(FINEST, LONGEST)
    rows, left = (np.stack(part, axis=1) for part in zip(*tried, strict=True))
    rows, left = rows.reshape(-1, 7), left.ravel() / sight.sigma(CLOSER[-1][0]) ** 2
    band, share, slope, level, lag, late, stops = (float(x) for x in best)
    return Watched(
        S=band, J=band * share, slope=slope, level=level, lag=lag, late=round(late), stops=stops,
        left=float(last.left(best[np.newaxis], 0.0)[0]) / sight.sigma(FINEST) ** 2, turns=last.turns(best),
        tried=np.column_stack([rows[:, 0], rows[:, 0] * rows[:, 1], left]),
    )  # fmt: skip


def _searches(starts: int, fewer: int) -> tuple[tuple[int, int, int], ...]:
    """Searches, rounds and valves tried in each, of each closer search from so many starts, one in `fewer` kept."""
    shapes = []
    for _, _, _, keep, rounds, tries, _ in CLOSER:
        starts = min(starts, -(-keep // fewer))
        shapes.append((starts, rounds, tries))
    return tuple(shapes)

"""Find the weights of the verdict again, judge each real loop by weights found without it, and write the tables.

python tests/diagnosis/verdict/calibrate.py ../shared/data --loops 7000 --plants 4800 --seed 101 --jobs 2 [--write]

--keep keeps the rows of features in a file, --rows goes on from such files. The features of the first table are chosen
by many samples of the loops, one feature after the other, by what each adds on simulated loops that were not fitted and
on real loops left out; its weights are the means of theirs. A real loop is judged by the samples that do not hold it,
with weights found without it: neither its features nor its weights know the loop.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import stiction as st
from stiction.apps.labels import read_labels
from stiction.diagnosis.verdict.diagnose import findings
from stiction.diagnosis.verdict.features import Features
from stiction.diagnosis.verdict.probability import FLOOR, JUMP, LESS, OTHERS, PLANT, SAFE, SIGNS, UNDECIDED
from stiction.diagnosis.verdict.weighing import COLUMNS, CONSTANT
from stiction.simulation.population import CAUSES, plant_population, population

NAMES = Features._fields
STICTION, PLAY = CAUSES.index("stiction"), CAUSES.index("deadband")
HERE = Path(st.__file__).parent / "diagnosis" / "verdict"
RIDGE_STICKS, RIDGE_CAUSES = 4.0, 1.0
RIDGE_PLANT = 0.4
"""Ridge of the fourth table to each loop that it is found on [-]: so strong that no feature counts much for being told
apart from others, which is what does not carry over from simulated to recorded loops."""
STICKY_PLANTS = 0.4
"""What the sticky loops of a plant's historian weigh together, against the others [-]."""
REAL = 0.6
"""What all real loops weigh together, against all simulated ones [-]."""
CORE = ("band", "advantage", "grip")
"""Features that every choice begins with."""
SHARE_REAL = 0.35
"""What the loss on the real loops left out counts, against that on simulated ones, when features are chosen [-]."""
PARTS = ((0, 4), (0, 3), (1, 4))
"""Quarters of a real record from which to which it is a row: what is told should not hang on where a record begins."""
OF_JUMPS = ("likely_jump_gain", "own_samples")
"""Features of the third table."""
JUMPS = [NAMES.index(name) for name in OF_JUMPS]
LEAST_GAIN = 0.001
MOST = 8
"""What a feature must take off the loss to be chosen, and how many are at most [-]."""
BAGS, OF_REAL, OF_SIMULATED = 32, 0.75, 0.35
"""Samples of the loops that choose features, and the shares of the real and of the simulated loops in each [-]."""
FEWEST = 3
"""Samples that must choose a feature for it to be in the table: what fewer choose may be by chance [-]."""
FOLDS = 4
"""Parts that the simulated loops are left out in, to see how well they are told."""
TESTED = 5
"""One simulated loop in so many is left out of the fits."""


class Lines:
    """Each feature as a straight line with a bend at its median, in standard deviations."""

    def __init__(self, X):
        self.low, self.high = np.quantile(X, (0.002, 0.998), axis=0)
        held = np.clip(X, self.low, self.high)
        self.usual, self.scale, self.knot = held.mean(0), held.std(0) + 1e-9, np.median(held, axis=0)

    def __call__(self, X, chosen):
        held = np.clip(X, self.low, self.high)
        line = (held - self.usual) / self.scale
        bend = (np.maximum(held - self.knot, 0.0) - np.maximum(self.usual - self.knot, 0.0)) / self.scale
        return np.hstack([np.ones((len(X), 1)), line[:, chosen], bend[:, chosen]])

    def rows(self, outcome, b, chosen):
        """Rows of a file of weights."""
        yield outcome, CONSTANT, "", "", "", "", f"{b[0]:.4g}", ""
        for i, k in enumerate(chosen):
            slope, bend = b[1 + i] / self.scale[k], b[1 + len(chosen) + i] / self.scale[k]
            numbers = (self.low[k], self.high[k], self.usual[k], self.knot[k], slope, bend)
            yield outcome, NAMES[k], *(f"{x:.5g}" for x in numbers)


def squash(odds):
    return 1.0 / (1.0 + np.exp(-np.clip(odds, -30.0, 30.0)))


def fit_sticks(F, y, weight, start=None, ridge=RIDGE_STICKS):
    """Weights of a logistic regression with a ridge, by Newton's method."""
    b = np.zeros(F.shape[1]) if start is None else start.copy()
    ridge = ridge * np.diag([0.0, *np.ones(F.shape[1] - 1)])
    for _ in range(20):
        p = squash(F @ b)
        slope = F.T @ (weight * (p - y)) + ridge @ b
        step = np.linalg.solve((F * (weight * p * (1.0 - p) + 1e-9)[:, np.newaxis]).T @ F + ridge, slope)
        b -= step
        if np.abs(step).max() < 1e-4:
            break
    return b


def fit_causes(F, y):
    """Weights of a multinomial logistic regression with a ridge, shape (n_terms, n_causes)."""
    k = len(CAUSES)
    Y = np.eye(k)[y]

    def loss(flat):
        W = flat.reshape(-1, k)
        Z = F @ W
        Z -= Z.max(1, keepdims=True)
        P = np.exp(Z)
        total = P.sum(1, keepdims=True)
        value = -(Y * (Z - np.log(total))).sum() + 0.5 * RIDGE_CAUSES * (W[1:] ** 2).sum()
        slope = F.T @ (P / total - Y)
        slope[1:] += RIDGE_CAUSES * W[1:]
        return value, slope.ravel()

    return minimize(loss, np.zeros(F.shape[1] * k), jac=True, method="L-BFGS-B", options={"maxiter": 300}).x.reshape(
        -1, k
    )


def row(record):
    """Features of one record, or NaN where it is refused."""
    warnings.simplefilter("ignore")
    found = findings(record)
    return list(found.features) if found.features is not None else [np.nan] * len(NAMES)


def of_case(case):
    return [CAUSES.index(case.cause), *row(case.record)]


def gather(folder, loops, plants, seed, jobs):
    """Rows of the simulated loops, cause first, and of the real ones, with their labels, groups and names."""
    from population import each  # the page beside this script

    simulated = np.array(list(each(of_case, population(loops, seed=seed), jobs, loops)))
    kept = np.array(list(each(of_case, plant_population(plants, seed), jobs, plants)))
    real, of = [], []
    for one in read_labels(str(folder)):
        record = st.read(one.path, dt=one.dt, loop_type=one.loop_type)[0]
        for first, last in PARTS:
            real.append(row(record.window(first * len(record) // 4, last * len(record) // 4)))
            of.append((one.label == "stiction", one.group, one.file, (first, last) == PARTS[0]))
    told = np.isfinite(real).all(axis=1)
    sticky, group, record, whole = (np.array(column)[told] for column in zip(*of, strict=True))
    return {
        "simulated": simulated, "plants": kept, "real": np.array(real)[told], "sticky": sticky, "group": group,
        "record": record, "whole": whole,
    }  # fmt: skip


class Sticks:
    """The first table: fits on the simulated loops that are no deadband, and on the real ones."""

    def __init__(self, lines, X, y, real, sticky, group):
        own = y != PLAY
        self.lines, self.X, self.y = lines, X[own], (y[own] == STICTION).astype(float)
        self.real, self.sticky, self.group = real, sticky.astype(float), group
        self.share = np.array([1.0 / np.sum(group == g) for g in group])
        self.tested = np.arange(self.y.size) % TESTED == 0

    def fit(self, chosen, left_out=None, start=None, *, whole=True):
        keep = np.ones(self.sticky.size, bool) if left_out is None else self.group != left_out
        own = np.ones(self.y.size, bool) if whole else ~self.tested
        F = np.r_[self.lines(self.X[own], chosen), self.lines(self.real[keep], chosen)]
        weight = np.r_[np.ones(own.sum()), REAL * own.sum() / self.share.sum() * self.share[keep]]
        return fit_sticks(F, np.r_[self.y[own], self.sticky[keep]], weight, start)

    def left_out(self, chosen):
        """Probability of each real record by weights found without its loop and the simulated loops tested."""
        p, start = np.empty(self.sticky.size), self.fit(chosen, whole=False)
        for g in np.unique(self.group):
            own = self.group == g
            p[own] = squash(self.lines(self.real[own], chosen) @ self.fit(chosen, g, start, whole=False))
        return p

    def loss(self, chosen):
        """Mean log loss on the simulated loops not fitted, and its weighted share on the real ones left out."""
        b = self.fit(chosen, whole=False)
        simulated = log_loss(squash(self.lines(self.X[self.tested], chosen) @ b), self.y[self.tested])
        return simulated + SHARE_REAL * log_loss(self.left_out(chosen), self.sticky, self.share)

    def select(self):
        chosen = [NAMES.index(name) for name in CORE]
        best = self.loss(chosen)
        while len(chosen) < MOST:
            tries = [(self.loss([*chosen, k]), k) for k in range(len(NAMES)) if k not in chosen]
            loss, k = min(tries)
            if loss > best - LEAST_GAIN:
                break
            best = loss
            chosen.append(k)
        return chosen


def choose(bag, lines, X, y, real, sticky, group):
    """The real loops in a sample of the loops, and the features that it chooses."""
    draw, loops = np.random.default_rng([77, bag]), np.unique(group)
    held = draw.permutation(loops)[: int(OF_REAL * loops.size)]
    own, rows = draw.random(y.size) < OF_SIMULATED, np.isin(group, held)
    return held, Sticks(lines, X[own], y[own], real[rows], sticky[rows], group[rows]).select()


class Committee:
    """What all samples of the loops choose: a table of the features that several choose, of mean weights."""

    def __init__(self, bags):
        count = np.bincount([k for _, chosen in bags for k in chosen], minlength=len(NAMES))
        self.features = [int(k) for k in np.argsort(-count, kind="stable") if count[k] >= FEWEST]
        self.count, self.bags = count[self.features], bags

    def fit(self, sticks):
        """Mean weights: constant, slope and bend of each feature."""
        kept = [[k for k in chosen if k in self.features] for _, chosen in self.bags]
        return np.mean([self._weights(sticks.fit(chosen), chosen) for chosen in kept], axis=0)

    def left_out(self, sticks):
        """Log odds of each real record by the samples that do not hold its loop, with weights found without it.

        All that these chose counts: which features several samples chose, others that hold the loop have a say in.
        """
        odds, judges = np.zeros((2, sticks.sticky.size))
        for held, chosen in self.bags:
            start = sticks.fit(chosen)
            for g in np.setdiff1d(sticks.group, held):
                own = sticks.group == g
                odds[own] += sticks.lines(sticks.real[own], chosen) @ sticks.fit(chosen, g, start)
                judges[own] += 1.0
        return odds / judges

    def _weights(self, b, chosen):
        at, n = np.array([self.features.index(k) for k in chosen]), len(self.features)
        out = np.zeros(1 + 2 * n)
        out[0], out[1 + at], out[1 + n + at] = b[0], b[1 : 1 + at.size], b[1 + at.size :]
        return out


def fit_jumps(lines, X, y):
    """Weights of the third table: stiction against play on loops that integrate, both counting the same."""
    own = (X[:, NAMES.index("integrating")] == 1.0) & ((y == STICTION) | (y == PLAY))
    sticky = y[own] == STICTION
    weight = np.where(sticky, 0.5 / sticky.mean(), 0.5 / (1.0 - sticky.mean()))
    return fit_sticks(lines(X[own], JUMPS), sticky.astype(float), weight)


class Plant:
    """The fourth table: of loops as a plant's historian keeps them, and what tells these from the others."""

    def __init__(self, X, P, sticky):
        self.every = list(range(len(NAMES)))
        own = np.r_[np.ones(len(P)), np.zeros(len(X))]
        self.lines, both = Lines(P), np.r_[P, X]
        self.sticks = self._fit(P, sticky, STICKY_PLANTS)
        self.kept = self._fit(both, own, 0.5)

    def _fit(self, X, y, share):
        weight = np.where(y == 1.0, share / y.mean(), (1.0 - share) / (1.0 - y.mean()))
        return fit_sticks(self.lines(X, self.every), y, weight, ridge=RIDGE_PLANT * y.size)

    def __call__(self, X):
        """Log odds that the valve sticks, and probability that a plant's historian kept the record."""
        F = self.lines(X, self.every)
        return F @ self.sticks, squash(F @ self.kept)

    def rows(self):
        for outcome, b in (("stiction", self.sticks), ("plant", self.kept)):
            yield from self.lines.rows(outcome, b, self.every)


def pooled(p, scores, jump, plant):
    """Probability of each cause by all tables, as `probability.causes` has it."""
    q = np.exp(scores - scores.max(1, keepdims=True))
    q /= q.sum(1, keepdims=True)
    jump = (1.0 - JUMP) * (scores[:, STICTION] - scores[:, PLAY]) + JUMP * jump
    band = q[:, STICTION] + q[:, PLAY]
    play = np.minimum(band * squash(-jump), SAFE)
    alike = np.clip((band - play) / (1.0 - play), FLOOR, 1.0 - FLOOR)
    p = np.clip(p, 1e-12, 1.0 - 1e-12)
    odds, kept = plant
    odds = (1.0 - kept * LESS) * np.log(p / (1.0 - p)) + kept * PLANT * odds
    odds += (1.0 - kept) * OTHERS * np.log(alike / (1.0 - alike))
    sticks = squash(odds) * (1.0 - play)
    rest = ((1.0 - sticks - play) / np.maximum(1.0 - band, 1e-12))[:, np.newaxis]
    both = q * rest
    both[:, STICTION], both[:, PLAY] = sticks, play
    return both


def fourfold(X, y, plant, real, sticky, group, committee):
    """Print accuracy and calibration on simulated loops not fitted, by all tables pooled and by the second alone."""
    every, fold = list(range(len(NAMES))), np.arange(y.size) % FOLDS
    p, jump, scores = np.empty(y.size), np.empty(y.size), np.empty((y.size, len(CAUSES)))
    for k in range(FOLDS):
        fitted, left = fold != k, fold == k
        lines = Lines(X[fitted])
        first = Sticks(lines, X[fitted], y[fitted], real, sticky, group)
        p[left] = squash(lines(X[left], committee.features) @ committee.fit(first))
        scores[left] = scored(X[left], lines, fit_causes(lines(X[fitted], every), y[fitted]))
        jump[left] = lines(X[left], JUMPS) @ fit_jumps(lines, X[fitted], y[fitted])
    alone = np.exp(scores - scores.max(1, keepdims=True))
    alone /= alone.sum(1, keepdims=True)
    for name, shares in (("all tables", pooled(p, scores, jump, plant(X))), ("the second table alone", alone)):
        named = shares.argmax(1)
        accuracy = np.mean([np.mean(named[y == k] == k) for k in range(len(CAUSES))])
        told, bins = shares[:, STICTION], np.minimum((10.0 * shares[:, STICTION]).astype(int), 9)
        error = sum(abs((told - (y == STICTION))[bins == b].sum()) for b in range(10)) / y.size
        print(f"simulated loops left out, {name}: balanced accuracy {accuracy:.3f}, calibration error {error:.3f}")
    pair = (X[:, NAMES.index("integrating")] == 1.0) & ((y == STICTION) | (y == PLAY))
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        odds = ((1.0 - share) * (scores[:, STICTION] - scores[:, PLAY]) + share * jump)[pair]
        sticks, plays = (
            np.logaddexp(0.0, sign * odds[y[pair] == k]).mean() for k, sign in ((STICTION, -1.0), (PLAY, 1.0))
        )
        print(f"third table counting {share}: log loss {sticks:.3f} on sticky integrating loops, {plays:.3f} on play")


def scored(X, lines, W):
    """Log odds of each cause; none of a transmitter that shows no sign of a fault."""
    scores = lines(X, list(range(len(NAMES)))) @ W
    signs = [X[:, NAMES.index(sign)] > least for sign, least in SIGNS.items()]
    scores[~np.any(signs, axis=0), CAUSES.index("sensor")] = -np.inf
    return scores


def told(rows):
    """Features and causes of the loops that are not refused."""
    rows = rows[np.isfinite(rows).all(axis=1)]
    return rows[:, 1:], rows[:, 0].astype(int)


def log_loss(p, y, weight=None):
    return float(np.average(-np.log(np.clip(np.where(y == 1.0, p, 1.0 - p), 5e-3, 1.0)), weights=weight))


def tell(p, sticky, group, files):
    """Print how the real loops come out."""
    right = np.where(sticky, p > UNDECIDED[1], p < UNDECIDED[0])
    unsure = (p >= UNDECIDED[0]) & (p <= UNDECIDED[1])
    loops = [right[group == g].mean() > 0.5 for g in np.unique(group)]
    sure = int(np.where(sticky, p < 0.1, p > 0.9).sum())
    print(f"{right.sum()} of {p.size} records, {sum(loops)} of {len(loops)} loops right")
    print(f"{unsure.sum()} records undecided, {sure} wrong with more than 0.9")
    for name, chance, truth in zip(files[~right], p[~right], sticky[~right], strict=True):
        print(f"  {name}: {'stiction' if truth else 'no_stiction'}, probability {chance:.2f}")


def write(name, rows):
    with (HERE / f"{name}.csv").open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        out.writerows(rows)


def main() -> None:
    from population import each  # the page beside this script

    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--loops", type=int, default=7000)
    ask.add_argument("--plants", type=int, default=4800)
    ask.add_argument("--seed", type=int, default=101)
    ask.add_argument("--jobs", type=int, default=1)
    ask.add_argument("--keep", type=Path, help="file to keep the rows of all loops in")
    ask.add_argument("--rows", type=Path, nargs="+", help="files that kept rows, in place of new ones")
    ask.add_argument("--write", action="store_true", help="write the tables into the package")
    given = ask.parse_args()
    kept = [np.load(file) for file in given.rows or ()]
    kept = kept or [gather(given.folder, given.loops, given.plants, given.seed, given.jobs)]
    if given.keep:
        np.savez(given.keep, **kept[0])
    (X, y), (P, of_plant) = (told(np.concatenate([one[name] for one in kept])) for name in ("simulated", "plants"))
    real, sticky, group, files, whole = (kept[0][name] for name in ("real", "sticky", "group", "record", "whole"))
    lines = Lines(X)
    first = Sticks(lines, X, y, real, sticky, group)
    asked = partial(choose, lines=lines, X=X, y=y, real=real, sticky=sticky, group=group)
    committee = Committee(list(each(asked, range(BAGS), given.jobs, BAGS)))
    voices = zip(committee.features, committee.count, strict=True)
    print(f"features of the first table, of {BAGS}:", ", ".join(f"{NAMES[k]} {n}" for k, n in voices))
    every = list(range(len(NAMES)))
    W = fit_causes(lines(X, every), y)
    b = fit_jumps(lines, X, y)
    scores, jump = scored(real, lines, W), lines(real, JUMPS) @ b
    plant = Plant(X, P, (of_plant == STICTION).astype(float))
    odds, kept = plant(real)
    print(f"recorded loops look kept by a plant's historian by {np.median(kept):.2f}, simulated ones by", end=" ")
    print(f"{np.median(plant(X)[1]):.2f}; the fourth table alone, found without any recorded loop:")
    tell(squash(odds[whole]), sticky[whole], group[whole], files[whole])
    p = pooled(squash(committee.left_out(first)), scores, jump, (odds, kept))[:, STICTION]
    print("all tables, one loop left out at a time:")
    tell(p[whole], sticky[whole], group[whole], files[whole])
    parts = log_loss(p[~whole], sticky[~whole], first.share[~whole])
    right = np.average(np.where(sticky, p > 0.5, p < 0.5)[~whole], weights=first.share[~whole])
    print(f"three quarters of them: {right:.3f} right, log loss {parts:.3f}")
    fourfold(X, y, plant, real, sticky, group, committee)
    alone = np.exp(scores - scores.max(1, keepdims=True))
    alone = alone[:, STICTION] / alone.sum(1)
    print("the second table alone, on the real loops:")
    tell(alone[whole], sticky[whole], group[whole], files[whole])
    if given.write:
        write("sticks", lines.rows("stiction", committee.fit(first), committee.features))
        write("jumps", lines.rows("jump", b, JUMPS))
        write("plant", plant.rows())
        write("causes", (line for k, cause in enumerate(CAUSES) for line in lines.rows(cause, W[:, k], every)))


if __name__ == "__main__":
    main()

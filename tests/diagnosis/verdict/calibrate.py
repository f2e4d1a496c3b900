"""Find the weights of the verdict again, judge each real loop by weights found without it, and write the tables.

python tests/diagnosis/verdict/calibrate.py ../shared/data --seed 101 --jobs 2 [--write]

--keep keeps the rows of features in a file, --rows goes on from such files. The features of the first table are chosen
by many samples of the loops, one feature after the other, by what each adds on simulated loops that were not fitted and
on real loops left out; its weights are the means of theirs. A real loop is judged by the samples that do not hold it,
with weights found without it: neither its features nor its weights know the loop. The fourth table is found without any
real loop at all.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from datetime import date
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from population import each  # a page beside this script, as the next
from weights import (
    JUMPS,
    NAMES,
    PLAY,
    STICTION,
    Lines,
    Plant,
    fit_causes,
    fit_jumps,
    fit_sticks,
    log_loss,
    pooled,
    scored,
    squash,
)

import stiction as st
from calibration.populations import (
    CAUSES,
    plant_population,
    population,
    two_fault_population,
    upset_population,
    wandering_population,
)
from stiction.apps.labels import read_labels
from stiction.diagnosis.verdict.findings import findings
from stiction.diagnosis.verdict.probability import UNDECIDED
from stiction.diagnosis.verdict.weighing import COLUMNS

HERE = Path(st.__file__).parent / "diagnosis" / "verdict"
REAL = 0.6
"""What all real loops weigh together, against all simulated ones [-]."""
CORE = ("band", "advantage", "grip")
"""Features that every choice begins with."""
SHARE_REAL = 0.35
"""What the loss on the real loops left out counts, against that on simulated ones, when features are chosen [-]."""
PARTS = ((0, 4), (0, 3), (1, 4))
"""Quarters of a real record from which to which it is a row: what is told should not hang on where a record begins."""
LEAST_DROP = 0.001
MOST = 8
"""What a feature must take off the loss to be chosen, and how many are at most [-]."""
BAGS, OF_REAL, OF_SIMULATED = 32, 0.75, 0.35
"""Samples of the loops that choose features, and the shares of the real and of the simulated loops in each [-]."""
FEWEST = 3
"""Samples that must choose a feature for it to be in the table: what fewer choose may be by chance [-]."""
FOLDS = 4
"""Parts that the simulated loops are left out in, to see how well they are told."""
SHORT = (100, 500)
"""Fewest and most samples of the short records [-]: of an hour or a shift, shorter than those of `population`."""
TESTED = 5
"""One simulated loop in so many is left out of the fits."""


def row(record):
    """Features of one record, or NaN where it is refused."""
    warnings.simplefilter("ignore")
    found = findings(record)
    return list(found.features) if found.features is not None else [np.nan] * len(NAMES)


def of_case(case):
    return [CAUSES.index(case.cause), *row(case.record)]


def gather(folder, loops, short, upsets, wandering, faults, plants, seed, jobs):
    """Rows of the simulated loops, cause first, and of the real ones, with their labels, groups and names."""
    drawn = chain(
        population(loops, seed=seed), upset_population(upsets, seed), population(short, seed=seed + 1, samples=SHORT),
        wandering_population(wandering, seed), two_fault_population(faults, seed),
    )  # fmt: skip
    simulated = np.array(list(each(of_case, drawn, jobs, loops + upsets + short + wandering + faults)))
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
        "seed": np.array(seed), "simulated": simulated, "plants": kept, "real": np.array(real)[told], "sticky": sticky,
        "group": group, "record": record, "whole": whole,
    }  # fmt: skip


class Sticks:
    """The first table: fits on the simulated loops that are no deadband, and on the real ones."""

    def __init__(self, lines, X, y, number, real, sticky, group):
        own = y != PLAY
        self.lines, self.X, self.y = lines, X[own], (y[own] == STICTION).astype(float)
        self.real, self.sticky, self.group = real, sticky.astype(float), group
        self.share = np.array([1.0 / np.sum(group == g) for g in group])
        self.tested = number[own] % TESTED == 0

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
            if loss > best - LEAST_DROP:
                break
            best = loss
            chosen.append(k)
        return chosen


def choose(bag, lines, X, y, number, real, sticky, group):
    """The real loops in a sample of the loops, and the features that it chooses.

    A simulated loop is drawn by its `number`, so that one more that is refused changes no other's lot.
    """
    draw, loops = np.random.default_rng([77, bag]), np.unique(group)
    held = draw.permutation(loops)[: int(OF_REAL * loops.size)]
    own, rows = draw.random(number[-1] + 1)[number] < OF_SIMULATED, np.isin(group, held)
    return held, Sticks(lines, X[own], y[own], number[own], real[rows], sticky[rows], group[rows]).select()


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


def fourfold(X, y, number, P, of_plant, real, sticky, group, committee):
    """Print accuracy and calibration on simulated loops not fitted, by all tables pooled and by the second alone."""
    every, fold = list(range(len(NAMES))), number % FOLDS
    p, jump, scores = np.empty(y.size), np.empty(y.size), np.empty((y.size, len(CAUSES)))
    fourth = np.empty((2, y.size))
    for k in range(FOLDS):
        fitted, left = fold != k, fold == k
        lines = Lines(X[fitted])
        first = Sticks(lines, X[fitted], y[fitted], number[fitted], real, sticky, group)
        p[left] = squash(lines(X[left], committee.features) @ committee.fit(first))
        fourth[:, left] = Plant(X[fitted], P, of_plant)(X[left])
        scores[left] = scored(X[left], lines, fit_causes(lines(X[fitted], every), y[fitted]))
        jump[left] = lines(X[left], JUMPS) @ fit_jumps(lines, X[fitted], y[fitted])
    alone = np.exp(scores - scores.max(1, keepdims=True))
    alone /= alone.sum(1, keepdims=True)
    for name, shares in (("all tables", pooled(p, scores, jump, fourth)), ("the second table alone", alone)):
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


def told(rows):
    """Features, causes and numbers of the loops that are not refused."""
    number = np.flatnonzero(np.isfinite(rows).all(axis=1))
    return rows[number, 1:], rows[number, 0].astype(int), number


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


def write(name, rows, loops):
    with (HERE / f"{name}.csv").open("w", newline="") as file:
        file.write(f"# Found by tests/diagnosis/verdict/calibrate.py on {date.today()} from {loops}.\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        out.writerows(rows)


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--loops", type=int, default=7000)
    ask.add_argument("--short", type=int, default=1400)
    ask.add_argument("--upsets", type=int, default=450)
    ask.add_argument("--wandering", type=int, default=450)
    ask.add_argument("--faults", type=int, default=150)
    ask.add_argument("--plants", type=int, default=4800)
    ask.add_argument("--seed", type=int, default=101)
    ask.add_argument("--jobs", type=int, default=1)
    ask.add_argument("--keep", type=Path, help="file to keep the rows of all loops in")
    ask.add_argument("--rows", type=Path, nargs="+", help="files that kept rows, in place of new ones")
    ask.add_argument("--write", action="store_true", help="write the tables into the package")
    given = ask.parse_args()
    kept = [np.load(file) for file in given.rows or ()]
    seeds = {str(one["seed"]) for one in kept} or {str(given.seed)}
    drawn = given.loops, given.short, given.upsets, given.wandering, given.faults, given.plants
    kept = kept or [gather(given.folder, *drawn, given.seed, given.jobs)]
    if given.keep:
        np.savez(given.keep, **kept[0])
    X, y, number = told(np.concatenate([one["simulated"] for one in kept]))
    P, of_plant, _ = told(np.concatenate([one["plants"] for one in kept]))
    real, sticky, group, files, whole = (kept[0][name] for name in ("real", "sticky", "group", "record", "whole"))
    lines = Lines(X)
    first = Sticks(lines, X, y, number, real, sticky, group)
    asked = partial(choose, lines=lines, X=X, y=y, number=number, real=real, sticky=sticky, group=group)
    committee = Committee(list(each(asked, range(BAGS), given.jobs, BAGS)))
    voices = zip(committee.features, committee.count, strict=True)
    print(f"features of the first table, of {BAGS}:", ", ".join(f"{NAMES[k]} {n}" for k, n in voices))
    every = list(range(len(NAMES)))
    W = fit_causes(lines(X, every), y)
    b = fit_jumps(lines, X, y)
    scores, jump = scored(real, lines, W), lines(real, JUMPS) @ b
    of_plant = (of_plant == STICTION).astype(float)
    plant = Plant(X, P, of_plant)
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
    fourfold(X, y, number, P, of_plant, real, sticky, group, committee)
    alone = np.exp(scores - scores.max(1, keepdims=True))
    alone = alone[:, STICTION] / alone.sum(1)
    print("the second table alone, on the real loops:")
    tell(alone[whole], sticky[whole], group[whole], files[whole])
    if given.write:
        drawn = f", seed {' and '.join(sorted(seeds))}"
        others = "its upset, wandering and two_fault populations"
        simulated = f"{len(X)} loops of calibration.populations, some of them short, {others}{drawn}"
        plants = f"{simulated}; {len(P)} of plant_population{drawn}"
        recorded = f"{simulated}; {whole.sum()} records of {np.unique(group).size} recorded loops"
        causes = (line for k, cause in enumerate(CAUSES) for line in lines.rows(cause, W[:, k], every))
        write("sticks", lines.rows("stiction", committee.fit(first), committee.features), recorded)
        write("jumps", lines.rows("jump", b, JUMPS), simulated)
        write("plant", plant.rows(), plants)
        write("causes", causes, simulated)


if __name__ == "__main__":
    main()

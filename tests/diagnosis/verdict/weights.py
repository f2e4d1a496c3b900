"""Logistic regressions of straight lines with one bend, as the verdict weighs them, and how they are added."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from calibration.populations import CAUSES
from stiction.diagnosis.verdict.features import Features
from stiction.diagnosis.verdict.probability import FLOOR, JUMP, LESS, OTHERS, PLANT, SAFE, SIGNS
from stiction.diagnosis.verdict.weighing import CONSTANT

NAMES = Features._fields
STICTION, PLAY = CAUSES.index("stiction"), CAUSES.index("deadband")
RIDGE_STICKS, RIDGE_CAUSES = 4.0, 1.0
RIDGE_PLANT = 0.4
"""Ridge of the fourth table to each loop that it is found on [-]: so strong that no feature counts much for being told
apart from others, which is what does not carry over from simulated to recorded loops."""
STICKY_PLANTS = 0.4
"""What the sticky loops of a plant's historian weigh together, against the others [-]."""
OF_JUMPS = ("likelier_than_play", "own_samples")
"""Features of the third table."""
JUMPS = [NAMES.index(name) for name in OF_JUMPS]


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


def scored(X, lines, W):
    """Log odds of each cause; none of a transmitter or a limit that shows no sign."""
    scores = lines(X, list(range(len(NAMES)))) @ W
    for cause, signs in SIGNS.items():
        shown = [X[:, NAMES.index(sign)] > least for sign, least in signs.items()]
        scores[~np.any(shown, axis=0), CAUSES.index(cause)] = -np.inf
    return scores


def log_loss(p, y, weight=None):
    return float(np.average(-np.log(np.clip(np.where(y == 1.0, p, 1.0 - p), 5e-3, 1.0)), weights=weight))

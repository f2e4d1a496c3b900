"""Coherence of complex envelopes: how far two loops oscillate together, and how far unrelated loops would."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "chance_level",
    "changes_of",
    "coherence_floor",
    "coherence_matrix",
    "common_envelope",
    "link_coherent",
    "related_loops",
]  # fmt: skip

MIN_SHIFTS = 200
"""Smallest number of pairs that are shifted against each other to find the coherence of unrelated loops [-]."""
MAX_FLOOR = 0.9
"""Largest floor that the shifts give [-]: two steady waves cohere at every shift."""
PAIRS_AT_ONCE = 512
"""Pairs that are shifted at the same time [-]: a thousand loops have 20 000 pairs, and each needs its envelopes."""
INDEPENDENT_SHARE = 0.9
"""Independent windows over all windows, which overlap by half [-]."""
INDEPENDENT_CHANGES = 0.7
"""Independent changes over all changes of an envelope [-]; neighbours share a window."""


def coherence_matrix(envelopes: NDArray) -> NDArray[np.float64]:
    """Coherence of every two envelopes.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period, each of norm 1.

    Returns
    -------
    ndarray, shape (n_loops, n_loops)
        ``abs(E E*)``, from 0 to 1 [-].

    Examples
    --------
    >>> wave = np.exp(1j * np.array([[0.0, 0.1, 0.3], [2.0, 2.1, 2.3], [0.0, 2.1, 4.2]])) / np.sqrt(3.0)
    >>> coherence_matrix(wave)[0].round(1).tolist()
    [1.0, 1.0, 0.1]
    """
    return np.abs(envelopes @ envelopes.conj().T)


def coherence_floor(envelopes: NDArray, rng: np.random.Generator, *, quantile: float = 0.95) -> float:
    """Coherence that envelopes reach when they are shifted circularly against each other.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period, each of norm 1.
    rng : numpy.random.Generator
        Where pairs and shifts are drawn from.
    quantile : float
        Quantile of the shifted coherences that is the floor [-].

    Returns
    -------
    float
        The floor [-]: the quantile of the shifted coherences, limited to 0.9, but not below the one of independent
        noise, P(C > x) = (1 - x^2)^(K - 1) with K independent windows.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noise = rng.normal(size=(10, 100)) + 1j * rng.normal(size=(10, 100))
    >>> noise /= np.linalg.norm(noise, axis=1, keepdims=True)
    >>> 0.1 < coherence_floor(noise, rng) < 0.25
    True
    """
    n, windows = envelopes.shape
    count = max(MIN_SHIFTS, round(10.0 / (1.0 - quantile)))
    a, b = rng.integers(0, n, (2, count))
    shift = rng.integers(2, windows - 1, count)
    shifted = np.concatenate(
        [
            _shifted_coherence(envelopes, *(x[first : first + PAIRS_AT_ONCE] for x in (a, b, shift)))
            for first in range(0, count, PAIRS_AT_ONCE)
        ]
    )
    noise = chance_level(INDEPENDENT_SHARE * windows, quantile)
    return max(noise, min(MAX_FLOOR, float(np.quantile(shifted, quantile))))


def chance_level(independent: float, quantile: float) -> float:
    """Coherence that independent noise exceeds with the probability 1 - `quantile`.

    Parameters
    ----------
    independent : float
        Independent values of each signal [-].
    quantile : float
        Quantile of the coherence [-].

    Returns
    -------
    float
        The coherence [-], from P(C > x) = (1 - x^2)^(K - 1).

    Examples
    --------
    >>> round(chance_level(20.0, 0.95), 2), round(chance_level(80.0, 0.95), 2)
    (0.38, 0.19)
    """
    return float(np.sqrt(1.0 - (1.0 - quantile) ** (1.0 / (max(1.5, independent) - 1.0))))


def changes_of(envelopes: NDArray) -> NDArray:
    """Changes of envelopes from window to window: what two steady waves of one period do not share.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period.

    Returns
    -------
    ndarray of complex, shape (n_loops, n_windows - 1)
        ``E[k + 1] conj(E[k])`` less its mean, each of norm 1; zeros where nothing changes.

    Examples
    --------
    >>> steady = np.exp(1j * np.array([[0.0, 0.5, 1.0, 1.5], [0.0, 0.5, 0.4, 1.0]]))
    >>> np.abs(changes_of(steady)).max(axis=1).round(1).tolist()
    [0.0, 0.8]
    """
    change = envelopes[:, 1:] * envelopes[:, :-1].conj()
    scale = np.linalg.norm(change, axis=1, keepdims=True)
    change = change - change.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(change, axis=1, keepdims=True)
    return np.divide(change, norm, out=np.zeros_like(change), where=norm > 1e-9 * scale)


def related_loops(changes: NDArray, quantile: float, linked: NDArray[np.bool_] | None = None) -> list[NDArray[np.intp]]:
    """Sets of loops whose oscillations change together.

    Parameters
    ----------
    changes : ndarray of complex, shape (n_loops, n_changes)
        What `changes_of` gives.
    quantile : float
        Quantile of the coherence of independent changes that a loop must exceed [-].
    linked : ndarray of bool, shape (n_loops, n_loops), optional
        Pairs that a known connection links; they need not change together.

    Returns
    -------
    list of ndarray
        Indices of each set of two or more loops, the largest first. The changes of each loop cohere with the common
        changes of the others of its set by more than chance, or a connection links the loop to one of them.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> common, *own = rng.normal(size=(4, 60))
    >>> waves = np.cumsum([common, common + 0.2 * own[0], own[1], own[2]], axis=1)
    >>> [each.tolist() for each in related_loops(changes_of(np.exp(0.2j * waves)), 0.99)]
    [[0, 1]]
    """
    matrix = changes @ changes.conj().T
    floor = chance_level(INDEPENDENT_CHANGES * changes.shape[1], quantile)
    left, found = np.arange(len(changes)), []
    while left.size > 1:
        chosen = left
        while chosen.size > 1:
            others = _coherence_with_others(matrix[np.ix_(chosen, chosen)])
            if linked is not None:
                others[linked[np.ix_(chosen, chosen)].any(axis=1)] = 1.0
            if others.min() >= floor:
                break
            chosen = np.delete(chosen, others.argmin())
        if chosen.size < 2:
            break
        found.append(chosen)
        left = np.setdiff1d(left, chosen)
    return sorted(found, key=lambda each: -each.size)


def _coherence_with_others(matrix: NDArray) -> NDArray[np.float64]:
    """Coherence of each loop with the common changes of the others, from the coherences of the pairs."""
    weights = np.linalg.eigh(matrix)[1][:, -1]
    along = matrix @ weights
    with_others = np.abs(along - np.diag(matrix) * weights)
    power = np.real(weights.conj() @ along) - 2.0 * np.real(weights.conj() * along) + np.abs(weights) ** 2
    norm = np.sqrt(np.maximum(power, 0.0))
    return np.divide(with_others, norm, out=np.zeros_like(norm), where=norm > 1e-9)


def _shifted_coherence(
    envelopes: NDArray, a: NDArray[np.int64], b: NDArray[np.int64], shift: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Coherence of the envelopes `a` with the envelopes `b` shifted circularly, shape (n_pairs,)."""
    windows = envelopes.shape[1]
    index = (np.arange(windows) + shift[:, None]) % windows
    return np.abs(np.einsum("ij,ij->i", envelopes[a], np.take_along_axis(envelopes[b], index, axis=1).conj()))


def common_envelope(envelopes: NDArray) -> NDArray:
    """Find the common oscillation of some loops: the first principal component of their envelopes.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period, each of norm 1.

    Returns
    -------
    ndarray of complex, shape (n_windows,)
        The common envelope, of norm 1.

    Examples
    --------
    >>> wave = np.exp(1j * np.array([[0.0, 0.1, 0.3], [2.0, 2.1, 2.3]])) / np.sqrt(3.0)
    >>> abs(wave @ common_envelope(wave).conj()).round(2).tolist()
    [1.0, 1.0]
    """
    return np.linalg.svd(envelopes, full_matrices=False)[2][0]


def link_coherent(coherence: NDArray[np.float64], floor: float) -> list[NDArray[np.intp]]:
    """Find clusters of two or more loops by average linkage.

    Parameters
    ----------
    coherence : ndarray, shape (n_loops, n_loops)
        Coherence of every two loops [-].
    floor : float
        Mean coherence at which two clusters are still joined [-].

    Returns
    -------
    list of ndarray
        Indices of the loops of each cluster.

    Examples
    --------
    >>> coherence = np.array([[1.0, 0.9, 0.1], [0.9, 1.0, 0.2], [0.1, 0.2, 1.0]])
    >>> [cluster.tolist() for cluster in link_coherent(coherence, 0.6)]
    [[0, 1]]
    """
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    distance = np.clip(1.0 - coherence, 0.0, 1.0)
    np.fill_diagonal(distance, 0.0)
    labels = fcluster(linkage(squareform(distance, checks=False), "average"), 1.0 - floor, "distance")
    clusters = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    return [cluster for cluster in clusters if cluster.size > 1]

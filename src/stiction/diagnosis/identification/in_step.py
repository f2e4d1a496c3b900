"""Whether OP and PV were stored in step: a PV some samples older than the OP beside it hides a sticky valve.

OP holds what the controller made of a noise that PV does not show yet, so that a good valve predicts the PV. The law
of the controller tells: it leaves far less of OP's moves with each PV taken as many samples later.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.controller_forms import FLOOR, energy_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["MOST_LATE", "late_said", "samples_late", "with_pv_earlier"]

MOST_LATE = 5
"""Most samples that PV is seen to be late [-]."""
LATE, CLEAR = 0.3, 0.8
"""What the law leaves with PV later, over what every form leaves with PV as stored, and over what the law leaves with
PV later or earlier than that, below which PV was stored late [-]. Chosen on 2 401 loops (`simulation.population`, seeds
9501 and 9601, and its plants of 9711), none of which is called late. Nor is one of 969 others of every cause (seeds
9801 to 9803); with PV stored 1 to 5 samples late 748, 759, 765, 768 and 768 get that number, 0, 1, 1, 1 and 0 another.
Of 33 recorded loops none is called late, and 19 to 24 get that number."""
STANDARD_ERRORS = 4.0
"""Standard errors by which Ki must be seen to have the sign of Kc [-]: where OP makes the PV at once, noise
alone gives it that sign in every other loop."""
FEWEST_ROWS = 30
"""Moves of OP below which nothing is said."""


def samples_late(
    op: NDArray[np.float64],
    sp: NDArray[np.float64],
    pv: NDArray[np.float64],
    valid: NDArray[np.bool_],
    left: float,
) -> int:
    r"""How many samples late PV was stored, by the law of the controller.

    .. math:: \Delta u_i = b\,\Delta r_i - K_c\,\Delta y_{i+k} + K_i\,\Delta t\,(r_i - y_{i+k}) + d

    Parameters
    ----------
    op, sp, pv : ndarray, shape (n_samples,)
        Signals without NaN [% of span], [PV units], [PV units].
    valid : ndarray of bool, shape (n_samples,)
        Samples that may be used.
    left : float
        Share of OP's moves that no form of controller explains with PV as stored [-].

    Returns
    -------
    int
        The k from 1 to `MOST_LATE` that leaves clearly least, Kc and Ki of one sign; 0 where there is none.

    Notes
    -----
    Derived: a controller knows no PV that is yet to come. A derivative part is left out: with one, a PV taken a sample
    too late tells as much. Where OP makes the PV at once, a later PV tells the moves too, with a Kc of the wrong sign.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> sp, valid = np.full(2000, 10.0), np.ones(2000, dtype=bool)
    >>> samples_late(run.op, sp, np.roll(run.pv, 3), valid, left=0.9), samples_late(run.op, sp, run.pv, valid, left=0.0)
    (3, 0)
    """
    lags = range(MOST_LATE + 2)  # one more, which a count must leave less than
    i = np.arange(1, op.size - lags[-1])
    i = i[np.all([valid[i + lag] for lag in (-1, *lags)], axis=0)]
    if i.size < FEWEST_ROWS:
        return 0
    y = op[i] - op[i - 1]
    y -= y.mean()
    energy = energy_of(y)
    if energy == 0.0:
        return 0
    products, with_y = np.empty((len(lags), 3, 3)), np.empty((len(lags), 3))
    for lag in lags:
        later = pv[i + lag]
        columns = np.stack([pv[i + lag - 1] - later, sp[i] - later, sp[i] - sp[i - 1]])
        columns -= columns.mean(axis=1, keepdims=True)
        columns /= np.maximum(np.sqrt(np.einsum("ij,ij->i", columns, columns)), 1e-300)[:, None]
        products[lag] = np.einsum("ik,jk->ij", columns, columns)
        with_y[lag] = np.einsum("ik,k->i", columns, y)
    inverse = np.linalg.pinv(products, rcond=1e-13, hermitian=True)
    weights = np.einsum("kij,kj->ki", inverse, with_y)
    leaves = np.maximum(1.0 - np.einsum("ki,ki->k", weights, with_y) / energy, FLOOR)
    least = int(np.argmin(leaves))
    clear = leaves[least] < min(LATE * left, CLEAR * float(np.delete(leaves, least).min()))
    of_pv, integral, _ = weights[least]
    error = math.sqrt(inverse[least, 1, 1] * leaves[least] * energy / i.size)
    integrates = float(np.sign(of_pv)) * integral > STANDARD_ERRORS * error
    return least if least <= MOST_LATE and clear and integrates else 0


def late_said(samples: int) -> str:
    """What is told of a record in which PV was stored late.

    Parameters
    ----------
    samples : int
        Samples that PV was stored late [-].

    Returns
    -------
    str
        A sentence; empty where it was stored in step.

    Examples
    --------
    >>> late_said(2), late_said(0)
    ('PV was stored 2 samples late, and is taken as much earlier.', '')
    """
    how_much = "a sample" if samples == 1 else f"{samples} samples"
    return f"PV was stored {how_much} late, and is taken as much earlier." if samples else ""


def with_pv_earlier(record: LoopRecord, samples: int) -> LoopRecord:
    """The record with each PV taken some samples earlier, and so as many samples shorter.

    Parameters
    ----------
    record : LoopRecord
        A record with PV, longer than that.
    samples : int
        Samples that PV was stored late [-].

    Returns
    -------
    LoopRecord
        OP, and PV as it was so many samples later.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 1.0, op=[50.0, 51.0, 52.0, 53.0], pv=[3.0, 4.0, 5.0, 6.0])
    >>> earlier = with_pv_earlier(record, 2)
    >>> earlier.op.tolist(), earlier.pv.tolist()
    ([50.0, 51.0], [5.0, 6.0])
    """
    assert record.pv is not None
    return replace(record, pv=np.roll(record.pv, -samples)).window(0, len(record) - samples)

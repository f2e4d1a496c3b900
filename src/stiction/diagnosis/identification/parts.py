"""Parts of what is predicted: a stretch of the record, or fewer weights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["lean", "part_of"]

LEAN_ORDER, LEAN_LONGEST = 6, 20
"""Lags of the PV, and longest lag of the stem [samples], in short windows."""


def part_of(prediction: Prediction, first: int, size: int, begin: int = 0) -> Prediction:
    """Part of a record.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    first, size : int
        Where the part begins and how long it is [samples].
    begin : int
        First sample of it that is predicted, or where the lags allow.

    Returns
    -------
    Prediction
        The same of the part.
    """
    width, begin = prediction.width, max(begin, int(prediction.edges[-1]), prediction.order + 1)
    shocks = prediction.shocks - first
    return prediction._replace(
        op=np.ascontiguousarray(prediction.op[first * width : (first + size) * width]),
        pv=np.ascontiguousarray(prediction.pv[first : first + size]),
        op_mean=np.ascontiguousarray(prediction.op_mean[first : first + size]),
        begin=begin,
        shocks=shocks[(shocks >= begin) & (shocks < size)],
    )


def lean(prediction: Prediction) -> Prediction:
    """Fewer weights, for short windows: a third of the time, and less to fit to a few slips.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.

    Returns
    -------
    Prediction
        The same from `LEAN_ORDER` lags of the PV, none of OP, and `LEAN_LONGEST` of the stem at most.
    """
    edges = prediction.edges[prediction.edges <= LEAN_LONGEST + 1]
    return prediction._replace(edges=edges, most=LEAN_ORDER, most_op=0)

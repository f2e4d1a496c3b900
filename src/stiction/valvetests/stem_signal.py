"""Choice of the signal that shows the stem, and check that enough of it was recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, RecordError, Setting, require_not_negative
from stiction.valvetests.feedback_check import FEEDBACK_CORRELATION, noise_correlation
from stiction.valvetests.segmentation import noise_std, quantisation_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records import LoopRecord

__all__ = ["StemSignal", "no_response_text", "read_stem", "reject_feedback"]

MAX_MISSING_SHARE = 0.2
"""Largest share of missing samples in a test [-]."""
MAX_ROUNDING_STEP = 0.3
"""Steps above this are moves, not rounding [% of span]."""


@dataclass(frozen=True, slots=True)
class StemSignal:
    """OP and the signal that shows the stem, without missing samples."""

    signal: str
    """`mv` or `pv`."""
    time: NDArray[np.float64]
    """Times [s], shape (n_valid,)."""
    op: NDArray[np.float64]
    """OP after the known lag [% of span], shape (n_valid,)."""
    stem: NDArray[np.float64]
    """Valve position [% of span] or flow [engineering units], shape (n_valid,)."""
    op_sigma: float
    """Noise and rounding of the OP [% of span]."""
    op_step: float
    """Rounding of the OP [% of span]."""
    reaction: float
    """Correlation of the noise of OP with that of PV [-]; NaN when unknown."""


def read_stem(record: LoopRecord, signal: str | None, lag: float) -> StemSignal:
    """Choose `mv`, else `pv`; drop missing samples; pass the OP through the known `lag` [s].

    Raises RecordError when the signal was not recorded, too much of it is missing, or OP is not in % of span. Raises
    ParameterError when `signal` is neither "mv" nor "pv", or `lag` is negative.
    """
    lag = require_not_negative("lag", lag, "s")
    if signal not in (None, "mv", "pv"):
        raise ParameterError(f"signal = {signal!r} is unknown; use 'mv' (valve position) or 'pv' (flow).")
    name = signal or ("mv" if record.mv is not None else "pv")
    stem = record.mv if name == "mv" else record.pv
    if stem is None:
        raise RecordError(
            f"{record.tag} has no {name}; a valve test needs OP, and the valve position (mv) or a flow (pv)."
        )
    if len(record) < 30:
        raise RecordError(f"{record.tag} has {len(record)} samples; a valve test needs 30 or more.")
    if not record.op_in_percent:
        raise RecordError(
            f"The OP of {record.tag} is not in % of span, which a valve test needs",
            remedy=("give ", Setting("op_range"), " to convert it"),
        )
    op = record.op
    for label, values in (("OP", op), (name.upper(), stem)):
        missing = float(np.mean(~np.isfinite(values)))
        if missing > MAX_MISSING_SHARE:
            other = ("; use ", Setting("signal", "pv"), " if a flow was recorded") if label == "MV" else ()
            raise RecordError(
                f"{100.0 * missing:.0f} % of {label} of {record.tag} is missing; a valve test needs at least "
                f"{100.0 * (1 - MAX_MISSING_SHARE):.0f} %",
                *other,
                ", or use only the part of the record that is complete.",
            )
    valid = np.isfinite(op) & np.isfinite(stem)
    time = record.time[valid]
    rounding = quantisation_step(op[valid], MAX_ROUNDING_STEP)
    if lag > 0.0:
        op = np.interp(record.time, time, op[valid])
        op = _apply_lag(op, lag, record.dt)
    op_sigma = max(noise_std(op[valid]), rounding, 1e-3)
    return StemSignal(name, time, op[valid], stem[valid], op_sigma, rounding, noise_correlation(record))


def reject_feedback(reading: StemSignal, tag: str, needs: tuple[str | Setting, ...]) -> None:
    """Refuse an OP that reacts to PV, and say what the test `needs`.

    Raises RecordError when the noise of PV is in the OP.
    """
    if abs(reading.reaction) > FEEDBACK_CORRELATION:
        raise RecordError(
            f"The OP of {tag} reacts to PV (correlation of their noise {reading.reaction:.2f}, limit +/-"
            f"{FEEDBACK_CORRELATION:g}): the loop is in automatic; ",
            *needs,
            " For a record of normal operation use diagnose.",
        )


def no_response_text(travel: float) -> str:
    """Message for a flow that does not react to OP over `travel` [% of span]."""
    return (
        f"The flow did not react to {travel:.3g} % of OP travel: the stem is stuck, the valve is isolated, or the "
        "transmitter is frozen or measures something else. Look at the stem."
    )


def _apply_lag(op: NDArray[np.float64], lag: float, dt: float) -> NDArray[np.float64]:
    """Return the OP after a first-order lag, started at rest and exact for an input that ramps between samples."""
    a = float(np.exp(-dt / lag))
    new = 1.0 - lag / dt * (1.0 - a)
    old = 1.0 - a - new
    out = np.empty_like(op)
    out[0] = op[0]
    for k in range(1, op.size):
        out[k] = a * out[k - 1] + new * op[k] + old * op[k - 1]
    return out

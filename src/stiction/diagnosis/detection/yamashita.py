"""Yamashita 2006: does OP move while the flow stands still? (`yamashita2006`).

Each step of OP and of the flow is increasing (I), decreasing (D) or steady (S), which makes nine pairs, OP first.
rho_1 is the share of the pairs IS and DS among all but SS; rho_3 leaves out those whose next pair cannot follow when
the valve sticks (the valve must slip the way OP went). Stiction from 0.25 (after `yamashita2006`). Derived here:
for independent, equally likely symbols rho_1 is 2/8 = 0.25, so that the limit is chance level.

A step counts as steady below 0.43 of its deviation, which makes the three symbols equally likely for noise; samples
are averaged as long as 20 or more are left of a period, or noise between samples would be all there is to see. So 20 to
40 are left: the fewer, the less noise hides, and the result can depend on the sampling rate. Where PV
stands for the valve and falls as OP rises, which the controller's integral part betrays, its symbols are turned round.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import action, coarse, judge, objections, swing, with_position
from stiction.diagnosis.oscillation.signals import filled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["still_shares", "symbols", "yamashita"]

TERCILE = 0.4307
# What cannot follow OP up (or down) with the flow still; a pair is 3 * op + flow with I, S, D = 1, 0, -1.
AFTER_IS = (-4, -2, -1, -3, 2)  # DD, DI, SD, DS, ID
AFTER_DS = (-2, 1, 2, 4, 3)  # DI, SI, ID, II, IS


def yamashita(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Count the steps in which OP moves and the flow does not (`yamashita2006`).

    `record`: OP and, in this order, the measured valve position or PV; valid for flow and pressure loops. If the
    position has gaps, its longest segment is used. `oscillation`: what `find_oscillation` says of the record; sets how
    far samples are averaged. `index` is rho_3 [-].
    """
    record, lack = with_position(record)
    op, moved = filled(record.op), filled(record.mv if record.mv is not None else record.pv)
    rho_1 = rho_3 = float("nan")
    if op is not None and moved is not None:
        by_op, by_valve = (symbols(coarse(record, oscillation, x, 20)) for x in (op, moved))
        about, error = swing(record, oscillation, "op"), swing(record, oscillation, "error")
        if record.mv is None and about is not None and error is not None and action(about, error) < 0.0:
            by_valve = -by_valve
        rho_1, rho_3 = still_shares(by_op, by_valve)
    name = "valve position" if record.mv is not None else "PV"
    why = (
        f"In {100.0 * rho_1:.0f} % of the steps OP moves while the {name} stays; without steps that do not fit a "
        f"sticky valve, in {100.0 * rho_3:.0f} %. Unrelated signals give 25 % and 11 %. In a slow loop PV does not "
        "show the valve."
    )
    against = objections(record, oscillation, loop_types=() if record.mv is not None else ("flow", "pressure"))
    return judge("yamashita", rho_3, 0.25, 0.25, why, [*against, *lack], source="yamashita2006")


def symbols(x: NDArray[np.float64]) -> NDArray[np.intp]:
    """Name the steps of a signal 1 (increasing), 0 (steady) or -1 (decreasing), shape (n_samples - 1,)."""
    step = np.diff(x)
    if not step.size:
        return np.zeros(0, dtype=np.intp)
    limit = TERCILE * float(step.std())
    return (step > limit).astype(np.intp) - (step < -limit)


def still_shares(op: NDArray[np.intp], moved: NDArray[np.intp]) -> tuple[float, float]:
    """Shares rho_1 and rho_3 of two series of symbols.

    `op`, `moved`, of shape (n_steps,): symbols of OP and of the valve position or flow. Returns `rho_1`, `rho_3`: both
    [-]; NaN where nothing ever moves.

    Examples
    --------
    >>> import numpy as np
    >>> still_shares(np.array([1, 1, 1, 1]), np.array([0, 0, 0, 1]))
    (0.75, 0.75)
    """
    pairs = 3 * op + moved
    counted = int(np.count_nonzero(pairs))
    if not counted:
        return float("nan"), float("nan")
    still = int(np.count_nonzero((moved == 0) & (op != 0)))
    now, following = pairs[:-1], pairs[1:]
    impossible = int(np.count_nonzero((now == 3) & np.isin(following, AFTER_IS)))
    impossible += int(np.count_nonzero((now == -3) & np.isin(following, AFTER_DS)))
    return still / counted, (still - impossible) / counted

"""What all methods share: the signal cut into half periods, the conditions they name, the row they write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation import half_cycles
from stiction.diagnosis.oscillation.signals import about_drift, control_error, filled, smooth
from stiction.diagnosis.result import Evidence
from stiction.records.gaps import fill_short_gaps
from stiction.records.runs import runs

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from stiction.diagnosis.result import Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["action", "blocks", "coarse", "half_periods", "judge", "objections", "swing", "with_position"]

FEWEST_CYCLES = 4.0
FEWEST_SAMPLES = 8.0


def swing(record: LoopRecord, oscillation: Oscillation, name: str) -> NDArray[np.float64] | None:
    """Take the signal "op", "mv" or "error" about its drift, shape (n_samples,); None when missing or flat."""
    x = control_error(record) if name == "error" else filled(getattr(record, name))
    if x is None:
        return None
    if not oscillation.period > 0.0:
        return x - x.mean()
    return about_drift(x, oscillation.period / record.dt)


def half_periods(
    record: LoopRecord, oscillation: Oscillation, name: str
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Smooth the signal about its drift over a sixteenth of a period, and cut it into half periods, shape (n, 2)."""
    x = swing(record, oscillation, name)
    if x is None or not oscillation.period > 0.0:
        return np.zeros(1), np.empty((0, 2), dtype=np.intp)
    period = oscillation.period / record.dt
    return smooth(x, period / 16.0), half_cycles(x, period)


def action(op: NDArray[np.float64], error: NDArray[np.float64]) -> float:
    """Say which way the loop acts: 1 where PV rises with OP, -1 where it falls.

    A stable loop's gain has the sign of the controller's, and a PID controller moves OP by Kc times the error's step,
    Kc dt / Ti times the error between two samples and Kc Td / dt times the change of the step. Least squares of OP's
    steps on all three gives the sign of the second.

    Parameters
    ----------
    op, error : ndarray, shape (n_samples,)
        OP and SP - PV about their drift.

    Returns
    -------
    float

    Examples
    --------
    >>> import numpy as np
    >>> error = np.sin(np.arange(100) / 5) + np.cos(np.arange(100) / 3)
    >>> action(2.0 * error + np.cumsum(error) / 10, error), action(-2.0 * error - np.cumsum(error) / 10, error)
    (1.0, -1.0)
    """
    step = np.diff(error)
    columns = [x / max(float(x.std()), 1e-300) for x in (error[2:] + error[1:-1], step[1:], np.diff(step))]
    moves = np.diff(op)[1:]
    products = [[np.einsum("i,i->", x, y) for y in (*columns, moves)] for x in columns]
    integral = (np.linalg.pinv(np.array(products)[:, :3], hermitian=True) @ np.array(products)[:, 3])[0]
    return -1.0 if integral < 0.0 else 1.0


def coarse(
    record: LoopRecord, oscillation: Oscillation, x: NDArray[np.float64], per_period: int
) -> NDArray[np.float64]:
    """Means of blocks of samples, `per_period` to a period or up to twice as many: sampling suited to the wave."""
    return blocks(x, max(1, int(oscillation.period / record.dt / per_period)) if oscillation.period > 0.0 else 1)


def blocks(x: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Means of blocks of `width` samples, shape (n_samples // width,)."""
    n = x.shape[0] // width
    return np.einsum("ij->i", x[: n * width].reshape(n, width)) / width if width > 1 else x


def objections(
    record: LoopRecord,
    oscillation: Oscillation,
    *,
    integrating: bool | None = None,
    loop_types: tuple[str, ...] = (),
    cycles: float = FEWEST_CYCLES,
) -> list[str]:
    """Why a method's condition is not met, a clause each; empty when it is.

    Parameters
    ----------
    record, oscillation
        The loop and what was found of its oscillation.
    integrating : bool, optional
        Process the method is made for; None when it takes both.
    loop_types : tuple of str
        Loop types the method is made for; empty when it takes all.
    cycles : float
        Periods needed [-]; 0 for a method that needs no oscillation.

    Returns
    -------
    list of str
    """
    found: list[str] = []
    if cycles > 0.0:
        if not oscillation.oscillating:
            found.append("no oscillation was found")
        elif oscillation.cycles < cycles:
            found.append(f"the record has {oscillation.cycles:.1f} periods, {cycles:.0f} are needed")
        per_period = oscillation.period / record.dt
        if per_period < FEWEST_SAMPLES:
            found.append(f"a period has {per_period:.1f} samples, {FEWEST_SAMPLES:.0f} are needed")
    if loop_types and record.loop_type not in loop_types:
        found.append(f"the method is for {' and '.join(loop_types)} loops, the type of this loop is {record.loop_type}")
    elif integrating is not None and record.integrating is not integrating:
        made = "an integrating" if integrating else "a self-regulating"
        other = "of unknown type" if record.integrating is None else "not of this type"
        found.append(f"the method is for {made} process, this process is {other}")
    return found


def with_position(record: LoopRecord) -> tuple[LoopRecord, list[str]]:
    """Cut the longest stretch in which the valve position was recorded: a held one would pass for a valve that sticks.

    Returns `record`: the stretch, with no gap of the position above `records.gaps.MAX_FILLED_GAP` samples; the record
    itself where it has no position; `lack`: why that is not enough, a clause; empty where the stretch is half of the
    record or more.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord
    >>> op = np.arange(20.0)
    >>> part, lack = with_position(LoopRecord("FIC-101", 1.0, op=op, mv=np.where(op < 8.0, op, np.nan)))
    >>> len(part), lack
    (8, ['the valve position is recorded for at most 8 of 20 samples in a row, half are needed'])
    """
    if record.mv is None:
        return record, []
    first, last = max(runs(np.isfinite(fill_short_gaps(record.mv))), key=lambda run: run[1] - run[0], default=(0, 0))
    n = len(record)
    few = f"the valve position is recorded for at most {last - first} of {n} samples in a row, half are needed"
    return record.window(first, last), [few] if 2 * (last - first) < n else []


def judge(
    method: str, index: float, stiction: float, no_stiction: float, why: str, against: Iterable[str], source: str
) -> Evidence:
    """Write the row: stiction from `stiction` upward, no stiction from `no_stiction` downward, else undecided."""
    against = list(against)
    index = float(index)
    if not np.isfinite(index):
        index, why = (
            float("nan"),
            "The index could not be computed: a signal is missing or flat, or too few periods fit.",
        )
    vote = "stiction" if index >= stiction else "no_stiction" if index <= no_stiction else "undecided"
    text = f"{why} Not valid here: {'; '.join(against)}." if against else why
    return Evidence(method, index, stiction, vote, not against and bool(np.isfinite(index)), text, source)

"""The trial: every remedy on the loop's twin, with the same seeds, and the one to take until the shutdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.cost import checked, cost
from stiction.compensation.recommend import choose_remedy, refusal_reason, repair_not_worthwhile
from stiction.compensation.remedies import FIX, NOTHING, Remedy, remedies_for
from stiction.compensation.repair import stiction_of
from stiction.compensation.result import Behaviour, CompensationTrial, RemedyTrial
from stiction.compensation.retune import retune
from stiction.compensation.trials import Job, programme_for, run, run_all
from stiction.compensation.twin import build_twin, twin_of_loop
from stiction.diagnosis import Diagnosis
from stiction.errors import ParameterError, RecordError, require_count, require_positive
from stiction.limitcycle.predict import UNSTABLE_TEXT, is_unstable
from stiction.models import Loop

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from stiction.compensation.trials import Programme
    from stiction.compensation.twin import Twin
    from stiction.models import PID
    from stiction.records.record import LoopRecord

__all__ = ["compensate"]

ERRORS = ((1.3, 1.3), (0.7, 0.7), (1.3, 0.7), (0.7, 1.3))
"""Factors on S and J by which the identification may be wrong [-]."""
FEW = 4
"""Seeds with which variants are compared, at most [-]."""
_RUNS_AWAY = f"{UNSTABLE_TEXT}: with a good valve, too, it runs away. Turn or lower the gain of the controller first."


def compensate(
    source: Diagnosis | Loop,
    *,
    controller: PID | None = None,
    weights: Mapping[str, float] | None = None,
    seeds: int = 20,
    duration: float | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> CompensationTrial:
    """Try every remedy of a sticky loop on its twin, and say which to take until the shutdown.

    Parameters
    ----------
    source : Diagnosis or Loop
        What `diagnose` found; or a loop with a sticky valve, its parameters given.
    controller : PID, optional
        The loop's controller, where the record does not show it.
    weights : mapping, optional
        Name -> weight of the cost [-]: pv_std, iae, offset, travel, reversals, op_travel, sp_step, load_step, errors;
        names left out keep their default.
    seeds : int
        Runs of each remedy, each with its own noise and load [-].
    duration : float, optional
        Length of the undisturbed part of each run [s]; by default 14 periods of the cycle.
    progress : callable, optional
        Called with the number of jobs done and their total after each.

    Returns
    -------
    CompensationTrial
        The remedies ranked by cost, the recommendation and its risk. Where no advice can be given (no stiction,
        undecided, a twin that does not repeat the record, OP at its limits or not in % of span, no controller found)
        `recommended` is None and `reason` says why.

    Raises
    ------
    ParameterError
        When `source` is neither, a Loop has a `controller` beside it, a weight is unknown or negative, `seeds` is below
        1, `duration` is too short or too long, or the loop's valve has no S and J.

    Notes
    -----
    A remedy is recommended only if it lowers the PV's standard deviation about the set point by 10 % or more (20 % on
    the twin of a record), costs less than doing nothing, and does not raise the deviation by more than 5 % where S and
    J are off by 30 % either way. On the twin of a record only remedies are recommended whose improvement such a twin
    predicts: knocker and constant reinforcement, where they still lower the deviation by 10 % with S and J off; and
    no advice is given where even a good valve would lower it by less than 10 %.
    Fixing the valve is always shown beside it; it is not at hand until the shutdown.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> trial = st.compensate(loop, seeds=4)
    >>> trial["fix the valve"].improvement > 0.5, trial[trial.recommended].improvement > 0.1
    (True, True)
    """
    whole = checked(weights)
    seeds = require_count("seeds", seeds)
    if duration is not None:
        duration = require_positive("duration", duration, "s")
    if isinstance(source, Diagnosis):
        tag, why = source.record.tag, refusal_reason(source) or _not_in_percent(source.record)
        if why:
            return _no_advice(tag, why, whole)
        try:
            twin = build_twin(source, controller)
        except RecordError as error:
            return _no_advice(tag, str(error), whole)
    elif isinstance(source, Loop):
        if controller is not None:
            raise ParameterError("controller is for a Diagnosis, and the Loop has its own; put it into the Loop.")
        tag, (S, J) = "loop", _stiction(source)
        if is_unstable(source):
            return _no_advice(tag, _RUNS_AWAY, whole, S=S, J=J)
        twin = twin_of_loop(source)
    else:
        raise ParameterError(f"source is a {type(source).__name__}; give a Diagnosis or a Loop.")
    S, J = _stiction(twin.loop)
    if not twin.fits:
        return _no_advice(tag, twin.reason, whole, twin, S, J)
    if not twin.simulated.period > 0.0:
        return _no_advice(tag, "The loop does not cycle: there is nothing to compensate.", whole, twin, S, J)
    return _trial(tag, twin, S, J, whole, seeds, duration, progress)


def _trial(
    tag: str, twin: Twin, S: float, J: float, weights: dict[str, float], seeds: int, duration: float | None,
    progress: Callable[[int, int], Any] | None,
) -> CompensationTrial:  # fmt: skip
    plan = programme_for(twin, S, duration)
    retuning = retune(twin.loop, twin.measured.period)
    fixed, variants = remedies_for(S, J, 2.0 * twin.simulated.amplitude_pv / S, twin.dt, twin.loop, retuning)
    few, some = min(FEW, seeds), max(seeds // len(ERRORS), 1)
    picks = [(remedy, Job(remedy, 1.0, 1.0, few)) for options in variants.values() for remedy in options]
    n_remedies = len(fixed) + len(variants)
    done = _counter(progress, len(picks) + n_remedies * (1 + len(ERRORS)))
    compared = dict(
        zip([id(r) for r, _ in picks], run_all(twin, plan, [job for _, job in picks], S, J, done), strict=True)
    )
    nothing = run_all(twin, plan, [Job(fixed[0], 1.0, 1.0, few)], S, J)[0].mean(axis=0)
    remedies = [*fixed, *(_cheapest(options, compared, nothing, weights) for options in variants.values())]
    jobs = [Job(remedy, 1.0, 1.0, seeds) for remedy in remedies]
    jobs += [Job(remedy, *wrong, some) for remedy in remedies for wrong in ERRORS]
    tables = run_all(twin, plan, jobs, S, J, done)
    plain, errors = tables[: len(remedies)], tables[len(remedies) :]
    base = plain[0].mean(axis=0)
    base_errors = errors[: len(ERRORS)]
    trials = []
    for i, remedy in enumerate(remedies):
        row = plain[i].mean(axis=0)
        off = errors[i * len(ERRORS) : (i + 1) * len(ERRORS)]
        with_errors = tuple(float(a[:, 0].mean() / b[:, 0].mean()) for a, b in zip(off, base_errors, strict=True))
        improvements = 1.0 - plain[i][:, 0] / plain[0][:, 0]
        trials.append(
            RemedyTrial(
                remedy, Behaviour(*(float(x) for x in row)), float(1.0 - row[0] / base[0]),
                float(np.percentile(improvements, 5.0)), with_errors, cost(row, base, max(with_errors), weights),
                remedy.name != FIX,
            )
        )  # fmt: skip
    ranked = tuple(sorted(trials, key=lambda one: one.cost))
    found = twin.around is not None
    recommended, reason, risk, expected = choose_remedy(ranked, found=found)
    if found and (none := repair_not_worthwhile(next(one for one in ranked if one.name == FIX))):
        recommended, reason, risk, expected = None, none, "", float("nan")
    shown = {NOTHING, FIX, recommended}
    trends = {one.name: _trend(twin, plan, one.remedy) for one in ranked if one.name in shown}
    return CompensationTrial(
        tag, ranked, recommended, reason, risk, S, J, twin, retuning, weights, seeds, trends, expected
    )


def _cheapest(
    options: tuple[Remedy, ...],
    compared: dict[int, NDArray[np.float64]],
    nothing: NDArray[np.float64],
    weights: dict[str, float],
) -> Remedy:
    def price(remedy: Remedy) -> float:
        row = compared[id(remedy)].mean(axis=0)
        return cost(row, nothing, float(row[0] / nothing[0]), weights)

    return min(options, key=price)


def _trend(twin: Twin, plan: Programme, remedy: Remedy) -> dict[str, NDArray[np.float64]]:
    """The undisturbed part and the steps of the first run."""
    record = run(remedy.apply(twin.loop), plan, 0).window(plan.settle, plan.n)
    signals = {"sp": record.sp, "pv": record.pv, "op": record.op, "mv": record.mv}
    return {"time": record.time, **{name: x for name, x in signals.items() if x is not None}}


def _not_in_percent(record: LoopRecord) -> str:
    """Say that no remedy can be set for an OP in another unit; empty where it is in % of span."""
    if record.op_in_percent:
        return ""
    return (
        "OP is not in % of span, in which its limits and the sizes of pulses and moves are set, so that no remedy can "
        "be tried; give op_range (--op-range) to convert it."
    )


def _stiction(loop: Loop) -> tuple[float, float]:
    """S and J of the loop's valve [% of span]."""
    found = stiction_of(loop.valve)
    if found is None:
        raise ParameterError(
            f"{type(loop.valve).__name__} has no S and J, for which remedies are set; give a valve that sticks: "
            "Stenman, Kano, Choudhury, He, HeWang or Srinivasan."
        )
    return found


def _counter(progress: Callable[[int, int], Any] | None, total: int) -> Callable[[], None]:
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(min(done, total), total)

    return tick


def _no_advice(
    tag: str,
    reason: str,
    weights: dict[str, float],
    twin: Twin | None = None,
    S: float = float("nan"),
    J: float = float("nan"),
) -> CompensationTrial:
    return CompensationTrial(tag, (), None, reason, "", S, J, twin, None, weights)

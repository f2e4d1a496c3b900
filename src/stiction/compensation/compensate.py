"""Try every remedy on the loop's twin with the same seeds, and recommend one until the next shutdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.compensation.cost import check_weights, cost
from stiction.compensation.recommend import (
    MAX_TRAVEL,
    choose_remedy,
    refusal_reason,
    repair_not_worthwhile,
    wears_too_much,
)
from stiction.compensation.remedies import NO_ACTION, REPAIR, Remedy, remedies_for
from stiction.compensation.repair import stiction_of
from stiction.compensation.result import CompensationTrial, LoopPerformance, RemedyTrial
from stiction.compensation.retune import retune
from stiction.compensation.retune_step import retune_step
from stiction.compensation.run_trials import Job, plan_programme, run_jobs, run_programme
from stiction.compensation.twin import build_twin, twin_of_loop
from stiction.diagnosis import Diagnosis
from stiction.errors import ParameterError, RecordError, require_count, require_positive
from stiction.limitcycle.predict import UNSTABLE_TEXT, is_unstable
from stiction.models import Loop

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from stiction.compensation.run_trials import TrialProgramme
    from stiction.compensation.twin import Twin
    from stiction.models import PID
    from stiction.records.record import LoopRecord

__all__ = ["compensate"]

S_J_ERROR_FACTORS = ((1.3, 1.3), (0.7, 0.7), (1.3, 0.7), (0.7, 1.3))
"""Factors on S and on J with which each remedy is tried again, as the identified values may be wrong [-]."""
MAX_COMPARISON_SEEDS = 4
"""Largest number of seeds with which the variants of a remedy are compared [-]."""
_UNSTABLE_REASON = (
    f"{UNSTABLE_TEXT}, even with a good valve. First change the sign of the controller gain, or lower the gain."
)


def compensate(
    source: Diagnosis | Loop,
    *,
    controller: PID | None = None,
    weights: Mapping[str, float] | None = None,
    seeds: int = 20,
    duration: float | None = None,
    max_travel: float = MAX_TRAVEL,
    progress: Callable[[int, int], Any] | None = None,
) -> CompensationTrial:
    """Try every remedy for a sticky valve on a simulated copy of the loop, and recommend one until the next shutdown.

    Parameters
    ----------
    source : Diagnosis or Loop
        The result of `diagnose`, or a loop with a sticky valve.
    controller : PID, optional
        The loop's controller, if it cannot be identified from the record.
    weights : mapping, optional
        Name -> weight of the cost [-]: pv_std, iae, offset, travel, reversals, op_travel, sp_step, load_step, errors;
        other weights keep their default.
    seeds : int
        Runs of each remedy; noise and load differ from run to run [-].
    duration : float, optional
        Length of the undisturbed part of each run [s]; by default 14 periods of the cycle.
    max_travel : float
        Largest stem travel of a recommended remedy over the present one [-].
    progress : callable, optional
        Called after each job with the number of finished jobs and their total.

    Returns
    -------
    CompensationTrial
        The remedies ranked by cost, the recommendation and its risk. `recommended` is None when no advice can be given,
        and `reason` says why: no stiction, undecided, the twin does not oscillate like the record, OP is at its limits
        or not in % of span, or no controller was identified.

    Raises
    ------
    ParameterError
        When `source` is neither, `controller` is given with a Loop, a weight is unknown or negative, `seeds` is below
        1, `duration` is too short or too long, or the loop's valve has no S and J.

    Notes
    -----
    A remedy is recommended only if it lowers the standard deviation of the control error by at least 10 % (20 % on the
    twin of a record), costs less than doing nothing, moves the stem at most `max_travel` times as far as now, and
    raises the deviation by at most 5 % when S and J are wrong by 30 %. On the twin of a record, only the knocker and
    constant reinforcement can be recommended, because a twin predicts the improvement of the other remedies badly; they
    must lower the deviation by 10 % even with wrong S and J. No advice is given if even a good valve would lower the
    deviation by less than 10 %.
    Repair of the valve is always tried too, but it has to wait for the shutdown.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> trial = st.compensate(loop, seeds=4)
    >>> trial["fix the valve"].improvement > 0.5, trial[trial.recommended].improvement > 0.1
    (True, True)
    """
    whole = check_weights(weights)
    seeds = require_count("seeds", seeds)
    max_travel = require_positive("max_travel", max_travel)
    if duration is not None:
        duration = require_positive("duration", duration, "s")
    if isinstance(source, Diagnosis):
        tag, why = source.record.tag, refusal_reason(source) or _reject_op_unit(source.record)
        if why:
            return _no_advice(tag, why, whole)
        try:
            twin = build_twin(source, controller)
        except RecordError as error:
            return _no_advice(tag, error.reason, whole)
    elif isinstance(source, Loop):
        if controller is not None:
            raise ParameterError("controller is only for a Diagnosis: a Loop has its own. Set it in the Loop.")
        tag, (S, J) = "loop", _require_stiction(source)
        if is_unstable(source):
            return _no_advice(tag, _UNSTABLE_REASON, whole, S=S, J=J)
        twin = twin_of_loop(source)
    else:
        raise ParameterError(f"source is a {type(source).__name__}; give a Diagnosis or a Loop.")
    S, J = _require_stiction(twin.loop)
    if not twin.fits:
        return _no_advice(tag, twin.reason, whole, twin, S, J)
    if not twin.simulated.period > 0.0:
        return _no_advice(tag, "The loop does not oscillate, so there is nothing to compensate.", whole, twin, S, J)
    return _run_trial(tag, twin, S, J, whole, seeds, duration, max_travel, progress=progress)


def _run_trial(
    tag: str, twin: Twin, S: float, J: float, weights: dict[str, float], seeds: int, duration: float | None,
    max_travel: float, progress: Callable[[int, int], Any] | None,
) -> CompensationTrial:  # fmt: skip
    plan = plan_programme(twin, S, duration)
    find_setting = retune if twin.inputs is None else retune_step
    retuning = find_setting(twin.loop, twin.measured.period)
    fixed, variants = remedies_for(S, J, 2.0 * twin.simulated.amplitude_pv / S, twin.dt, twin.loop, retuning)
    few, some = min(MAX_COMPARISON_SEEDS, seeds), max(seeds // len(S_J_ERROR_FACTORS), 1)
    picks = [(remedy, Job(remedy, 1.0, 1.0, few)) for options in variants.values() for remedy in options]
    n_remedies = len(fixed) + len(variants)
    done = _progress_counter(progress, len(picks) + n_remedies * (1 + len(S_J_ERROR_FACTORS)))
    compared = dict(
        zip([id(r) for r, _ in picks], run_jobs(twin, plan, [job for _, job in picks], S, J, done), strict=True)
    )
    nothing = run_jobs(twin, plan, [Job(fixed[0], 1.0, 1.0, few)], S, J)[0].mean(axis=0)
    best = [_cheapest_variant(options, compared, nothing, weights, max_travel) for options in variants.values()]
    remedies = [*fixed, *best]
    jobs = [Job(remedy, 1.0, 1.0, seeds) for remedy in remedies]
    jobs += [Job(remedy, *wrong, some) for remedy in remedies for wrong in S_J_ERROR_FACTORS]
    tables = run_jobs(twin, plan, jobs, S, J, done)
    plain, errors = tables[: len(remedies)], tables[len(remedies) :]
    base = plain[0].mean(axis=0)
    base_errors = errors[: len(S_J_ERROR_FACTORS)]
    trials = []
    for i, remedy in enumerate(remedies):
        row = plain[i].mean(axis=0)
        off = errors[i * len(S_J_ERROR_FACTORS) : (i + 1) * len(S_J_ERROR_FACTORS)]
        with_errors = tuple(float(a[:, 0].mean() / b[:, 0].mean()) for a, b in zip(off, base_errors, strict=True))
        improvements = 1.0 - plain[i][:, 0] / plain[0][:, 0]
        trials.append(
            RemedyTrial(
                remedy, LoopPerformance(*(float(x) for x in row)), float(1.0 - row[0] / base[0]),
                float(np.percentile(improvements, 5.0)), with_errors, cost(row, base, max(with_errors), weights),
                remedy.name != REPAIR,
            )
        )  # fmt: skip
    ranked = tuple(sorted(trials, key=lambda one: one.cost))
    found = twin.inputs is not None
    recommended, reason, risk, expected = choose_remedy(ranked, from_record=found, max_travel=max_travel)
    if found and (none := repair_not_worthwhile(next(one for one in ranked if one.name == REPAIR))):
        recommended, reason, risk, expected = None, none, "", float("nan")
    shown = {NO_ACTION, REPAIR, recommended}
    trends = {one.name: _first_run(twin, plan, one.remedy) for one in ranked if one.name in shown}
    return CompensationTrial(
        tag, ranked, recommended, reason, risk, S, J=J, twin=twin, retuning=retuning, weights=weights, seeds=seeds,
        trends=trends, expected=expected, max_travel=max_travel,
    )  # fmt: skip


def _cheapest_variant(
    options: tuple[Remedy, ...],
    compared: dict[int, NDArray[np.float64]],
    nothing: NDArray[np.float64],
    weights: dict[str, float],
    max_travel: float,
) -> Remedy:
    """Return the cheapest variant; one that moves the stem too far only where all do."""
    now = LoopPerformance(*nothing)

    def cost_of(remedy: Remedy) -> tuple[bool, float]:
        row = compared[id(remedy)].mean(axis=0)
        wears = wears_too_much(LoopPerformance(*row), now, max_travel=max_travel)
        return wears, cost(row, nothing, float(row[0] / nothing[0]), weights)

    return min(options, key=cost_of)


def _first_run(twin: Twin, plan: TrialProgramme, remedy: Remedy) -> dict[str, NDArray[np.float64]]:
    """Return the signals of the first run without its settling time."""
    record = run_programme(remedy.apply(twin.loop), plan, 0).window(plan.settle, plan.n)
    signals = {"sp": record.sp, "pv": record.pv, "op": record.op, "mv": record.mv}
    return {"time": record.time, **{name: x for name, x in signals.items() if x is not None}}


def _reject_op_unit(record: LoopRecord) -> str:
    """Say why no remedy can be tried when OP is in another unit; empty when OP is in % of span."""
    if record.op_in_percent:
        return ""
    return (
        "No remedy can be tried, because OP is not in % of span, which the remedies need; give the range of OP "
        "(op_range) "
        "to convert it."
    )


def _require_stiction(loop: Loop) -> tuple[float, float]:
    """Return S and J of the loop's valve [% of span], or refuse a valve without them."""
    found = stiction_of(loop.valve)
    if found is None:
        raise ParameterError(
            f"The valve {type(loop.valve).__name__} has no S and J, and every remedy needs them; give a sticky valve: "
            "Stenman, Kano, Choudhury, He, HeWang or Srinivasan."
        )
    return found


def _progress_counter(progress: Callable[[int, int], Any] | None, total: int) -> Callable[[], None]:
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
    return CompensationTrial(tag, (), None, reason, "", S, J=J, twin=twin, retuning=None, weights=weights)

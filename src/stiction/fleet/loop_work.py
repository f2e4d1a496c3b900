"""What an audit does with one loop: the screen, and the diagnosis. Both give one row."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.fleet.block_means import BlockMeans, Clock, make_block_means
from stiction.fleet.loop_metrics import loop_metrics
from stiction.fleet.loop_oscillations import LoopOscillation, find_loop_oscillations
from stiction.fleet.rank import rank_row
from stiction.fleet.reduced_record import average_blocks, cut_time, reduce_record
from stiction.fleet.source_parts import LoopPlace, read_loop

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from stiction.diagnosis.loop_state import LoopState
    from stiction.records.record import LoopRecord

__all__ = [
    "RESTING_STATES",
    "WorkSettings",
    "diagnose_loop",
    "empty_row",
    "main_oscillation",
    "screen_loop",
    "screen_record",
]

RESTING_STATES = ("manual", "saturated", "pv_frozen", "shut_in", "bad_data")
"""Loop states in which the valve cannot be judged or rests: the loop is not diagnosed."""
MIN_SAMPLES = 100
"""Samples below which a loop is not diagnosed [-]."""
MAX_SCREEN_SAMPLES = 4320
"""Block means of which the loop state is found, at most [-]."""


@dataclass(frozen=True)
class WorkSettings:
    """What the work on each loop depends on."""

    clock: Clock
    """Blocks that all loops share."""
    since: datetime | None = None
    """First time."""
    until: datetime | None = None
    """Time before which the samples end."""
    prior: float = 0.25
    """Share of sticky valves in the plant [-]."""
    costs: tuple[float, float, float] = (1.0, 1.0, 0.2)
    """Costs of a false alarm, a missed sticky valve, and an open question."""
    time_limit: float = 60.0
    """Longest time for one loop [s]."""


@dataclass(frozen=True)
class Screened:
    """What the screen gives of one loop."""

    row: dict[str, Any]
    """The row."""
    means: BlockMeans | None = field(default=None, repr=False)
    """Its block means."""


def empty_row(place: LoopPlace) -> dict[str, Any]:
    """Row of a loop of which nothing is known yet, with all keys."""
    return {
        "tag": place.tag,
        "area": place.area,
        "source": place.part.shown,
        "status": "screened",
        "verdict": "undecided",
        "probability": None,
        "loop_state": None,
        "oscillation_cause": "none",
        "oscillation_causes": None,
        "period_s": None,
        "S": None,
        "S_low": None,
        "S_high": None,
        "J": None,
        "J_low": None,
        "J_high": None,
        "priority": 0.0,
        "severity": 0.0,
        "confidence": 0.0,
        "importance": place.importance,
        "severity_parts": {},
        "reason": "",
        "action": "",
        "oscillating": False,
        "regularity": None,
        "oscillation_index": 0.0,
        "automatic_share": None,
        "manual_share": None,
        "cascade_share": None,
        "saturated_share": None,
        "not_in_command_share": None,
        "missing_share": None,
        "error_mean_absolute": None,
        "variability": None,
        "valve_travel_per_day": None,
        "reversals_per_day": None,
        "loop_type": None,
        "pv_unit": "",
        "dt_s": None,
        "samples": None,
        "start": None,
        "end": None,
        "data_warnings": [],
        "oscillations": [],
        "group": None,
    }


def screen_loop(place: LoopPlace, settings: WorkSettings) -> Screened:
    """Screen one loop: block means, oscillations, loop state, data checks and the numbers of the loop.

    Parameters
    ----------
    place : LoopPlace
        The loop.
    settings : WorkSettings
        Clock and time span.

    Returns
    -------
    Screened
        The row has the status "skipped" where the record cannot be judged or the loop rests, with the reason.

    Raises
    ------
    RecordError
        When the loop cannot be read.
    """
    return screen_record(place, cut_time(read_loop(place), settings.since, settings.until), settings)


def screen_record(place: LoopPlace, record: LoopRecord, settings: WorkSettings) -> Screened:
    """Screen the record of a loop, as `screen_loop` does."""
    from stiction.diagnosis.loop_state import assess_loop_state, describe_action, describe_state

    row = empty_row(place) | _describe_record(record)
    if len(record) < MIN_SAMPLES or record.pv is None:
        what = "no PV" if record.pv is None else f"{len(record)} samples, fewer than {MIN_SAMPLES},"
        row |= {"status": "skipped", "loop_state": "bad_data", "probability": settings.prior}
        row |= {"reason": f"The record has {what} in this time.", "action": "Record PV and OP for longer."}
        return Screened(rank_row(row))
    means = make_block_means(record, settings.clock)
    oscillations = find_loop_oscillations(means)
    main = main_oscillation(oscillations)
    metrics = loop_metrics(record, span=place.span, oscillation_index=main.height if main and main.regular else 0.0)
    state = assess_loop_state(average_blocks(record, -(-len(record) // MAX_SCREEN_SAMPLES)))
    row |= {name: value for name, value in metrics.to_dict().items() if name in row and name != "tag"}
    row |= _state_shares(state, record, bool(place.master))
    row |= {
        "loop_state": state.state,
        "data_warnings": _data_warnings(record),
        "oscillations": [_oscillation_dict(one) for one in oscillations],
    }
    if main is not None and main.regular:
        row |= {"oscillating": True, "period_s": main.period, "regularity": main.regularity}
    if state.state == "in_control" and not _moves(record):
        action = "Check the signals, and record while the controller moves the valve."
        row |= {"status": "skipped", "loop_state": "bad_data", "probability": settings.prior}
        row |= {"reason": "OP or PV is constant over the whole record.", "action": action}
    elif state.state in RESTING_STATES:
        row |= {
            "status": "skipped",
            "probability": settings.prior,
            "reason": describe_state(state, record.start, record.provenance.pv_unit),
            "action": describe_action(state),
        }
    return Screened(rank_row(row), means)


def diagnose_loop(place: LoopPlace, settings: WorkSettings, screened: dict[str, Any]) -> dict[str, Any]:
    """Diagnose one loop on its shortened record.

    Parameters
    ----------
    place : LoopPlace
        The loop.
    settings : WorkSettings
        Time span, prior and costs.
    screened : dict
        Its row of the screen.

    Returns
    -------
    dict
        The row with the verdict.

    Raises
    ------
    RecordError
        When the loop cannot be read.
    """
    return diagnose_record(cut_time(read_loop(place), settings.since, settings.until), settings, screened)


def diagnose_record(record: LoopRecord, settings: WorkSettings, screened: dict[str, Any]) -> dict[str, Any]:
    """Diagnose the record of a loop, as `diagnose_loop` does."""
    from stiction.diagnosis import diagnose
    from stiction.diagnosis.verdict.decision import Costs

    periods = [LoopOscillation(**one) for one in screened["oscillations"]]
    main = main_oscillation(periods)
    shorter = reduce_record(record, main.period if main is not None else float("nan"))
    found = diagnose(shorter, prior=settings.prior, costs=Costs(*settings.costs)).to_dict()
    row = screened | {name: found[name] for name in ("verdict", "probability", "reason", "action")}
    row |= {"status": "diagnosed", "loop_state": found["loop_state"]["state"]}
    causes = found["oscillation_cause"]
    row |= {"oscillation_causes": causes, "oscillation_cause": _main_cause(causes)}
    oscillation = found["oscillation"]
    if oscillation["oscillating"]:
        row |= {"oscillating": True, "period_s": oscillation["period_s"], "regularity": oscillation["regularity"]}
    valve = found["stiction"] or {}
    if row["verdict"] != "no_stiction":
        row |= {name: valve.get(name) for name in ("S", "S_low", "S_high", "J", "J_low", "J_high")}
    return rank_row(row)


def main_oscillation(oscillations: Sequence[LoopOscillation]) -> LoopOscillation | None:
    """The regular oscillation with the highest autocorrelation, else the highest of all; None when there is none."""
    return max(oscillations, key=lambda one: (one.regular, one.height), default=None)


def _moves(record: LoopRecord) -> bool:
    """Whether OP and PV change at all."""
    return all(x is not None and np.isfinite(x).any() and np.nanmax(x) > np.nanmin(x) for x in (record.op, record.pv))


def _describe_record(record: LoopRecord) -> dict[str, Any]:
    from datetime import timedelta

    end = record.start + timedelta(seconds=record.duration) if record.start else None
    return {
        "loop_type": record.loop_type,
        "pv_unit": record.provenance.pv_unit,
        "dt_s": record.dt,
        "samples": len(record),
        "start": record.start and record.start.isoformat(),
        "end": end and end.isoformat(),
    }


def _state_shares(state: LoopState, record: LoopRecord, is_secondary: bool) -> dict[str, Any]:
    """Share of the time in cascade and not in command [-]."""
    whole = max(record.duration, 1e-9)
    lost = sum(one.end_s - one.start_s for one in state.stretches if one.state == "not_in_command") / whole
    cascade = float(record.auto.mean()) if is_secondary and record.auto is not None else None
    return {"not_in_command_share": round(min(1.0, lost), 4), "cascade_share": cascade}


def _data_warnings(record: LoopRecord) -> list[str]:
    """Names of the data checks that fail on the middle of the record, its samples not averaged."""
    from stiction.records.assess import assess_quality

    first = max(0, (len(record) - MAX_SCREEN_SAMPLES) // 2)
    quality = assess_quality(record.window(first, first + MAX_SCREEN_SAMPLES))
    return [check.name for check in (*quality.rejections, *quality.warnings)]


def _oscillation_dict(one: LoopOscillation) -> dict[str, Any]:
    numbers = {name: float(np.round(getattr(one, name), 9)) for name in ("period", "regularity", "height")}
    return {**numbers, "regular": one.regular, "signal": one.signal}


def _main_cause(causes: dict[str, Any]) -> str:
    from stiction.diagnosis.verdict.causes import OscillationCause

    return OscillationCause(**causes).main


def require_row(row: dict[str, Any]) -> dict[str, Any]:
    """Refuse numbers that JSON cannot hold; they are a fault of the program."""
    import json

    try:
        json.dumps(row, allow_nan=False)
    except ValueError:
        raise RecordError(f"{row['tag']}: a result is no finite number; please report it.") from None
    return row

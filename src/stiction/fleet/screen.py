"""The screen of one loop in an audit: cheap, and careful about what it leaves out."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.fleet.block_means import BlockMeans, make_block_means
from stiction.fleet.loop_metrics import loop_metrics
from stiction.fleet.loop_oscillations import LoopOscillation, find_loop_oscillations
from stiction.fleet.loop_row import WorkSettings, empty_row, main_oscillation
from stiction.fleet.rank import rank_row
from stiction.fleet.reduced_record import average_blocks, cut_time
from stiction.fleet.source_parts import LoopPlace, read_loop

if TYPE_CHECKING:
    from stiction.diagnosis.loop_state import LoopState
    from stiction.records.record import LoopRecord

__all__ = ["RESTING_STATES", "Screened", "screen_loop", "screen_record"]

RESTING_STATES = ("manual", "saturated", "pv_frozen", "shut_in", "bad_data")
"""Loop states in which the valve cannot be judged or rests: the loop is not diagnosed."""
MIN_SAMPLES = 100
"""Samples below which a loop is not diagnosed [-]."""
MAX_SCREEN_SAMPLES = 4320
"""Block means of which the loop state is found, at most [-]."""


@dataclass(frozen=True)
class Screened:
    """What the screen gives of one loop."""

    row: dict[str, Any]
    """The row."""
    means: BlockMeans | None = field(default=None, repr=False)
    """Its block means."""


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
    from stiction.sources.signal_values import EmptySignalError

    try:
        record = cut_time(read_loop(place), settings.since, settings.until)
    except EmptySignalError as error:
        return Screened(_skip(empty_row(place), settings, str(error), "Record PV and OP."))
    return screen_record(place, record, settings)


def screen_record(place: LoopPlace, record: LoopRecord, settings: WorkSettings) -> Screened:
    """Screen the record of a loop, as `screen_loop` does."""
    from stiction.diagnosis.loop_state import assess_loop_state, describe_action, describe_state

    row = empty_row(place) | _describe_record(record)
    if (what := _find_lack_of_data(record)) is not None:
        reason = f"The record has {what} in this time."
        return Screened(_skip(row, settings, reason, "Record PV and OP for longer."))
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
        row = _skip(row, settings, "OP or PV is constant over the whole record.", action)
    elif state.state in RESTING_STATES:
        row |= {
            "status": "skipped",
            "probability": settings.prior,
            "reason": describe_state(state, record.start, record.provenance.pv_unit),
            "action": describe_action(state),
        }
    return Screened(rank_row(row), means)


def _skip(row: dict[str, Any], settings: WorkSettings, reason: str, action: str) -> dict[str, Any]:
    """Row of a loop whose data cannot be used."""
    about = {"status": "skipped", "loop_state": "bad_data", "probability": settings.prior}
    return rank_row(row | about | {"reason": reason, "action": action})


def _find_lack_of_data(record: LoopRecord) -> str | None:
    """What a record has too little of; None where there is enough."""
    if record.pv is None:
        return "no PV"
    if len(record) < MIN_SAMPLES:
        return f"{len(record)} samples, fewer than {MIN_SAMPLES},"
    for name, x in (("OP", record.op), ("PV", record.pv)):
        if not np.isfinite(x).any():
            return f"no value of {name}"
    return None


def _moves(record: LoopRecord) -> bool:
    """Whether OP and PV change at all."""
    return all(x is not None and np.isfinite(x).any() and np.nanmax(x) > np.nanmin(x) for x in (record.op, record.pv))


def _describe_record(record: LoopRecord) -> dict[str, Any]:
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

"""Sentences about the state of a loop: what was measured, then what to look at."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from stiction.display.duration_format import format_seconds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.loop_state.state import LoopState, StateName

__all__ = ["ACTIONS", "HEADLINES", "describe_action", "describe_state"]

HEADLINES: Mapping[StateName, str] = {
    "in_control": "The loop is in control",
    "manual": "The controller is in manual",
    "saturated": "OP is at its limit",
    "not_in_command": "The controller is not in command",
    "shut_in": "The flow is shut in",
    "valve_not_responding": "The valve does not respond",
    "pv_frozen": "PV is frozen",
    "signals_swapped": "OP and PV look swapped",
    "signals_unrelated": "OP and PV look unrelated",
    "bad_data": "The data cannot be used",
}
"""Each state in a few words."""

ACTIONS: Mapping[StateName, str] = {
    "in_control": "",
    "manual": "Put the controller in automatic and record the loop again.",
    "saturated": "Record a period in which OP moves between its limits; if there is none, check supply, load and set "
    "point.",
    "not_in_command": "Check which controller the override or selector has chosen, that this one has integral "
    "action, then supply and block valves. Diagnose the loop again when it is in command.",
    "shut_in": "Check block valves, pump and line-up, and record the loop again when there is flow.",
    "valve_not_responding": "Check the block valves and whether an override has the valve, then the actuator and "
    "the stem.",
    "pv_frozen": "Check the transmitter and its connection, then record the loop again.",
    "signals_swapped": "Exchange the columns of OP and PV when reading the file, then diagnose again.",
    "signals_unrelated": "Check that OP and PV are tags of one loop, then read the file again with the right columns.",
    "bad_data": "Do as the reason says, and read or record the loop again.",
}
"""What to look at in each state."""


def describe_action(state: LoopState) -> str:
    """Say what to look at, in one imperative sentence; empty in control.

    Examples
    --------
    >>> from stiction.diagnosis.loop_state import LoopState
    >>> describe_action(LoopState("pv_frozen", 0.0, 60.0))
    'Check the transmitter and its connection, then record the loop again.'
    """
    return ACTIONS[state.state]


def describe_state(state: LoopState, start: datetime | None = None, pv_unit: str = "") -> str:
    """Say what was measured, with numbers and times; empty in control.

    `state`: state of the loop. `start`: time of the first sample; without it times count from the first sample. Gives
    one or two sentences.

    Examples
    --------
    >>> from stiction.diagnosis.loop_state import LoopState
    >>> describe_state(LoopState("pv_frozen", 60.0, 600.0, 0.9, {"pv": 148.7, "op_start": 50.0, "op_end": 85.0}))
    'PV is frozen: it stays at 148.7 from 60 s to 10 min, while OP goes from 50 to 85 %.'
    """
    if state.in_control:
        return ""
    if state.state == "bad_data":
        return " ".join(state.rejects) or f"OP or PV is missing in {100.0 * state.share:.0f} % of the record."
    numbers = dict.fromkeys(("op_start", "op_end", "pv", "error"), math.nan) | dict(state.numbers)
    unit = f" {pv_unit}" if pv_unit else ""
    op_unit = "%" if numbers.get("op_in_percent", 1.0) else "OP units"
    begin, end = (_moment(time, start, state.end_s) for time in (state.start_s, state.end_s))
    moved = _moment(state.numbers.get("move_end_s", state.end_s), start, state.end_s)
    offset = f"{abs(numbers['error']):.3g}{unit} {'below' if numbers['error'] > 0.0 else 'above'} SP on average"
    travel = f"from {numbers['op_start']:.3g} to {numbers['op_end']:.3g} {op_unit}"
    longest = f", longest at {numbers['op_end']:.3g} {op_unit}" if math.isfinite(numbers["op_end"]) else ""
    share = f"{100.0 * state.share:.0f} % of the record"
    if state.state == "not_in_command":
        cycle = state.numbers.get("period_s", math.nan)
        how = f" PV oscillates every {format_seconds(cycle)}, whatever OP does." if cycle > 0.0 else ""
        op = f"stayed at {numbers['op_end']:.3g} {op_unit}"
        if abs(numbers["op_end"] - numbers["op_start"]) > 1.0:
            op = f"went {travel} between {begin} and {moved}"
        return f"The controller is not in command: OP {op}, while PV stayed {offset}.{how}"
    return {
        "manual": f"According to its mode, the controller is in manual in {share}, from {begin} to {end}."
        if numbers.get("by_mode")
        else f"OP is constant in {share} while PV moves, as in manual{longest}.",
        "saturated": f"OP stays at its limit in {share}{longest}; the valve does not move there.",
        "shut_in": f"The flow is shut in: it stays at {numbers['pv']:.3g}{unit} from {begin} to {end}, while OP goes "
        f"{travel}.",
        "valve_not_responding": f"The valve does not respond: it is stuck, shut in or not in command. OP went {travel} "
        f"between {begin} and {moved}, and PV stayed {offset}.",
        "pv_frozen": f"PV is frozen: it stays at {numbers['pv']:.4g}{unit} from {begin} to {end}, while OP goes "
        f"{travel}.",
        "signals_swapped": "The OP and PV columns look swapped: a controller equation computes the column named PV "
        "from the column named OP almost exactly.",
        "signals_unrelated": "OP and PV look like signals of different loops: their coherence is "
        f"{state.numbers.get('coherence', 0.0):.2f}, no more than by chance.",
    }[state.state]


def _moment(seconds: float, start: datetime | None, longest: float) -> str:
    """A time of day, with its date in a record of more than a day; else the time since the first sample."""
    if start is None:
        return format_seconds(seconds)
    moment = start + timedelta(seconds=seconds)
    return f"{moment:%H:%M}" if longest < 86_400.0 else f"{moment:%Y-%m-%d %H:%M}"

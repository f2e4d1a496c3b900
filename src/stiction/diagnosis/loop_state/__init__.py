"""State of the loop: whether this controller moves this valve, and the process answers."""

from stiction.diagnosis.loop_state.assess import assess_loop_state
from stiction.diagnosis.loop_state.bad_data import find_bad_data
from stiction.diagnosis.loop_state.describe import HEADLINES, describe_action, describe_state
from stiction.diagnosis.loop_state.manual import find_manual
from stiction.diagnosis.loop_state.not_in_command import find_not_in_command
from stiction.diagnosis.loop_state.pv_frozen import find_pv_frozen
from stiction.diagnosis.loop_state.saturated import find_saturated
from stiction.diagnosis.loop_state.shut_in import find_shut_in
from stiction.diagnosis.loop_state.signals_swapped import are_signals_swapped
from stiction.diagnosis.loop_state.signals_unrelated import find_unrelated_signals
from stiction.diagnosis.loop_state.state import LoopState, StateStretch
from stiction.diagnosis.loop_state.valve_not_responding import find_valve_not_responding
from stiction.diagnosis.loop_state.wind_up import WindUp, find_wind_up

__all__ = [
    "HEADLINES",
    "LoopState",
    "StateStretch",
    "WindUp",
    "are_signals_swapped",
    "assess_loop_state",
    "describe_action",
    "describe_state",
    "find_bad_data",
    "find_manual",
    "find_not_in_command",
    "find_pv_frozen",
    "find_saturated",
    "find_shut_in",
    "find_unrelated_signals",
    "find_valve_not_responding",
    "find_wind_up",
]

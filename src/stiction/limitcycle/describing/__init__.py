"""Describing functions of valves: in closed form, event by event, and numeric."""

from stiction.limitcycle.describing.memoryless import Deadband, Quantiser, Relay, Saturation
from stiction.limitcycle.describing.valve_df import describing_function

__all__ = ["Deadband", "Quantiser", "Relay", "Saturation", "describing_function"]

"""What must come: describing functions, limit cycles and their stability, basins."""

from stiction.limitcycle.describing import Deadband, Quantiser, Relay, Saturation, describing_function
from stiction.limitcycle.prediction import harmonic_balance
from stiction.limitcycle.result import LimitCycle

__all__ = ["Deadband", "LimitCycle", "Quantiser", "Relay", "Saturation", "describing_function", "harmonic_balance"]

"""What a valve does to a sine: describing functions, closed, event by event, and numeric."""

from stiction.limitcycle.describing.face import describing_function
from stiction.limitcycle.describing.memoryless import Deadband, Quantiser, Relay, Saturation

__all__ = ["Deadband", "Quantiser", "Relay", "Saturation", "describing_function"]

"""Is the loop oscillating: how fast, how regularly, how large, and at how many periods at once."""

from stiction.diagnosis.oscillation.find import find_oscillation
from stiction.diagnosis.oscillation.further import cycle_average, further_oscillations
from stiction.diagnosis.oscillation.rhythm import autocorrelation
from stiction.diagnosis.oscillation.signals import half_cycles

__all__ = [
    "autocorrelation",
    "cycle_average",
    "find_oscillation",
    "further_oscillations",
    "half_cycles",
]

"""Is the loop oscillating: how fast, how regularly, how large, and at how many periods at once."""

from stiction.diagnosis.oscillation.find import find_oscillation
from stiction.diagnosis.oscillation.further import cycle_average, further_oscillations
from stiction.diagnosis.oscillation.rhythm import autocorrelation
from stiction.diagnosis.oscillation.signals import about_drift, control_error, error_name, filled, half_cycles, smooth

__all__ = [
    "about_drift",
    "autocorrelation",
    "control_error",
    "cycle_average",
    "error_name",
    "filled",
    "find_oscillation",
    "further_oscillations",
    "half_cycles",
    "smooth",
]

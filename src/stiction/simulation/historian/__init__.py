"""Between the plant and the file: what historians do to records, one small function for each effect."""

from stiction.simulation.historian.effects import EFFECTS, SLOWER, spoil
from stiction.simulation.historian.spoiled import (
    clipped,
    clock_jumps,
    frozen,
    gaps,
    missing,
    part_manual,
    replayed,
    rescaled,
)
from stiction.simulation.historian.stored import (
    averaged,
    each_signal,
    exception_reported,
    interpolated,
    quantised,
    sampled,
    swinging_door,
)

__all__ = [
    "EFFECTS",
    "SLOWER",
    "averaged",
    "clipped",
    "clock_jumps",
    "each_signal",
    "exception_reported",
    "frozen",
    "gaps",
    "interpolated",
    "missing",
    "part_manual",
    "quantised",
    "replayed",
    "rescaled",
    "sampled",
    "spoil",
    "swinging_door",
]

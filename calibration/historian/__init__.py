"""Effects of historians and of faulty data on records, one function for each effect."""

from calibration.historian.data_faults import (
    add_clock_jumps,
    add_gaps,
    add_manual_period,
    change_units,
    clip_op,
    drop_samples,
    freeze_signals,
    replay_segment,
)
from calibration.historian.effects import EFFECTS, INTERVAL_EFFECTS, apply_effect
from calibration.historian.historian_storage import (
    average_intervals,
    compress_by_swinging_door,
    interpolate_samples,
    map_signals,
    quantise_signals,
    report_by_exception,
    sample_slower,
)

__all__ = [
    "EFFECTS",
    "INTERVAL_EFFECTS",
    "add_clock_jumps",
    "add_gaps",
    "add_manual_period",
    "apply_effect",
    "average_intervals",
    "change_units",
    "clip_op",
    "compress_by_swinging_door",
    "drop_samples",
    "freeze_signals",
    "interpolate_samples",
    "map_signals",
    "quantise_signals",
    "replay_segment",
    "report_by_exception",
    "sample_slower",
]

"""Data checks, a page for each fault; `stiction.records.assess_quality` applies them all to a record."""

from stiction.records.quality.clock_jumps import find_discontinuities
from stiction.records.quality.compression import controller_saw_hold, count_interpolated, exception_deviation
from stiction.records.quality.copied_data import find_copied_data
from stiction.records.quality.frozen import find_frozen, find_manual, find_outages
from stiction.records.quality.manual_steps import find_manual_steps
from stiction.records.quality.movement import count_reversals
from stiction.records.quality.moving_average import detect_averaging_window
from stiction.records.quality.op_scale import detect_op_scale
from stiction.records.quality.outliers import find_outliers
from stiction.records.quality.quantisation import count_levels, is_coarse, quantisation_step
from stiction.records.quality.sampling import last_value_correlation
from stiction.records.quality.saturation import find_clipping, find_saturation, find_shutdown, find_span_ends
from stiction.records.quality.storage_rate import find_repeated, find_slower_signal, find_stored_samples

__all__ = [
    "controller_saw_hold",
    "count_interpolated",
    "count_levels",
    "count_reversals",
    "detect_averaging_window",
    "detect_op_scale",
    "exception_deviation",
    "find_clipping",
    "find_copied_data",
    "find_discontinuities",
    "find_frozen",
    "find_manual",
    "find_manual_steps",
    "find_outages",
    "find_outliers",
    "find_repeated",
    "find_saturation",
    "find_shutdown",
    "find_slower_signal",
    "find_span_ends",
    "find_stored_samples",
    "is_coarse",
    "last_value_correlation",
    "quantisation_step",
]

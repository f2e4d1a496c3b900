"""The figures of a loop, one page each: a function from a `View` to a `Figure`, or None where there is nothing to draw.

They compute nothing but what drawing needs (thinning, a spectrum for the eye).
"""

from stiction.report.figures.autocorrelation import autocorrelation
from stiction.report.figures.error_surface import error_surface
from stiction.report.figures.model_fit import model_fit
from stiction.report.figures.pv_op import pv_op
from stiction.report.figures.severity import severity
from stiction.report.figures.sparkline import sparkline
from stiction.report.figures.spectrum import spectrum
from stiction.report.figures.trends import trends
from stiction.report.figures.valve_position import valve_position
from stiction.report.figures.windows import windows

__all__ = [
    "autocorrelation",
    "error_surface",
    "model_fit",
    "pv_op",
    "severity",
    "sparkline",
    "spectrum",
    "trends",
    "valve_position",
    "windows",
]

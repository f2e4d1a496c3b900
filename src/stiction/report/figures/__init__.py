"""The figures of a loop, one page each: a function from a `LoopView` to a `Figure`, or None where there is nothing to draw.

Those of remedies take a trial, a twin or a retuning instead.

They compute nothing but what drawing needs (thinning, a spectrum for the eye).
"""

from stiction.report.figures.autocorrelation import autocorrelation
from stiction.report.figures.before_after import before_after
from stiction.report.figures.dead_time import dead_time
from stiction.report.figures.error_surface import error_surface
from stiction.report.figures.model_fit import model_fit
from stiction.report.figures.pv_op import pv_op
from stiction.report.figures.remedies import remedy_sensitivity, remedy_tradeoff
from stiction.report.figures.retuning import retuning
from stiction.report.figures.severity import severity
from stiction.report.figures.sparkline import sparkline
from stiction.report.figures.spectrum import spectrum
from stiction.report.figures.trends import trends
from stiction.report.figures.twin_overlay import twin_overlay
from stiction.report.figures.valve_position import valve_position
from stiction.report.figures.windows import windows

__all__ = [
    "autocorrelation",
    "before_after",
    "dead_time",
    "error_surface",
    "model_fit",
    "pv_op",
    "remedy_sensitivity",
    "remedy_tradeoff",
    "retuning",
    "severity",
    "sparkline",
    "spectrum",
    "trends",
    "twin_overlay",
    "valve_position",
    "windows",
]

"""The figures of a loop, one file each: a function from a `LoopView` to a `Figure`, or None without data.

The figures of remedies take a trial, a twin or a retuning instead.

They compute only what drawing needs (fewer points, the spectrum of the PV).
"""

from stiction.report.figures.autocorrelation import autocorrelation
from stiction.report.figures.before_after import before_after
from stiction.report.figures.contributions import contributions
from stiction.report.figures.likelihood_ratios import likelihood_ratios
from stiction.report.figures.likelihood_surface import likelihood_surface
from stiction.report.figures.model_fit import model_fit
from stiction.report.figures.oscillation_causes import oscillation_causes
from stiction.report.figures.pv_op import pv_op
from stiction.report.figures.remedies import remedy_sensitivity, remedy_tradeoff
from stiction.report.figures.retuning import retuning
from stiction.report.figures.segments import segments
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
    "contributions",
    "likelihood_ratios",
    "likelihood_surface",
    "model_fit",
    "oscillation_causes",
    "pv_op",
    "remedy_sensitivity",
    "remedy_tradeoff",
    "retuning",
    "segments",
    "severity",
    "sparkline",
    "spectrum",
    "trends",
    "twin_overlay",
    "valve_position",
    "windows",
]

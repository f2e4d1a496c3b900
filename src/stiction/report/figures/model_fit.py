"""The fitted valve and process over the recorded PV, and what they leave unexplained."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.diagnosis.identification.likelihood import MOST_SAMPLES
from stiction.diagnosis.identification.signals import MOST_PERIODS
from stiction.diagnosis.verdict.stem import BY_POSITION
from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from stiction.diagnosis.identified import Identification
    from stiction.report.loop_view import LoopView

__all__ = ["model_fit"]


def model_fit(view: LoopView) -> Figure | None:
    """Return recorded and simulated PV with the residual below; None without a fit or a PV."""
    record, found = view.diagnosis.record, view.diagnosis.identification
    if record.pv is None or found is None:
        return None
    left = record.pv - view.model
    first, last = view.window
    data = [
        view.trace(
            record.pv,
            "PV restored" if "PV" in view.partly_stored else "PV recorded",
            style.line_style(style.PV),
            yaxis="y",
        ),
        view.trace(
            view.model, f"PV simulated from OP with the {view.model_name}", style.line_style(style.MODEL), yaxis="y"
        ),
        view.trace(left, "residual", {"color": style.SECONDARY_COLOR, "width": 1}, yaxis="y2", showlegend=False),
    ]
    layout = {
        "xaxis": {
            "title": {"text": view.time_title},
            "anchor": "y2",
            "range": [float(view.time[first]), float(view.time[last - 1])],
        },
        "yaxis": {"domain": [0.36, 1.0], "title": {"text": f"PV<br>[{view.pv_unit}]"}},
        "yaxis2": {
            "domain": [0.0, 0.28],
            "title": {"text": "residual"},
            "zeroline": True,
            "zerolinecolor": style.BORDER_COLOR,
        },
        "hovermode": "x",
    }
    caption = " ".join(filter(None, (_explained(view, found), _covered(view), _weighed(view, found))))
    return Figure({"data": data, "layout": layout}, "Model over data", caption, height=400)


def _explained(view: LoopView, found: Identification) -> str:
    """How much of the PV each valve explains, and which of them is drawn."""
    sticky, good = labels.format_number(found.fit), labels.format_number(found.fit_linear)
    if view.good_shown:
        return (
            f"Simulated from the OP, a good valve and its best process explain {good} % of the PV's variation; the"
            f" likeliest sticky valve explains {sticky} % and was not believed."
        )
    valve = "valve with play" if view.diagnosis.cause == "deadband" else "sticky valve"
    if not view.valve_is_accepted:
        valve = "likeliest sticky valve, which was not believed,"
    return (
        f"Simulated from the OP, the {valve} and process explain {sticky} % of the PV's variation;"
        f" the best process with a good valve explains {good} %."
    )


def _covered(view: LoopView) -> str:
    """Which part of the analysed stretch was simulated, and why not all of it; nothing where it was."""
    pieces = view.simulated
    if not pieces or pieces == [view.window]:
        return ""
    first, last = pieces[0][0], pieces[-1][1]
    samples = f"samples {first} to {last - 1} ({view.span_of(first, last)})"
    if len(pieces) > 1:
        share = 100.0 * sum(stop - start for start, stop in pieces) / (view.window[1] - view.window[0])
        what = f"{len(pieces)} pieces of {samples}, {labels.format_number(share, '%', 2)} of the analysed stretch"
    else:
        what = samples
    whys = [f"each piece that is searched is {MOST_PERIODS:.0f} periods long at most"] if view.in_part else []
    if view.diagnosis.oscillation.period > 0.0:
        whys.append("half a period at either end has no moving average to be compared about")
    return f"The simulation covers {what}" + (f": {', and '.join(whys)}." if whys else ".")


def _weighed(view: LoopView, found: Identification) -> str:
    """Which part of a long record S and J come from; nothing where it is all of it, or their likelihood tells none."""
    first, last = view.window
    if last - first <= MOST_SAMPLES or found.rough is None or found.reason == BY_POSITION:
        return ""
    return (
        f"The likelihood that tells S and J takes at most {MOST_SAMPLES} samples from the middle, each the mean of"
        " several where more than some dozens make a period."
    )

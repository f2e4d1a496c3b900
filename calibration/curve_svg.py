"""Curves of the validation as SVG documents: reliability beside risk over coverage, and found over false alarms."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

__all__ = ["curve_svg", "roc_svg"]

OURS, OTHERS = "#0b62a4", ("#bc4c00", "#1a7f37", "#8250df", "#bf3989", "#6e7781")
"""Colours of the verdict and of the published methods, which are repeated with dashes."""
STYLE: Any = {
    "svg.fonttype": "none", "svg.hashsalt": "stiction", "font.family": "sans-serif", "font.size": 9.0,
    "axes.grid": True, "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False,
}  # fmt: skip


def curve_svg(title: str, reliability: NDArray, risk: NDArray, max_risk: float = 0.3) -> str:
    """Draw the reliability of probabilities, and the wrong calls over the share of loops decided.

    Parameters
    ----------
    title : str
        What was validated.
    reliability : ndarray, shape (n_bins, 2)
        Mean probability and share of sticky loops of each bin [-].
    risk : ndarray, shape (n_loops, 2)
        Share of loops decided and share of these that are wrong [-].
    max_risk : float
        Upper end of the axis of wrong calls [-].

    Returns
    -------
    str
        An SVG document.
    """
    figure, (left, right) = _figure(7.2, 3.4, panels=2)
    left.plot((0, 1), (0, 1), "--", color="#888", label="perfect")
    left.plot(*reliability.T, "o-", color=OURS, label="bins of equal weight")
    left.set(xlim=(0, 1), ylim=(0, 1), xlabel="Probability of stiction [-]", ylabel="Share of sticky loops [-]")
    left.legend(frameon=False)
    right.plot(*_thinned(risk).T, color=OURS)
    right.set(xlim=(0, 1), ylim=(0, max_risk), xlabel="Share of loops decided, the surest first [-]")
    right.set_ylabel("Share of these that are wrong [-]")
    return _document(figure, title)


def roc_svg(title: str, curves: Mapping[str, NDArray], max_alarms: float = 20.0) -> str:
    """Draw sticky loops found over false alarms.

    Parameters
    ----------
    title : str
        What was validated.
    curves : mapping of str to ndarray, shape (n_points, 2)
        Name -> false alarms and sticky loops found [%]; the first curve is drawn thick.
    max_alarms : float
        Right end of the axis of false alarms [%].

    Returns
    -------
    str
        An SVG document.
    """
    figure, [axes] = _figure(7.2, 4.2)
    for k, (name, points) in enumerate(curves.items()):
        colour = OTHERS[(k - 1) % len(OTHERS)] if k else OURS
        shown = _thinned(points[points[:, 0] <= max_alarms])
        axes.plot(*shown.T, "--" if k > len(OTHERS) else "-", color=colour, lw=1.2 if k else 2.6, label=name)
    axes.set(xlim=(0, max_alarms), ylim=(0, 100), title=title)
    axes.set(xlabel="Good loops called sticky [%]", ylabel="Sticky loops found [%]")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return _document(figure, title)


def _figure(width: float, height: float, panels: int = 1) -> tuple[Figure, Any]:
    """A figure of a size [inch] with its axes side by side."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(rc=STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        return figure, figure.subplots(1, panels, squeeze=False)[0]


def _document(figure: Figure, title: str) -> str:
    """The figure as text that is the same in every run."""
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context(rc=STYLE):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Title": title})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def _thinned(points: NDArray, max_points: int = 400) -> NDArray:
    """At most about `max_points` of the points, the last among them."""
    return points[:: -max(len(points) // max_points, 1)][::-1]

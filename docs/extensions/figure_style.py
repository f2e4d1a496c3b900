"""The style of the figures of the gallery."""

from __future__ import annotations


def set_figure_style(_: object, __: object) -> None:
    """Give every figure of the gallery the same size and colours."""
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    plt.rcdefaults()
    mpl.rcParams |= {
        "figure.figsize": (7.2, 4.4),
        "figure.dpi": 110,
        "figure.constrained_layout.use": True,
        "axes.prop_cycle": mpl.cycler(color=["#0969da", "#bc4c00", "#1a7f37", "#8250df", "#bf3989", "#6e7781"]),
        "axes.grid": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "grid.alpha": 0.3,
    }

"""Amplitude spectrum of the PV with the harmonics of the detected period."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.gaps import interpolate_gaps
from stiction.records.straight_line import fit_line
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.loop_view import LoopView

__all__ = ["spectrum"]

HARMONICS = 5
"""Harmonics marked."""


def spectrum(view: LoopView) -> Figure | None:
    """Return the amplitude spectrum of the PV; None without a PV or with too few samples."""
    record, period = view.diagnosis.record, view.diagnosis.oscillation.period
    first, last = view.analysed
    if record.pv is None:
        return None
    pv = record.pv[first:last]
    if pv.size < 16 or np.isfinite(pv).sum() < 2:
        return None
    frequency, amplitude = _amplitudes(pv, record.dt)
    known = bool(np.isfinite(period)) and period > 0.0
    end = min(float(frequency[-1]), (HARMONICS + 1.0) / period if known else float(frequency[-1]))
    shown = frequency <= end
    name, size = labels.time_unit(120.0 / end)
    x, y = frequency[shown] * size, amplitude[shown]
    drawn = downsample(y)
    marks = [(k, k / period * size) for k in range(1, HARMONICS + 1) if k / period <= end] if known else []
    layout = {
        "xaxis": {"title": {"text": f"Frequency [1/{name}]"}, "range": [0.0, end * size]},
        "yaxis": {"title": {"text": "PV amplitude"}, "rangemode": "tozero"},
        "shapes": [style.vertical_line(x) for _, x in marks],
        "annotations": [_label(k, x) for k, x in marks],
        "showlegend": False,
        "margin": {"t": style.BELOW_BUTTONS},
    }
    if known:
        caption = f"Dotted lines mark the frequency of the period, {labels.format_duration(period)}, and its multiples."
    else:
        caption = "No period was found, so no harmonics are marked."
    data = [style.trace(x[drawn], y[drawn], "PV", style.line_style(style.PV))]
    return Figure({"data": data, "layout": layout}, "Spectrum of the PV", caption, height=300)


def _amplitudes(y: NDArray[np.float64], dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequency [1/s] and amplitude of each line, trend removed, Hann window; gaps are interpolated."""
    k, filled = np.arange(y.size), interpolate_gaps(y)
    level = filled - fit_line(k, filled).at(k)
    window = np.hanning(y.size)
    amplitude = 2.0 / window.sum() * np.abs(np.fft.rfft(level * window))
    return np.fft.rfftfreq(y.size, dt).astype(np.float64), amplitude.astype(np.float64)


def _label(k: int, x: float) -> dict[str, Any]:
    text = "f" if k == 1 else f"{k} f"
    font = {"size": 11, "color": style.SECONDARY_COLOR}
    return {"x": x, "y": 1, "yref": "paper", "yanchor": "bottom", "text": text, "showarrow": False, "font": font}

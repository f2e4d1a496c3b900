"""Severity of stiction: a scale of S with bands and the 95 % interval, where S is in % of span."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report import labels
from stiction.report.blocks import TrustedHtml
from stiction.report.rendering import render_fragment

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.records.record import LoopRecord

__all__ = ["SEVERITY_BANDS", "severity"]

SEVERITY_BANDS = ((0.5, "slight"), (2.0, "moderate"), (np.inf, "large"))
"""Upper end of each band of S [% of span] and its name: a convention of this package, no standard."""
NO_BANDS = (
    '<p class="text note">The scale of S needs OP in % of span; OP is in another unit. '
    "Give op_range (--op-range) to convert it.</p>"
)
"""Note in place of the scale where S is in another unit."""


def severity(identification: Identification, record: LoopRecord) -> TrustedHtml:
    """Return the scale with S on it, or a note where S is in another unit."""
    if not record.op_in_percent:
        return TrustedHtml(NO_BANDS)
    high = identification.S_high if np.isfinite(identification.S_high) else identification.S
    end = float(np.ceil(max(4.0, 1.15 * high)))
    edges = [0.0, *(min(limit, end) for limit, _ in SEVERITY_BANDS)]
    bands = [
        {"left": 100.0 * low / end, "width": 100.0 * (up - low) / end, "word": word, "level": k}
        for k, (low, up, (_, word)) in enumerate(zip(edges, edges[1:], SEVERITY_BANDS, strict=False))
    ]
    step = next(s for s in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0) if end / s <= 10 or s == 50.0)
    ticks = [{"left": 100.0 * x / end, "text": f"{x:g}"} for x in np.arange(0.0, end + 1e-9, step)]
    interval = None
    if np.isfinite([identification.S_low, identification.S_high]).all():
        interval = {
            "left": 100.0 * identification.S_low / end,
            "width": 100.0 * max(identification.S_high - identification.S_low, 0.0) / end,
        }
    word = next(word for limit, word in SEVERITY_BANDS if limit > identification.S or limit == np.inf)
    label = f"{labels.stiction_size(identification, record)}: {word}"
    return render_fragment(
        "severity.html", bands=bands, ticks=ticks, interval=interval, at=100.0 * identification.S / end, label=label
    )

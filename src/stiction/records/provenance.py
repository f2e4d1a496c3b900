"""Where a record comes from, and what was assumed and repaired when it was read."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["UNKNOWN_UNIT", "Provenance"]

UNKNOWN_UNIT = "an unknown unit"
"""Unit of an OP that may or may not be in %."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a record comes from and what the reader changed."""

    source: str = "memory"
    """File name, or what made the record."""
    sha256: str = ""
    """Digest of the file's bytes; empty when there is no file."""
    columns: dict[str, str] = field(default_factory=dict)
    """Signal name -> column of the source it was read from."""
    assumptions: tuple[str, ...] = ()
    """What the reader assumed, one sentence each."""
    rows: int = 0
    """Rows in the source [-]."""
    missing_samples: int = 0
    """Samples in which OP or PV was missing or had a bad status, gaps in the time stamps included [-]."""
    bad_values: dict[str, int] = field(default_factory=dict)
    """Kind of bad value, such as the text "Bad Input" in place of a number -> how often [-]."""
    clock_jumps: int = 0
    """How often the clock ran backwards or changed to or from summer time [-]."""
    summer_time: int = 0
    """How many of `clock_jumps` were changes of summer time that were undone without a missing row [-]."""
    held_samples: int = 0
    """Samples for which the reader repeated an earlier value, because the time stamps were uneven [-]."""
    unchanged_samples: int = 0
    """How many of `held_samples` the source left out because the value had not changed [-]."""
    interval_spread: float = 0.0
    """Median range of OP or PV within the intervals of which the source gives averages, over the 98 % range of these,
    the larger one [-]; 0 where the source gives no minima and maxima."""
    outliers: int = 0
    """Values far from all others that count as missing (see `quality.find_outliers`) [-]."""
    pv_unit: str = ""
    """Unit of PV, when the source names it."""
    op_unit: str = ""
    """Unit of OP, when the source names one that is not % of span and could not be converted."""
    secondary_tag: str = ""
    """Tag of the secondary loop of a cascade: OP is its set point, and the valve belongs to it."""
    quality_reading: str = ""
    """How the quality codes were read; empty where there is only one way."""
    unused_columns: tuple[str, ...] = ()
    """Columns that stand beside a signal of the loop and were not used."""

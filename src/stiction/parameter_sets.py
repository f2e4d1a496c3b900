"""The former place of `stiction.models.parameter_sets`."""

from stiction.models.parameter_sets import (
    SETS,
    graphite_karnopp,
    graphite_lugre,
    nominal,
    nominal_lugre,
    published_valve,
    table1_reading_a,
    table1_reading_b,
)

__all__ = [
    "SETS",
    "graphite_karnopp",
    "graphite_lugre",
    "nominal",
    "nominal_lugre",
    "published_valve",
    "table1_reading_a",
    "table1_reading_b",
]

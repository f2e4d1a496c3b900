"""Text for numbers, JSON, notebook cards and plots of results. This room imports no other room."""

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun, format_interval, format_number, format_probability

__all__ = [
    "count_noun",
    "format_interval",
    "format_number",
    "format_probability",
    "format_seconds",
]

"""Where records come from: files, frames and databases."""

from stiction.sources.formats import register_format
from stiction.sources.layouts import register_layout
from stiction.sources.read import open_loops, read

__all__ = ["open_loops", "read", "register_format", "register_layout"]

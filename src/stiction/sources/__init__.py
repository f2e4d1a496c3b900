"""Where records come from: files, frames and databases."""

from stiction.sources.formats import register_format
from stiction.sources.layouts import register_layout
from stiction.sources.read import read

__all__ = ["read", "register_format", "register_layout"]

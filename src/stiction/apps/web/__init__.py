"""The local web page of `stiction serve`: server, worker processes, screens. It computes nothing by itself."""

from pathlib import Path

__all__ = ["STATIC"]

STATIC = Path(__file__).with_name("static")
"""Folder of the pages, styles and scripts."""

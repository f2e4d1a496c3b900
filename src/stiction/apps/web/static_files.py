"""Folder of the pages, styles and scripts."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["static_folder"]


def static_folder() -> Path:
    """Folder of the pages, styles and scripts."""
    return resources.files("stiction.apps.web").joinpath("static")  # pyright: ignore[reportReturnType]

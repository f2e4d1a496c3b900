"""Version of what judges a window."""

from __future__ import annotations

from functools import cache
from hashlib import blake2b
from importlib.resources import files

__all__ = ["judging_version"]

MODELS = ("model.json", "causes.json")
"""Trained models that judge a window by itself."""


@cache
def judging_version() -> str:
    """Version of the package and digest of the trained models: windows that differ in it are never pooled.

    Examples
    --------
    >>> judging_version() == judging_version()
    True
    """
    from stiction import __version__

    hashed = blake2b(digest_size=8)
    for name in MODELS:
        hashed.update(files("stiction.diagnosis.verdict").joinpath(name).read_bytes())
    return f"{__version__} {hashed.hexdigest()}"

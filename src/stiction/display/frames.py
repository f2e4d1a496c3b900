"""A frame of polars as the library that a caller asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import MissingExtraError, ParameterError

if TYPE_CHECKING:
    import polars as pl

__all__ = ["FRAME_LIBRARIES", "as_native", "require_library"]

FRAME_LIBRARIES = ("polars", "pandas", "pyarrow")
"""Libraries of frames."""


def require_library(native: str) -> None:
    """Raise a ParameterError unless the name is one of `FRAME_LIBRARIES`."""
    if native not in FRAME_LIBRARIES:
        raise ParameterError(f"native = {native!r} is unknown; give one of {', '.join(FRAME_LIBRARIES)}.")


def as_native(frame: pl.DataFrame, native: str) -> Any:
    """Give a frame of "polars", "pandas" or "pyarrow".

    Raises
    ------
    ParameterError
        When the library is not one of these.
    MissingExtraError
        When it is not installed.

    Examples
    --------
    >>> import polars as pl
    >>> as_native(pl.DataFrame({"a": [1]}), "pandas")["a"].tolist()
    [1]
    """
    require_library(native)
    try:
        return {"polars": lambda: frame, "pandas": frame.to_pandas, "pyarrow": frame.to_arrow}[native]()
    except ImportError:
        raise MissingExtraError(f"{native} is not installed; install it with: pip install {native}") from None

"""``pytest -m quick`` reads only files with that mark: collecting all others takes longer than the tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files without the mark when only quick tests are asked for."""
    if config.option.markexpr != "quick" or collection_path.suffix != ".py":
        return None
    return b"pytest.mark.quick" not in collection_path.read_bytes() or None

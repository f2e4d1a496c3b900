"""One thread for linear algebra and tables in each test process; ``pytest -m quick`` reads only marked files."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

# Read when numpy and polars are imported, after this file.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_name, "1")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files without the mark when only quick tests are asked for: collecting all takes longer than them."""
    if config.option.markexpr != "quick" or collection_path.suffix != ".py":
        return None
    return b"pytest.mark.quick" not in collection_path.read_bytes() or None

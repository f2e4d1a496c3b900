from __future__ import annotations

import io

import numpy as np
import pytest

from stiction.sources import read

N = 120


@pytest.fixture(scope="session")
def signals():
    """A made-up loop, rounded so that every text form carries it exactly: seconds, PV, OP, SP."""
    k = np.arange(N)
    rng = np.random.default_rng(7)
    pv = np.round(50 + 3 * np.sin(k / 5) + rng.normal(0, 0.2, N), 3)
    op = np.round(40 + 4 * np.cos(k / 5) + rng.normal(0, 0.1, N), 3)
    return k.astype(float), pv, op, np.full(N, 50.5)


@pytest.fixture(scope="session")
def table():
    """Write columns as text: ``table(header, column, ...)``; cells are written with repr unless they are text."""

    def write(header, *columns, delimiter=",", decimal=".", end="\n"):
        def cell(x):
            return x if isinstance(x, str) else repr(float(x)).replace(".", decimal)

        rows = [delimiter.join(cell(x) for x in row) for row in zip(*columns, strict=True)]
        lines = [header] if isinstance(header, str) else list(header)
        return end.join([*lines, *rows]) + end

    return write


@pytest.fixture(scope="session")
def read_text():
    """Read a text as if it stood in a file."""

    def reading(text, encoding="utf-8", **options):
        return read(io.BytesIO(text.encode(encoding)), **options)

    return reading

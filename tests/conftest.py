"""What every test may rely on: settled Hypothesis profiles, compiled kernels, the folder of real records."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from services import MARKS, open_browser, open_postgres

ROOT = Path(__file__).resolve().parents[1]

settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


def _give_kernels_a_cache() -> None:
    """Point the kernels' disk cache to a folder that can be written, where the usual one cannot."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    nearest = next(folder for folder in (usual, *usual.parents) if folder.exists())
    if not os.access(nearest, os.W_OK):
        os.environ["NUMBA_CACHE_DIR"] = str(Path(tempfile.gettempdir()) / "stiction-kernels")


_give_kernels_a_cache()
COMPILING = pytest.StashKey[threading.Thread]()


def _compile_kernels() -> None:
    """Compile the kernels of a simulated loop, and so of all valves, into the disk cache."""
    with contextlib.suppress(Exception):  # what is broken shows in the tests that need it
        import stiction as st

        valve = st.Kano(S=3.0, J=1.0)
        st.stroke(valve, [0.0, 3.0], dt=1.0)
        st.simulate(st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0), sp=1.0, duration=10.0)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile while the processes of xdist import and collect the tests; these find the kernels in the disk cache."""
    if getattr(session.config.option, "numprocesses", None) and not session.config.option.collectonly:
        session.config.stash[COMPILING] = threading.Thread(target=_compile_kernels)
        session.config.stash[COMPILING].start()


def pytest_unconfigure(config: pytest.Config) -> None:
    """Wait for the compiler, which must not be cut off."""
    if compiling := config.stash.get(COMPILING, None):
        compiling.join()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that need a browser or a database server, before marks select tests."""
    for item in items:
        for fixture in MARKS.keys() & set(getattr(item, "fixturenames", ())):
            item.add_marker(MARKS[fixture])


@pytest.fixture(scope="module")
def browser():
    """A browser for one module: its event loop must end before other modules start browsers of their own."""
    with open_browser() as running:
        yield running


@pytest.fixture(scope="module")
def postgres():
    """A PostgreSQL server for one module."""
    with open_postgres() as running:
        yield running


@pytest.fixture
def audit_in_process():
    """Audits do their loops in this process, which is faster; tests of the worker processes do without it."""
    from fleet.in_process_audit import audits_in_this_process

    with audits_in_this_process():
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """Root of the project."""
    return ROOT


@pytest.fixture(scope="session")
def records() -> Path:
    """Folder of real loop records: STICTION_RECORDS, else ../shared/data; without either the test is skipped."""
    named = os.environ.get("STICTION_RECORDS")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"real records: {'STICTION_RECORDS' if named else '../shared/data'} is not a folder")
    return folder


@pytest.fixture(scope="session")
def signals():
    """A made-up loop, rounded so that every text form carries it exactly: seconds, PV, OP, SP."""
    k = np.arange(120)
    rng = np.random.default_rng(7)
    pv = np.round(50 + 3 * np.sin(k / 5) + rng.normal(0, 0.2, 120), 3)
    op = np.round(40 + 4 * np.cos(k / 5) + rng.normal(0, 0.1, 120), 3)
    return k.astype(float), pv, op, np.full(120, 50.5)


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
        from stiction.sources import read

        return read(io.BytesIO(text.encode(encoding)), **options)

    return reading

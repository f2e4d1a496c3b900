"""First calls of the kernels in a new worker process, so that no user waits for them to compile."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from stiction.errors import StictionError
from stiction.scratch import run_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.records import LoopRecord

__all__ = ["open_audits", "warm_page", "warm_reading", "warm_simulation"]


def warm_simulation() -> None:
    """Import and compile what simulations and zooms need."""
    from stiction.apps.web.simulation_answers import warm_simulations

    _simulate_loop(600.0)
    warm_simulations()


def warm_reading() -> None:
    """Import what reads files."""
    from stiction.apps.web.read_files import read_files

    with TemporaryDirectory(dir=run_folder()) as folder:
        path = f"{folder}/loop.csv"
        Path(path).write_text("time,PV,OP\n" + "".join(f"{k},{k % 5},{k % 7}\n" for k in range(100)), encoding="utf-8")
        read_files([(path, path)], {}, None, folder, 1_000_000)


def warm_page() -> None:
    """Import and compile what the page of a loop needs."""
    from stiction.apps.web.diagnose_loop import diagnose_loop

    with TemporaryDirectory(dir=run_folder()) as folder:
        path = f"{folder}/record.parquet"
        _simulate_loop(1200.0).to_parquet(path)
        diagnose_loop(path, folder)


def open_audits(audits: Sequence[str]) -> None:
    """Open audits before they are asked for; the page says why one cannot be opened."""
    from stiction.apps.web.audit_files import load_audit

    for folder in audits:
        with suppress(StictionError):
            load_audit(folder)


def _simulate_loop(duration: float) -> LoopRecord:
    import stiction as st

    loop = st.Loop(st.PID(0.2, 10.0), st.Choudhury(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.simulate(loop, sp=10.0, duration=duration, loop_type="flow")

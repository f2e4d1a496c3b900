"""First calls of the kernels in a new worker process, so that no user waits for them to compile."""

from __future__ import annotations

from contextlib import suppress
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from stiction.errors import StictionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.records import LoopRecord

__all__ = ["warm_background", "warm_quick"]


def warm_quick(audits: Sequence[str] = ()) -> None:
    """Import and compile what a simulation and a zoom need; open audits."""
    from stiction.apps.web.simulation_answers import warm_simulations

    _open_audits(audits)
    _simulate_loop(600.0)
    warm_simulations()


def warm_background(audits: Sequence[str] = ()) -> None:
    """Import and compile what the page of a loop needs; open audits."""
    from stiction.apps.web.diagnose_loop import diagnose_loop

    _open_audits(audits)
    with TemporaryDirectory() as folder:
        path = f"{folder}/record.parquet"
        _simulate_loop(1200.0).to_parquet(path)
        diagnose_loop(path, folder)


def _open_audits(audits: Sequence[str]) -> None:
    """Open audits before they are asked for; the page says why one cannot be opened."""
    from stiction.apps.web.audit_files import load_audit

    for folder in audits:
        with suppress(StictionError):
            load_audit(folder)


def _simulate_loop(duration: float) -> LoopRecord:
    import stiction as st

    loop = st.Loop(st.PID(0.2, 10.0), st.Choudhury(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.simulate(loop, sp=10.0, duration=duration, loop_type="flow")

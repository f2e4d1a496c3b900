"""First calls of the kernels in a new worker process, so that no user waits for them to compile."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stiction.records import LoopRecord

__all__ = ["warm_background", "warm_quick"]


def warm_quick() -> None:
    """Import and compile what a simulation and a zoom need."""
    from stiction.apps.web.simulation_answers import warm_simulations

    _simulate_loop(600.0)
    warm_simulations()


def warm_background() -> None:
    """Import and compile what a diagnosis needs."""
    import stiction as st

    st.diagnose(_simulate_loop(1200.0))


def _simulate_loop(duration: float) -> LoopRecord:
    import stiction as st

    loop = st.Loop(st.PID(0.2, 10.0), st.Choudhury(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.simulate(loop, sp=10.0, duration=duration, loop_type="flow")

"""Whether OP and PV were stored in step: a PV a sample older than the OP beside it hides a sticky valve.

OP holds what the controller made of a noise that PV does not show yet, so that a good valve predicts the PV. The law
of the controller tells: its proportional and integral part leave far less of OP's moves with each PV a sample later.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stiction.diagnosis.identified import ControllerFit
    from stiction.records.record import LoopRecord

__all__ = ["is_late", "with_pv_earlier"]

LATE = 0.4
"""`ControllerFit.left_if_later` below which PV was stored a sample late [-]. Of 1 370 loops (`simulation.population`,
seed 10, and another hand's) one in 200 has less, and nine in ten of the same with PV stored late; of 33 recorded loops
none has, and 23 with PV stored late."""


def is_late(controller: ControllerFit) -> bool:
    """Whether PV was stored a sample late, by the controller found.

    Parameters
    ----------
    controller : ControllerFit
        The controller behind the record.

    Returns
    -------
    bool
        True below `LATE`; False where that is not known.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import numpy as np, stiction as st
    >>> from stiction.diagnosis.identification import fit_controller
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> run = st.simulate(loop, sp=10.0, duration=2000.0, seed=1)
    >>> late = replace(run, pv=np.concatenate([run.pv[:1], run.pv[:-1]]))
    >>> [is_late(fit_controller(one)) for one in (run, late, with_pv_earlier(late))]
    [False, True, False]
    """
    return controller.left_if_later < LATE


def with_pv_earlier(record: LoopRecord) -> LoopRecord:
    """The record with each PV taken a sample earlier, and so a sample shorter.

    Parameters
    ----------
    record : LoopRecord
        A record with PV.

    Returns
    -------
    LoopRecord
        OP, and PV as it was a sample later.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = with_pv_earlier(LoopRecord("FIC-101", 1.0, op=[50.0, 51.0, 52.0], pv=[3.0, 4.0, 5.0]))
    >>> record.op.tolist(), record.pv.tolist()
    ([50.0, 51.0], [4.0, 5.0])
    """
    assert record.pv is not None
    earlier = np.concatenate([record.pv[1:], record.pv[-1:]])
    return replace(record, pv=earlier).window(0, len(record) - 1)

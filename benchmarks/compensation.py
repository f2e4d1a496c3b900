"""All remedies of one loop on its twin: seconds."""

from __future__ import annotations

from bench import Row, Section, median_time

import stiction as st

TARGET = 3.0


def compensation() -> Section:
    """Every remedy of a noisy sticky loop, 20 seeds each and S and J off by 30 %, on two threads."""
    import numpy as np

    pid = st.PID(0.2, 10.0, op_limits=(0.0, 100.0))
    loop = st.Loop(pid, st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    kick = np.zeros(2000)
    kick[:40] = 2.0
    record = st.simulate(loop, 50.0, 2000.0, kick, 1, pv_start=50.0, op_start=50.0)
    found = st.diagnose(record)
    trial = st.compensate(found, seeds=20)
    rows = []
    for what, source in (("given parameters", loop), ("a diagnosis, twin included", found)):
        seconds = median_time(lambda source=source: st.compensate(source, seeds=20), repeats=5)
        rows.append(
            Row(
                f"{len(trial.remedies)} remedies, 20 seeds, {what}",
                seconds,
                "s",
                "limit",
                TARGET,
                TARGET / seconds,
                1.0,
            )
        )
    return Section("Repair, retune or compensate: one loop", rows, (f"recommended: {trial.recommended}",))

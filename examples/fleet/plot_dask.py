"""
Diagnose on a cluster with Dask
===============================

Diagnosing is one function of one record, so any scheduler can spread it. Here Dask runs batches of
loops on local threads; with ``dask.distributed`` the same code runs on a cluster.
"""

import dask
import matplotlib.pyplot as plt

import stiction as st

process = st.FOPDT(3.0, 10.0, 10.0)


def make_loop(k: int) -> st.LoopRecord:
    """Simulate one loop; every third valve sticks."""
    valve = st.Kano(S=5.0, J=2.0) if k % 3 == 0 else st.Ideal()
    loop = st.Loop(st.PID(0.2, 10.0), valve, process, dt=1.0, noise=0.2)
    return st.simulate(loop, sp=10.0, duration=900.0, seed=k, tag=f"FIC-{k:03d}", loop_type="flow")


@dask.delayed
def diagnose_batch(records: list[st.LoopRecord]) -> list[tuple[str, float]]:
    """Diagnose some loops and return small results: the records stay with the worker."""
    return [(record.tag, st.diagnose(record).probability) for record in records]


records = [make_loop(k) for k in range(6)]
batches = [diagnose_batch(records[first : first + 3]) for first in range(0, len(records), 3)]
rows = [row for batch in dask.compute(*batches, scheduler="threads", num_workers=2) for row in batch]

figure, ax = plt.subplots()
ax.bar([tag for tag, _ in rows], [probability for _, probability in rows])
ax.tick_params(axis="x", rotation=60)
ax.set(ylabel="probability of stiction", title="every third valve sticks")
plt.show()

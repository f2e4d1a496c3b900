"""Batches of loops on a Dask cluster: one future for each batch; only this process writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import MissingExtraError, RecordError
from stiction.fleet.batch import Batch, Outcome, run_batch
from stiction.fleet.engine import ProcessEngine, crashed_outcomes
from stiction.worker_process import ONE_THREAD

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from stiction.fleet.source_parts import LoopPlace

__all__ = ["DaskEngine"]

CONNECT_TIMEOUT_S = 10.0


class DaskEngine:
    """Workers of a Dask cluster.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as ``"tcp://10.0.0.5:8786"``, or ``"local"`` for a cluster on this machine.
    workers : int, optional
        Worker processes of a local cluster [-]; one for each core when not given.

    Raises
    ------
    MissingExtraError
        When Dask is not installed.
    RecordError
        When the scheduler cannot be reached, or has no worker.
    """

    def __init__(self, address: str, workers: int | None = None) -> None:
        try:
            from distributed import Client, LocalCluster
        except ImportError:
            raise MissingExtraError('Dask is not installed; install it with: pip install "stiction[dask]"') from None
        self._cluster = None
        try:
            if address == "local":
                count = ProcessEngine(workers).workers
                self._cluster = LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    env=ONE_THREAD,
                )
                self.client = Client(self._cluster)
            else:
                self.client = Client(address, timeout=CONNECT_TIMEOUT_S)
        except (OSError, ValueError, TimeoutError) as error:
            text = " ".join(str(error).split())[:200]
            raise RecordError(
                f"dask = {address!r}: the scheduler cannot be reached ({text}); check its address and whether it "
                "runs, or "
                "give 'local'."
            ) from None
        self.workers = len(self.client.scheduler_info(n_workers=-1)["workers"])
        if not self.workers:
            self.close()
            raise RecordError(
                f"dask = {address!r}: the scheduler has no worker; start workers, for example with `dask worker`."
            )

    def check_workers(self, place: LoopPlace) -> None:
        """Ask each worker for its version and to read one loop.

        Raises RecordError when a worker has another version or cannot read the source; it names the worker.
        """
        import stiction

        answers: Any = self.client.run(probe_worker, place, on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, BaseException):
                raise RecordError(
                    f"worker {worker} has no usable stiction ({type(answer).__name__}: {answer}); install stiction "
                    f"{stiction.__version__} there."
                )
            version, failure = answer
            if version != stiction.__version__:
                raise RecordError(
                    f"worker {worker} has stiction {version}, this computer has {stiction.__version__}; install the "
                    "same version."
                )
            if failure:
                raise RecordError(
                    f"worker {worker} cannot read {place.part.display_name} ({failure}); use a folder or database that "
                    "all workers reach under the same name."
                )

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        """Run batches as long as `go_on` is true, and give the outcomes of each as it is done, in any order."""
        from distributed import as_completed

        waiting = iter(batches)
        done = as_completed()
        running: dict[Any, tuple[Any, Batch]] = {}
        lost: list[Batch] = []

        def submit() -> None:
            while len(running) < 2 * self.workers and go_on() and (batch := next(waiting, None)) is not None:
                future = self.client.submit(run_batch, batch, pure=False)
                running[future.key] = future, batch
                done.add(future)

        try:
            submit()
            while running:
                future = next(done)
                _, batch = running.pop(future.key)
                submit()
                outcomes = self._result(future)
                if outcomes is None:
                    lost.append(batch)
                else:
                    yield outcomes
            for batch in lost:
                for single in batch.split():
                    outcomes = self._result(self.client.submit(run_batch, single, pure=False))
                    yield crashed_outcomes(single) if outcomes is None else outcomes
        finally:
            for future, _ in running.values():
                future.cancel()

    def close(self) -> None:
        """Leave the cluster; a local one ends."""
        self.client.close()
        if self._cluster is not None:
            self._cluster.close()

    @staticmethod
    def _result(future: Any) -> list[Outcome] | None:
        """Outcomes of a future; None when its workers died."""
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker:
            return None


def probe_worker(place: LoopPlace) -> tuple[str, str]:
    """Version of a worker, and why it cannot read a loop; empty when it can."""
    import stiction
    from stiction.fleet.source_parts import read_loop

    try:
        read_loop(place)
    except Exception as error:
        return stiction.__version__, " ".join(f"{type(error).__name__}: {error}".split())
    return stiction.__version__, ""

"""Audits with a PostgreSQL ledger whose server restarts, and on a Dask cluster whose workers are killed."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
import sqlalchemy as sa

import stiction as st
from fleet.small_plant import require_same, write_plant
from sources.postgres import PASSWORD
from stiction.errors import RecordError
from stiction.fleet.ledger import Ledger

pytestmark = pytest.mark.processes
LOOPS = 12


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return write_plant(tmp_path_factory.mktemp("plant") / "plant.parquet", LOOPS)


@pytest.fixture(scope="module")
def found(plant, tmp_path_factory):
    return st.audit(plant, tmp_path_factory.mktemp("audit") / "audit", workers=2)


def test_postgresql_ledger_survives_a_restart(plant, found, postgres, tmp_path):
    restarts = []

    def restart(progress):
        if progress.stage in ("screen", "diagnose") and progress.new and progress.stage not in restarts:
            restarts.append(progress.stage)
            postgres.stop()
            threading.Timer(1.0, postgres.start).start()

    audit = st.audit(plant, tmp_path / "audit", workers=2, ledger=postgres.url, progress=restart)
    assert restarts == ["screen", "diagnose"]
    require_same(audit, found)
    engine = sa.create_engine(postgres.url)
    with engine.connect() as connection:
        rows = connection.execute(sa.text("SELECT COUNT(*), COUNT(DISTINCT loop_id) FROM stiction_result")).one()
    engine.dispose()
    assert tuple(rows) == (LOOPS, LOOPS)
    assert PASSWORD not in (tmp_path / "audit" / "audit.toml").read_text()
    with pytest.raises(RecordError, match="STICTION_LEDGER"):
        st.open_audit(tmp_path / "audit")
    require_same(st.open_audit(tmp_path / "audit", ledger=postgres.url), found)


@pytest.fixture(scope="module")
def duration(plant, tmp_path_factory) -> float:
    """Time of an audit with workers that load compiled kernels [s]."""
    began = time.monotonic()
    st.audit(plant, tmp_path_factory.mktemp("timed") / "audit", workers=2)
    return time.monotonic() - began


@pytest.mark.slow
@pytest.mark.parametrize("k", range(20))
def test_postgresql_server_restarts_at_any_moment(plant, found, duration, postgres, tmp_path, k):
    """The server is gone for half a second at a random moment; each audit has a database of its own."""
    name = f"restart_{k}"
    engine = sa.create_engine(postgres.url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(sa.text(f"CREATE DATABASE {name}"))
    engine.dispose()

    def restart():
        postgres.stop()
        time.sleep(0.5)
        postgres.start()

    timer = threading.Timer(float(np.random.default_rng(300 + k).uniform(0.05, 1.0)) * duration, restart)
    timer.start()
    url = f"{postgres.url.rpartition('/')[0]}/{name}"
    audit = st.audit(plant, tmp_path / "audit", workers=2, ledger=url)
    timer.join()
    require_same(audit, found)
    require_same(st.open_audit(tmp_path / "audit", ledger=url), found)
    engine = sa.create_engine(url)
    with engine.connect() as connection:
        rows = connection.execute(sa.text("SELECT COUNT(*), COUNT(DISTINCT loop_id) FROM stiction_result")).one()
    engine.dispose()
    assert tuple(rows) == (LOOPS, LOOPS)


def test_second_audit_of_a_ledger_is_refused(plant, postgres, tmp_path):
    book = Ledger(postgres.url)
    book.create()
    with book.lock("Ana on machine A"), pytest.raises(RecordError, match="an audit is writing to this database"):
        st.audit(plant, tmp_path / "other", workers=1, ledger=postgres.url)
    book.close()


def test_dask_gives_the_same_rows(plant, found, tmp_path):
    pytest.importorskip("distributed")
    require_same(st.audit(plant, tmp_path / "audit", workers=2, dask="local"), found)


def test_killed_dask_worker_costs_nothing(plant, found, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0") as cluster:
        killed = []

        def kill(progress):
            if progress.stage == "diagnose" and not killed:
                killed.append(next(iter(cluster.workers.values())).process.process.pid)
                time.sleep(0.5)
                os.kill(killed[0], signal.SIGKILL)

        audit = st.audit(plant, tmp_path / "audit", dask=cluster.scheduler_address, progress=kill)
        assert killed
    require_same(audit, found)


def test_dask_workers_that_do_not_fit_are_refused(plant, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    with pytest.raises(RecordError, match="the scheduler cannot be reached"):
        st.audit(plant, tmp_path / "a", dask="tcp://127.0.0.1:9")
    monkeypatch.setattr("stiction.__version__", "0.0.0")
    with pytest.raises(RecordError, match=r"worker tcp://\S+ has stiction .*, this computer has 0\.0\.0"):
        st.audit(plant, tmp_path / "b", dask="local", workers=1)

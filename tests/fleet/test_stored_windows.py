"""An audit that runs each night ends like one run over all nights."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

import stiction as st
from fleet.in_process_audit import audits_in_this_process
from stiction.diagnosis.evidence import version
from stiction.fleet.ledger import Ledger, sqlite_url

DAY = 1440


@pytest.fixture(scope="module")
def record():
    """Three days of a sticky valve at one sample a minute."""
    loop = st.Loop(st.PID(0.3, 600.0), st.Kano(5.0, 2.5), st.FOPDT(2.0, 600.0, 300.0), dt=60.0, noise=0.05)
    load = np.convolve(np.random.default_rng(5).normal(0.0, 1.0, 3 * DAY), np.full(10, 0.3), "same")
    made = st.simulate(loop, sp=10.0, duration=3 * DAY * 60.0, disturbance=load - load.mean(), seed=5, loop_type="flow")
    return replace(made, mv=None, start=datetime(2026, 3, 1), tag="FIC-1")


@pytest.fixture(scope="module")
def nightly(record, tmp_path_factory):
    """Folder of the audits of three nights, and the rows after each."""
    folder = tmp_path_factory.mktemp("nights")
    rows = []
    for night in range(3):
        record.window(0, (night + 1) * DAY).to_parquet(folder / "loop.parquet")
        since = {"since": "last"} if night else {}
        rows += st.audit(folder / "loop.parquet", folder / "out", workers=1, **since).rows
    return folder, rows


def test_nights_end_like_one_run(nightly):
    folder, rows = nightly
    [once] = st.audit(folder / "loop.parquet", folder / "once", workers=1).rows
    assert [row.windows for row in rows] == [1, 2, 3]
    assert once.windows == 3
    assert rows[-1].probability == pytest.approx(once.probability, abs=1e-6)
    assert (rows[-1].verdict, rows[-1].S) == (once.verdict, once.S)


def test_short_nights_are_pooled_and_give_way_to_whole_windows(record, tmp_path):
    for night in range(3):
        record.window(night * DAY + 120, night * DAY + 720).to_parquet(
            tmp_path / "loop.parquet"
        )  # a new file each night
        day = datetime(2026, 3, 1 + night)
        until = day + timedelta(days=1)
        [row] = st.audit(tmp_path / "loop.parquet", tmp_path / "out", workers=1, since=day, until=until).rows
        assert row.windows == night + 1
    record.to_parquet(tmp_path / "loop.parquet")
    [row] = st.audit(tmp_path / "loop.parquet", tmp_path / "out", workers=1, until=datetime(2026, 3, 4)).rows
    assert row.windows == 3
    assert row.probability == pytest.approx(st.diagnose(record, methods=False).probability, abs=1e-9)


def test_audit_equals_diagnose(nightly, record):
    assert nightly[1][-1].probability == pytest.approx(st.diagnose(record, methods=False).probability, abs=1e-9)


def test_windows_of_other_models_are_judged_again_or_counted(nightly, record, monkeypatch):
    folder, rows = nightly
    monkeypatch.setattr("stiction.fleet.audit_stages.judging_version", lambda: "0 other")
    record.window(DAY, 3 * DAY).to_parquet(folder / "loop.parquet")  # the first day is gone
    [row] = st.audit(folder / "loop.parquet", folder / "out", workers=1, until="2026-03-04").rows
    assert (row.windows, row.windows_left_out) == (2, 1)
    assert row.probability != rows[-1].probability
    ledger = Ledger(sqlite_url(folder / "out" / "ledger.sqlite"))
    options = ledger.read_runs()[0]["options"]
    [known] = ledger.read_windows(options, version.judging_version()).values()
    assert len(known.windows) == 3
    ledger.close()


NIGHTS, DT = 30, 160.0


def draw_month(number: int) -> st.LoopRecord:
    """Thirty days of a loop at as few samples as windows allow; every third valve sticks, some from day 12 on."""
    rng = np.random.default_rng([57, number])
    n = round(NIGHTS * 86400.0 / DT)
    S = float(rng.uniform(2.0, 6.0)) if number % 3 == 0 or number % 5 == 0 else 0.0
    tau = DT * float(rng.uniform(4.0, 15.0))
    load = np.convolve(rng.normal(0.0, float(rng.uniform(0.5, 2.0)), n), np.full(10, 0.3), "same")
    parts = []
    for first, last, size in ((0, 2 * n // 5, S * (number % 3 == 0)), (2 * n // 5, n, S)):
        valve = st.Kano(size, 0.5 * size) if size else st.Ideal()
        loop = st.Loop(st.PID(0.3, tau), valve, st.FOPDT(2.0, tau, 0.5 * tau), dt=DT, noise=0.05)
        part = st.simulate(loop, 10.0, (last - first) * DT, load[first:last], number, loop_type="flow")
        parts.append(part.window(0, last - first))
    signals = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ("op", "pv", "sp")}
    return st.LoopRecord(f"FIC-{number:03d}", DT, **signals, loop_type="flow", start=datetime(2026, 3, 1))


@pytest.mark.slow
def test_thirty_nights_of_200_loops_end_like_one_run(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    for number in range(200):
        draw_month(number).to_parquet(source / f"{number}.parquet")
    with audits_in_this_process():
        for night in range(1, NIGHTS + 1):
            since = {"since": "last"} if night > 1 else {}
            until = (datetime(2026, 3, 1) + timedelta(days=night)).isoformat()
            nightly = st.audit(source, tmp_path / "nightly", workers=1, until=until, **since)
        once = st.audit(source, tmp_path / "once", workers=1)
    rows, others = ({row.tag: row for row in audit.rows} for audit in (nightly, once))
    assert len(rows) == 200
    assert rows.keys() == others.keys()
    for tag, row in rows.items():
        assert (row.verdict, row.windows) == (others[tag].verdict, others[tag].windows)
        assert row.probability == pytest.approx(others[tag].probability, abs=1e-6)
    assert {row.windows for row in rows.values()} == {16}  # of two days, the first half on the grid
    assert {row.verdict for row in rows.values()} >= {"stiction", "no_stiction"}

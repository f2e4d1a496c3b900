"""Audits of a small plant: verdicts against the truth, going on, windows, failures, bad input."""

from __future__ import annotations

import shutil
import threading
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import polars as pl
import pytest

import stiction as st
from fleet.small_plant import records, require_same, require_sound_ledger, write_plant
from stiction.apps import cli
from stiction.errors import ParameterError, RecordError
from stiction.fleet import Audit, LoopRow, Progress, compare_audits, confirmed_share, find_loop_places
from stiction.fleet.labels import append_label
from stiction.fleet.loop_work import cut_time
from stiction.fleet.progress import LoopRate
from stiction.fleet.rank import rank_members, rank_row, rank_rows
from stiction.records.parquet_writer import to_parquet
from stiction.report import write_audit_page

pytestmark = pytest.mark.usefixtures("audit_in_process")


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return write_plant(tmp_path_factory.mktemp("plant") / "plant.parquet")


@pytest.fixture(scope="module")
def found(plant, tmp_path_factory):
    """The audit of two worker processes, which the audits in this process must equal."""
    return st.audit(plant, tmp_path_factory.mktemp("audit") / "audit", workers=2)


@pytest.fixture
def copy(found, tmp_path):
    """A copy of the audit that a test may change."""
    return shutil.copytree(found.folder, tmp_path / "audit")


def test_rows_tell_the_truth(found):
    assert len(found.rows) == 24
    for k, record in enumerate(records()):
        row = found.row(record.tag)
        assert (row["area"], row["samples"], row["dt_s"]) == (f"U{k % 2}", 600, 1.0)
        assert row["status"] == ("skipped" if k % 5 == 4 else "diagnosed")
        if k % 3 == 0 and k % 5 != 4:
            assert row["verdict"] == "stiction"
            assert row["S"] == pytest.approx(5.0, abs=2.0)
    assert found.counts["skipped"] == 4
    assert 7 <= found.counts["stiction"] <= 8  # of 13 good valves at most one is called sticky in ten minutes of data
    require_sound_ledger(found.folder, 24)


def test_rows_are_ranked_and_sum_up(found):
    priorities = [row["priority"] for row in found.rows]
    assert priorities == sorted(priorities, reverse=True)
    for row in found.rows:
        product = row["severity"] * row["confidence"] * row["importance"]
        assert row["priority"] == pytest.approx(0.0 if row.waits else product)
        assert row["severity"] == pytest.approx(1.0 - np.prod([1.0 - part for part in row["severity_parts"].values()]))
    assert found.worst(3) == found.rows[:3]
    assert found.to_frame().height == 24
    assert found.to_frame("pandas")["tag"].tolist() == [row["tag"] for row in found.rows]


def test_opened_audit_is_equal(found):
    require_same(st.open_audit(found.folder), found)


def test_second_call_does_nothing(plant, copy, found):
    seen: list[Progress] = []
    again = st.audit(plant, copy, workers=1, progress=seen.append)
    assert {one.stage for one in seen} == {"find", "plan", "screen", "diagnose", "group"}
    assert all(one.new == 0 for one in seen)
    require_same(again, found)


def test_changed_source_is_audited_again(tmp_path):
    source = write_plant(tmp_path / "plant.parquet", 3)
    first = st.audit(source, tmp_path / "audit", workers=1)
    write_plant(source, 3, samples=700)
    second = st.audit(source, tmp_path / "audit", workers=1)
    assert [row["samples"] for row in first.rows] == [600] * 3
    assert [row["samples"] for row in second.rows] == [700] * 3
    require_sound_ledger(second.folder, 3)


def test_budget_screens_all_and_the_next_run_does_the_rest(plant, tmp_path, found):
    some = st.audit(plant, tmp_path / "audit", workers=1, budget=0.001)
    assert some.counts["screened"] == 24
    assert some.counts["diagnosed"] == 0
    require_same(st.audit(plant, tmp_path / "audit", workers=2), found)


def test_interrupt_keeps_what_is_done(plant, tmp_path, found):
    def stop(progress):
        if progress.stage == "diagnose" and progress.new:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        st.audit(plant, tmp_path / "audit", workers=1, progress=stop)
    half = st.open_audit(tmp_path / "audit")
    assert half.run["finished"] is None
    assert half.counts["screened"] == 24 - 16
    require_same(st.audit(plant, tmp_path / "audit", workers=2), found)


def test_window_and_last(tmp_path, capsys):
    start = datetime(2026, 3, 2, 6, 0)

    def write(samples):
        dated = [st.LoopRecord(one.tag, one.dt, one.op, one.pv, one.sp, start=start) for one in records(2, 1200)]
        to_parquet([one.window(0, samples) for one in dated], tmp_path / "plant.parquet")

    write(600)
    first = st.audit(tmp_path / "plant.parquet", tmp_path / "audit", workers=1)
    assert first.rows[0]["end"] == "2026-03-02T06:10:00"
    write(1200)
    second = st.audit(tmp_path / "plant.parquet", tmp_path / "audit", workers=1, since="last")
    assert [(row["start"], row["samples"]) for row in second.rows] == [("2026-03-02T06:10:00", 600)] * 2
    assert len(second.read(second.rows[0]["tag"])) == 600
    nothing = st.audit(tmp_path / "plant.parquet", tmp_path / "audit", workers=1, since="last")
    assert nothing.run["nothing_since"] == "2026-03-02T06:20:00"
    assert nothing.rows == second.rows
    assert (
        cli.main(["audit", str(tmp_path / "plant.parquet"), "--out", str(tmp_path / "audit"), "--since", "last"]) == 0
    )
    assert "Nothing is new: no loop has samples after 2026-03-02 06:20." in capsys.readouterr().out
    part = st.audit(tmp_path / "plant.parquet", tmp_path / "audit", workers=1, until="2026-03-02T06:05")
    assert {row["samples"] for row in part.rows} == {300}
    trend = part.history(records(2)[0].tag)
    assert [row["end"][11:16] for row in trend] == ["06:05", "06:10", "06:20"]
    assert [row["S"] for row in trend[1:]] == pytest.approx([5.0, 5.0], abs=2.0)


def test_loops_that_fail_are_rows(tmp_path):
    """A broken loop, one without movement, and one that is too short, beside a good one."""
    good = records(1)[0]
    flat = st.LoopRecord("FLAT", 1.0, op=np.full(600, 50.0), pv=np.full(600, 3.0))
    short = st.LoopRecord("SHORT", 1.0, op=np.arange(20.0), pv=np.arange(20.0))
    for record in (good, flat, short):
        to_parquet(record, tmp_path / f"{record.tag.replace('/', '-')}.parquet")
    rows = {row["tag"]: row for row in st.audit(tmp_path, tmp_path.parent / "mixed", workers=1).rows}
    assert rows[good.tag]["verdict"] == "stiction"
    assert [rows[tag]["status"] for tag in ("FLAT", "SHORT")] == ["skipped", "skipped"]
    assert "20 samples" in rows["SHORT"]["reason"]


def test_loops_without_values_or_movement_are_skipped(tmp_path):
    """A signal without any value, and constant signals: both are skipped with a reason, and none fails."""
    good = records(1)[0]
    names = ("GOOD", "NO_PV", "NO_OP", "FLAT")
    signals = [(good.op, good.pv), (good.op, np.full(600, np.nan)), (np.full(600, np.nan), good.pv), (50.0, 3.0)]
    columns = {"t": np.arange(600)}
    for name, (op, pv) in zip(names, signals, strict=True):
        columns |= {f"{name}.OP": np.broadcast_to(op, 600), f"{name}.PV": np.broadcast_to(pv, 600)}
    pl.DataFrame(columns).write_csv(tmp_path / "plant.csv")
    found = st.audit(tmp_path / "plant.csv", tmp_path / "audit", workers=1)
    rows = {row["tag"]: row for row in found.rows}
    assert [rows[name]["status"] for name in names] == ["diagnosed", "skipped", "skipped", "skipped"]
    assert "PV" in rows["NO_PV"]["reason"]
    assert "OP" in rows["NO_OP"]["reason"]
    assert [row["tag"] for row in found.worst()] == ["GOOD"]
    assert {row["tag"] for row in found.not_judged} == {"NO_PV", "NO_OP", "FLAT"}


@pytest.mark.parametrize("rest", [1.0, 0.6])
def test_loop_at_its_limit_has_the_state_that_diagnose_gives_it(tmp_path, rest):
    """A set point out of reach: OP rests at 100 % all the time, or runs there and stays."""
    noise = np.random.default_rng(0).normal(0.0, 0.3, 2000)
    pv = 60.0 + 3.0 * np.sin(np.arange(2000) / 10.0) + noise
    op = (
        np.minimum(np.linspace(40.0, 40.0 + 60.0 / max(1.0 - rest, 1e-9), 2000), 100.0)
        if rest < 1.0
        else 100.0 + 0.0 * pv
    )
    record = st.LoopRecord("FIC-1", 1.0, op=op, pv=pv, sp=np.full(2000, 90.0), loop_type="flow")
    to_parquet(record, tmp_path / "plant.parquet")
    row = st.audit(tmp_path / "plant.parquet", tmp_path / "audit", workers=1).rows[0]
    assert row["loop_state"] == st.diagnose(record).loop_state.state != "in_control"
    assert row["saturated_share"] == pytest.approx(rest, abs=0.01)


def test_members_that_follow_a_source_come_after_it():
    """Three loops oscillate alike; the third has a sticky valve of its own."""
    roots = [{"tag": tag, "probability": p} for tag, p in (("A", 0.8), ("B", 0.16), ("C", 0.04))]
    group = {"number": 1, "leading_roots": ["A"], "roots": roots}
    verdicts = ("no_stiction", "no_stiction", "stiction", "no_stiction")
    rows = [
        LoopRow(tag, status="diagnosed", verdict=verdict, severity=0.5, confidence=0.9, priority=0.45, action="Act.")
        for tag, verdict in zip("ABCD", verdicts, strict=True)
    ]
    ranked = rank_members(rows, [group])
    # A gains the 0.8 of B's severity that is not B's own, times its own confidence.
    assert [row["priority"] for row in ranked] == pytest.approx([0.45 + 0.9 * 0.8 * 0.5, 0.2 * 0.45, 0.45, 0.45])
    assert [(row["group"], row["follows"]) for row in ranked] == [(1, None), (1, "A"), (1, None), (None, None)]
    follower = ranked[1]
    assert (follower.finding, follower.finding_text) == ("follows", "Oscillates with A")
    assert follower.next_step == follower.action == "Look again after A was put right."
    assert "1 loop follows" in ranked[0].priority_reason


def test_nothing_is_changed_before_a_test_tells_which_of_two_loops_is_the_source():
    roots = [{"tag": tag, "probability": p} for tag, p in (("A", 0.5), ("B", 0.4), ("C", 0.1))]
    group = {"number": 1, "leading_roots": ["A", "B"], "roots": roots, "period_s": 200.0}
    rows = [LoopRow(tag, status="diagnosed", finding="tuning", next_step="Halve the gain.") for tag in "ABC"]
    ranked = {row.tag: row for row in rank_members(rows, [group])}
    assert ranked["A"].next_step.startswith("Put A in manual for three periods: if B goes on swinging, B is the source")
    assert ranked["A"].test.replace("\u00a0", " ") == "10 min in manual"
    assert ranked["C"].next_step == "Look again after A or B was put right."
    assert "Halve" not in " ".join(row.next_step + row.action for row in ranked.values())


def test_comparison_shows_a_size_only_of_stiction_and_play(tmp_path):
    known = {"status": "diagnosed", "loop_state": "in_control", "oscillation_cause": "tuning", "verdict": "no_stiction"}
    sizes = {"tuning": 5.0, "sticks": 4.0}
    rows = [LoopRow("A", finding=code, S=S, S_low=S, S_high=S, **known) for code, S in sizes.items()]
    for row, shown in zip(rows, (None, 4.0), strict=True):
        now, before = (Audit(tmp_path, [one], [], {}, {}) for one in (row, replace(row, S_low=9.0, S_high=9.0)))
        [change] = compare_audits(now, before)
        assert (change["S"], change["S_before"]) == (shown, shown)
        assert change["change"] == ("same" if shown is None else "better")


@pytest.mark.parametrize("cause", ["external", "tuning"])
def test_load_from_outside_is_no_fault_of_the_loop(cause):
    """Of two loops that oscillate alike, the one that its tuning moves comes before one that a load moves."""
    causes = {"valve": 0.02, "tuning": 0.1, "external": 0.1} | {cause: 0.95}
    row = LoopRow("A", status="diagnosed", loop_state="in_control", probability=0.05, severity=0.9)
    row = replace(row, oscillating=True, oscillation_causes=causes)
    assert rank_row(row)["priority"] == pytest.approx(0.9 * (0.95 if cause == "tuning" else 0.1))


def test_loops_that_were_not_judged_come_last():
    rows = [
        LoopRow("FROZEN", status="skipped", loop_state="pv_frozen", severity=0.9),
        LoopRow("FAILED", status="error"),
        LoopRow("GOOD", status="diagnosed", loop_state="in_control", severity=0.1),
        LoopRow("SWAPPED", status="diagnosed", loop_state="signals_swapped", severity=0.1),
    ]
    ranked = rank_rows([rank_row(replace(row, probability=0.1)) for row in rows])
    assert [row["tag"] for row in ranked] == ["SWAPPED", "GOOD", "FROZEN", "FAILED"]
    assert [row["priority"] for row in ranked[2:]] == [0.0, 0.0]


def test_tags_that_the_source_does_not_have_are_named(plant, tmp_path):
    links, tags = tmp_path / "links.csv", [record.tag for record in records(2)]
    links.write_text(f"from,to\n{tags[0]},{tags[1].lower()}\n{tags[0]},TYPO-1\n")
    found = st.audit(plant, tmp_path / "audit", workers=1, loops="*-000", connections=links)
    assert found.missing_tags == {"map_tags": [], "connection_tags": ["TYPO-1"]}
    assert found.to_dict()["receipt"]["missing_tags"]["connection_tags"] == ["TYPO-1"]
    assert "TYPO-1" in write_audit_page(found).read_text()
    links.write_text("from,to\nTYPO-1,TYPO-2\n")
    with pytest.raises(RecordError, match=r"none of its 2 tags is a loop \(TYPO-1, TYPO-2"):
        st.audit(plant, tmp_path / "audit", workers=1, connections=links)


def test_rate_does_not_count_the_start_of_the_workers(monkeypatch):
    """16 loops each at 20, 22 and 26 s: 32 loops in the 6 s after the first batch."""
    moments = iter([20.0, 22.0, 26.0])
    monkeypatch.setattr("stiction.fleet.progress.time.monotonic", lambda: next(moments))
    rate = LoopRate()
    rates = [rate.add(16) or rate.per_second for _ in range(3)]
    assert rates == pytest.approx([0.0, 8.0, 32 / 6])
    assert rate.done == 48


def test_stop_finishes_the_loops_in_work(plant, tmp_path, found):
    stop = threading.Event()

    def watch(progress):
        if progress.stage == "diagnose" and progress.new:
            stop.set()

    half = st.audit(plant, tmp_path / "audit", workers=1, progress=watch, stop=stop)
    assert (half.run["finished"], half.counts["screened"]) == (None, 24 - 16)
    require_same(st.audit(plant, tmp_path / "audit", workers=2), found)


def test_cascade_and_connections_reach_the_ranking_of_sources(tmp_path):
    """The cascade is known from the column `master` of the map alone, the connection from its file alone."""
    rng = np.random.default_rng(0)
    phase = np.cumsum(2 * np.pi / 40 * (1.0 + 0.2 * rng.standard_normal(4000)))
    columns, lines = {"t": np.arange(4000)}, ["tag,loop,role,master"]
    for name, master in (("TIC-1", ""), ("FIC-1", "TIC-1"), ("LIC-9", "")):
        pv = np.sin(phase) + rng.normal(0.0, 0.1, 4000)
        columns |= {f"{name}.x": 50.0 - 2.0 * pv, f"{name}.y": pv}
        lines += [f"{name}.x,{name},op,{master}", f"{name}.y,{name},pv,{master}"]
    lines.append("LIC-8.x,LIC-8,op,")
    pl.DataFrame(columns).write_csv(tmp_path / "plant.csv")
    (tmp_path / "map.csv").write_text("\n".join(lines))
    (tmp_path / "links.csv").write_text("from,to\nFIC-1,LIC-9\n")
    found = st.audit(
        tmp_path / "plant.csv",
        tmp_path / "audit",
        map=tmp_path / "map.csv",
        connections=tmp_path / "links.csv",
        workers=1,
    )
    assert found.missing_tags["map_tags"] == ["LIC-8.x"]
    [group] = found.groups
    parts = {root["tag"]: {one["name"]: one["value"] for one in root["parts"]} for root in group["roots"]}
    assert {tag: part["cascade"] for tag, part in parts.items()} == {"FIC-1": 1.0, "TIC-1": -1.0, "LIC-9": 0.0}
    assert {tag: part["reach"] for tag, part in parts.items()} == {"FIC-1": 0.5, "TIC-1": 0.0, "LIC-9": 0.0}


def test_pattern_map_and_places(plant, tmp_path):
    places = find_loop_places([str(plant)], {}, pattern="u1/*")
    assert len(places) == 12
    csv = tmp_path / "one.csv"
    signal = records(1)[0]
    lines = ["t,A.CO,A.MEAS", *(f"{k},{op},{pv}" for k, (op, pv) in enumerate(zip(signal.op, signal.pv, strict=True)))]
    csv.write_text("\n".join(lines))
    mapping = tmp_path / "map.csv"
    mapping.write_text("tag,loop,role,low,high,area,importance\nA.CO,A,op,,,West,2.5\nA.MEAS,A,pv,100,200,West,2.5\n")
    [place] = find_loop_places([str(csv)], {"map": str(mapping)})
    assert (place.tag, place.area, place.importance, place.span) == ("A", "West", 2.5, (100.0, 200.0))
    row = st.audit(csv, tmp_path / "audit", map=mapping, workers=1).rows[0]
    assert row["importance"] == 2.5
    assert row["priority"] == pytest.approx(2.5 * row["severity"] * row["confidence"])


def with_row(audit, tag, **values):
    """The audit with other values in one row."""
    return replace(audit, rows=[replace(row, **values) if row.tag == tag else row for row in audit.rows])


def test_compare_and_labels(found, copy):
    audit = st.open_audit(copy)
    assert {row["change"] for row in compare_audits(audit, found)} == {"same"}
    sticky = [row["tag"] for row in audit.rows if row["verdict"] == "stiction"]
    good = {"finding": "nothing_found", "verdict": "no_stiction", "S": None, "S_low": None, "oscillation_cause": "none"}
    healed = with_row(audit, sticky[0], **good)
    changes = {one["tag"]: one["change"] for one in compare_audits(healed, found)}
    assert changes[sticky[0]] == "gone"
    assert {one["tag"]: one["change"] for one in compare_audits(found, healed)}[sticky[0]] == "new"
    repair = {
        "time": "2026-04-03T00:00:00",
        "time_s": 0.0,
        "kind": "repair",
        "S_before": 4.1,
        "S_after": 0.5,
        "probability": 0.9,
    }
    repaired = with_row(healed, sticky[0], history=(repair,))
    whys = {one["tag"]: one["why"] for one in compare_audits(repaired, found)}
    assert whys[sticky[0]].endswith("Repaired about 2026-04-03 00:00: S was 4.1 %, and is below 0.5 % since.")
    worse = with_row(audit, sticky[1], S=90.0, S_low=80.0, S_high=95.0)
    assert {one["tag"]: one["change"] for one in compare_audits(worse, found)}[sticky[1]] == "worse"
    assert confirmed_share(audit)["precision"] is None
    for tag, label in ((sticky[0], "repaired"), (sticky[1], "not stiction"), (sticky[2], "stiction")):
        append_label(copy, tag, label)
    assert confirmed_share(audit)["precision"] == pytest.approx(2 / 3)


def test_bad_input_names_what_to_do(plant, tmp_path, copy):
    with pytest.raises(RecordError, match="no such file"):
        st.audit(tmp_path / "none.csv", tmp_path / "a")
    with pytest.raises(ParameterError, match="matches none of the 24 loops"):
        st.audit(plant, tmp_path / "a", loops="XYZ*")
    with pytest.raises(ParameterError, match="budget = 'soon' is not a duration"):
        st.audit(plant, tmp_path / "a", budget="soon")
    with pytest.raises(ParameterError, match="not before until"):
        st.audit(plant, tmp_path / "a", since="2026-03-02", until="2026-03-01")
    with pytest.raises(ParameterError, match="needs a finished audit"):
        st.audit(plant, tmp_path / "a2", since="last")
    links = tmp_path / "links.csv"
    links.write_text("from;to\nA;B\n")
    with pytest.raises(RecordError, match=r"write from,to"):
        st.audit(plant, tmp_path / "a", connections=links)
    full = tmp_path / "full"
    full.mkdir()
    (full / "letter.txt").write_text("mine")
    with pytest.raises(RecordError, match="not an audit and not empty"):
        st.audit(plant, full)
    with pytest.raises(RecordError, match="is not an audit"):
        st.open_audit(full)
    with pytest.raises(RecordError, match=r"cannot be (used|opened) as a database of results"):
        st.audit(plant, tmp_path / "b", ledger="postgresql+psycopg://x:y@127.0.0.1:9/none")
    (copy / "audit.toml").write_text('format = 99\nversion = "9.9"\n')
    with pytest.raises(RecordError, match=r"audit of format 99, written by stiction 9\.9"):
        st.audit(plant, copy)


def test_record_is_cut_to_the_audited_time():
    t = np.arange(17280.0)
    record = st.LoopRecord("A", 5.0, op=t, pv=t)
    dated = st.LoopRecord("A", 5.0, op=t, pv=t, start=datetime(2026, 3, 2))
    cut = cut_time(dated, datetime(2026, 3, 2, 1), datetime(2026, 3, 2, 2))
    assert (len(cut), cut.start) == (720, datetime(2026, 3, 2) + timedelta(hours=1))
    with pytest.raises(RecordError, match="has no times"):
        cut_time(record, datetime(2026, 3, 2), None)

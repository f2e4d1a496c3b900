"""What `diagnose`, `diagnose_all` and `read` take and give in Python."""

from __future__ import annotations

import math

import pytest

import stiction as st


@pytest.fixture(scope="module")
def records():
    made = []
    for k, valve in enumerate((st.Kano(5.0, 2.0), st.Ideal())):
        loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
        made.append(st.simulate(loop, 150.0, 2000.0, seed=k, pv_start=148.0, op_start=50.0, tag=f"FIC-{k}"))
    return made


@pytest.fixture(scope="module")
def files(records, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plant")
    for record in records:
        record.to_parquet(folder / f"{record.tag}.parquet")
    return folder


def test_path_and_frame_of_one_loop_are_diagnosed_like_its_record(records, files):
    wanted = st.diagnose(records[0], methods=False)
    for source in (
        files / "FIC-0.parquet",
        str(files / "FIC-0.parquet"),
        records[0].to_frame(),
        records[0].to_frame("pandas"),
    ):
        found = st.diagnose(source, methods=False)
        assert (found.verdict, found.finding) == (wanted.verdict, wanted.finding) == ("stiction", "sticks")
        assert pytest.approx(wanted.S, abs=0.05) == found.S


def test_paths_of_one_loop_are_pooled_like_its_records(records, tmp_path):
    parts = [records[0].window(0, 1000), records[0].window(1000, 2000)]
    paths = [tmp_path / "a.parquet", tmp_path / "b.parquet"]
    for part, path in zip(parts, paths, strict=True):
        part.to_parquet(path)
    found, wanted = (st.diagnose(source, methods=False) for source in (paths, parts))
    assert found.probability == pytest.approx(wanted.probability, abs=1e-3)
    assert len(found.windows) == len(wanted.windows)


def test_source_of_several_loops_needs_a_tag(files):
    with pytest.raises(st.ParameterError, match=r"holds 2 loops \(FIC-0, FIC-1\); name one with tag='FIC-0', or use"):
        st.diagnose(files)
    assert st.diagnose(files, tag="FIC-1", methods=False).verdict != "stiction"
    with pytest.raises(st.ParameterError, match="tag = 'XIC-9' is not a loop of"):
        st.diagnose(files, tag="XIC-9")


def test_read_gives_loops_by_number_and_tag(files):
    found = st.read(files)
    assert found.tags == ["FIC-0", "FIC-1"]
    assert found["FIC-1"] is found[1]
    assert isinstance(found[:1], st.Records)
    assert repr(found) == "<Records: 2 loops, FIC-0, FIC-1>"
    assert "FIC-1" in found._repr_html_()
    assert found.to_frame()["tag"].unique(maintain_order=True).to_list() == found.tags
    with pytest.raises(st.ParameterError, match="No record has the tag 'FIC-7'; give one of the 2 tags"):
        found["FIC-7"]
    with pytest.raises(st.ParameterError, match="2 records have the tag 'FIC-0'; give a number: 0, 1"):
        st.Records([found[0], found[0]])["FIC-0"]


def test_all_loops_are_diagnosed(records, files):
    found = st.diagnose_all(files)
    assert found.tags == ["FIC-0", "FIC-1"]
    assert found["FIC-0"].verdict == "stiction"
    frame = found.to_frame()
    assert frame["finding_text"][0] == "Valve stiction"
    assert frame["S"].to_list() == [found[0].S, None]
    assert found.to_frame("pandas").columns.tolist() == frame.columns == found.to_frame("pyarrow").column_names
    assert repr(found) == "<Diagnoses: 2 loops, stiction in 1>"
    assert "Valve stiction" in found._repr_html_()
    assert [one.record.tag for one in st.diagnose_all(records)] == found.tags


def test_what_cannot_be_read_is_said(files, tmp_path):
    (tmp_path / "bad.csv").write_text("not a loop\n1\n")
    (tmp_path / "FIC-0.parquet").write_bytes((files / "FIC-0.parquet").read_bytes())
    found = st.diagnose_all(tmp_path)
    assert found.tags == ["FIC-0"]
    assert len(found.failures) == 1
    assert "bad.csv" in found.failures[0]


def test_empty_frame_and_costs_of_another_type_are_refused(records):
    pl = pytest.importorskip("polars")
    with pytest.raises(st.RecordError, match="export PV and OP of a loop"):
        st.diagnose(pl.DataFrame())
    with pytest.raises(st.ParameterError, match="is not a Costs"):
        st.diagnose(records[0], costs=(1.0, 1.0, 0.3))


def test_results_are_named_in_one_line(records):
    sticky, good = (st.diagnose(record, methods=False) for record in records)
    assert repr(sticky) == f"<Diagnosis FIC-0: sticks, probability of stiction >0.99, S = {sticky.S:.2g}\u00a0%>"
    assert math.isnan(good.S)
    assert math.isnan(good.J)
    assert "\n" not in repr(good)
    assert len(repr(good)) < 120
    assert repr(records[0]).startswith("<LoopRecord FIC-0: 2000 samples every 1 s")

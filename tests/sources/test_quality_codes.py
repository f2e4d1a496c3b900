"""Quality codes of all vendors: the same bad rows are found in each, whatever their share and the layout."""

from __future__ import annotations

from collections import Counter

import numpy as np
import polars as pl
import pytest

import stiction as st
from stiction.errors import RecordError
from stiction.sources.values.quality_codes import read_code_counts, read_quality

N = 600
RNG = np.random.default_rng(58)
PV = np.round(150 + 8 * np.sin(np.arange(N) / 9) + RNG.normal(size=N), 2)
OP = np.round(50 + 6 * np.cos(np.arange(N) / 9), 2)

VENDORS = {  # heading, good codes, codes of missing values, by the documents of the vendors
    "OPC DA": ("Quality", "192 216 219", "0 4 8 12 16 20 24 28 64 68 80 84 88"),
    "OPC DA in hex": ("OPCQuality", "0xC0 0xD8", "0x00 0x18 0x40 0x44"),
    "OPC HDA": ("Quality", "262336 524480", "262144 524352"),
    "OPC UA numbers": ("StatusCode", "0 1024", "2147483648 2150694912 1073741824 1083179008"),
    "OPC UA hex": ("Status", "0x00000000", "0x80310000 0x40920000 0x80050000"),
    "OPC UA names": ("Status", "Good GoodClamped Good_LocalOverride", "BadNoCommunication UncertainLastUsableValue"),
    "OPC UA wrapped": (
        "StatusCode", "StatusCode(Good) StatusCode(GoodClamped)", "StatusCode(BadSensorFailure) StatusCode(Uncertain)",
    ),
    "Ignition 7": ("Quality", "192 200", "0 8 256 300 301 500 900"),
    "Ignition 8 signed": ("Quality", "192", "-2147483132 -2147483136 1073742081 -2147483148"),
    "Ignition 8 unsigned": ("Quality", "192", "2147484164 2147484160 1073742081"),
    "PI Web API": ("Good", "True", "False"),
    "PI Web API questionable": ("Questionable", "False", "True"),
    "PI states": ("Status", "Good OK", "I/O~Timeout Bad~Input Scan~Off No~Data Pt~Created"),
    "PI status": ("Status", "0", "-254 -313 -5"),
    "IP.21 numbers": ("Status", "0 4", "1 2 5 6"),
    "IP.21 words": ("IP_TREND_QSTATUS", "Good Good/Modified", "Bad Suspect No~Status"),
    "PHD": ("Confidence", "100 95 60", "0 20 49"),
    "InSQL": ("Quality", "0 133", "1 16"),
    "InSQL detail": ("QualityDetail", "192 252 202", "24 249 10 28"),
    "PCS 7": ("QC", "128 164", "0 24 40 64 96 120"),
    "WinCC": ("QualityCode", "0x80", "0x4C 0x1C 0x18"),
    "CENTUM": ("DataStatus", "NR CLP+", "IOP- IOP OOP QST BAD NCOM O/S"),
    "CENTUM status": ("Status", "NR HI", "IOP QST"),
    "DeltaV words": ("Status", "GoodNonCascade", "UncertainNonSpecific BadCommFailureWithUsableValue"),
    "DeltaV numbers": ("ST", "128 192", "28 64 68 12"),
    "ioBroker": ("q", "0", "1 2 65 66 68 130 64"),
    "percent good": ("PercentGood", "100 98.5", "12.5 0 40"),
    "letters": ("Quality", "G", "B S U Q"),
    "stars": ("Quality", "~", "* ?"),
    "Proficy": ("Quality", "100", "0"),
    "RIO": ("Quality", "0", "2 1"),
    "texts": ("Quality", "OK", "Stale Bad No~Data Uncertain"),
    "valid": ("IsValid", "1", "0"),
    "valid in words": ("valid", "true", "false"),
    "old": ("Quality", "OK", "Old Unc"),
}  # fmt: skip


def bad_rows(share: float) -> np.ndarray:
    """Some stretches of bad rows."""
    bad = np.zeros(N, dtype=bool)
    length = int(share * N / 2)
    for start in (90, 350):
        bad[start : start + length] = True
    return bad


def codes_of(vendor: str, bad: np.ndarray, rng: np.random.Generator) -> tuple[str, list[str]]:
    heading, good, missing = VENDORS[vendor]
    pick = [np.array([code.replace("~", " ").strip() for code in text.split()]) for text in (good, missing)]
    rng.shuffle(pick[1])
    chosen = pick[1][: rng.integers(1, len(pick[1]) + 1)]
    return heading, np.where(bad, rng.choice(chosen, N), rng.choice(pick[0], N)).tolist()


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize(("share", "layout"), [(0.02, "wide"), (0.12, "long"), (0.4, "wide"), (0.3, "long")])
def test_rows_that_are_not_good_are_missing(vendor, share, layout, tmp_path):
    rng = np.random.default_rng([len(vendor), int(100 * share)])
    bad = bad_rows(share)
    heading, codes = codes_of(vendor, bad, rng)
    stamps = [f"2026-10-06 02:{k // 60:02d}:{k % 60:02d}" for k in range(N)]
    path = tmp_path / "a.csv"
    if layout == "wide":
        rows = zip(stamps, PV, codes, OP, codes, strict=True)
        text = [f"Time,FIC1.PV,FIC1.PV.{heading},FIC1.OP,FIC1.OP.{heading}", *(",".join(map(str, row)) for row in rows)]
    else:
        text = [f"tag,time,value,{heading}"]
        for tag, x in (("FIC1.PV", PV), ("FIC1.OP", OP)):
            text += [",".join(map(str, row)) for row in zip([tag] * N, stamps, x, codes, strict=True)]
    path.write_text("\n".join(text))
    [record] = st.read(path)
    np.testing.assert_array_equal(np.isnan(record.pv), bad)
    np.testing.assert_array_equal(np.isnan(record.op), bad)


def test_uncertain_values_are_used_when_asked_for():
    counts = Counter({"192": 80, "64": 15, "0": 5})
    assert read_code_counts(counts)[0].missing == {"64", "0"}
    assert read_code_counts(counts, keep_uncertain=True)[0].missing == {"0"}


def test_a_heading_beside_the_column_chooses_the_scheme():
    counts = Counter({"0": 50, "1": 50})
    assert len(read_code_counts(counts)) == 2
    [one] = read_code_counts(counts, "q")
    assert one.missing == {"1"}
    assert "ioBroker" in one.note
    [one] = read_code_counts(counts, "quality", {"QUALITYDETAIL", "TIME"})
    assert "InSQL" in one.note


def test_codes_that_no_scheme_knows_are_read_in_two_ways():
    readings = read_code_counts(Counter({"RUN": 95, "STOP": 5}))
    assert [one.missing for one in readings] == [{"STOP"}, frozenset()]
    readings = read_code_counts(Counter({"RUN": 60, "STOP": 40}))
    assert [one.missing for one in readings] == [frozenset(), {"STOP"}]


def test_columns_of_one_kind_share_their_scheme():
    columns = {
        "pv quality": ("PV.Quality", pl.Series(["0"] * 9 + ["1"])),
        "op quality": ("OP.Quality", pl.Series(["1"] * 10)),
    }
    first, *_ = read_quality(columns)
    assert [int(mask.sum()) for mask in first.masks.values()] == [0, 0] or first.masks["pv quality"].sum() == 9


def test_given_codes_are_good_and_all_others_bad():
    columns = {"quality": ("Status", pl.Series(["0", "4", "7", "7.0", ""]))}
    [one] = read_quality(columns, good_codes={"quality": ["4", "7"]})
    assert one.masks["quality"].tolist() == [True, False, False, False, False]
    with pytest.raises(RecordError, match=r"names no code.*has 0, 4, 7"):
        read_quality(columns, good_codes={"quality": ["99"]})


def test_a_single_good_row_between_bad_ones_is_bad():
    codes = ["192"] * 20 + ["0", "0", "0", "0", "192"] * 6 + ["192"] * 20
    [one] = read_quality({"quality": ("Quality", pl.Series(codes))})
    assert one.masks["quality"].sum() == 24 + 5
    [one] = read_quality({"quality": ("Quality", pl.Series(["192", "0"] * 30))})
    assert one.masks["quality"].sum() == 30


def loop(seed: int) -> st.LoopRecord:
    stick = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.simulate(stick, sp=10.0, duration=2000.0, loop_type="flow", seed=seed)


def test_readings_that_disagree_ask_for_the_good_codes(tmp_path):
    record = loop(1)
    codes = np.where(np.arange(len(record)) % 1000 < 450, 1, 0)
    pv = np.where(codes == 1, record.pv[0], record.pv)
    path = tmp_path / "FIC1.csv"
    rows = zip(range(len(record)), pv.round(3), record.op.round(3), codes, strict=True)
    path.write_text("time_s,PV,OP,Quality\n" + "\n".join(",".join(map(str, row)) for row in rows))
    [read] = st.read(path)
    assert len(read.other_readings) == 1
    assert len(read.window(0, 500).other_readings[0]) == 500
    found = st.diagnose(read)
    assert found.verdict == "undecided"
    assert "good_codes" in found.reason
    assert "InSQL" in found.reason
    with pytest.raises(RecordError, match="several ways"):
        read.to_parquet(tmp_path / "a.parquet")
    for ask in (st.identify, st.compare_models):
        with pytest.raises(RecordError, match=r"can be read in 2 ways.*good_codes=.*InSQL"):
            ask(read)
    [read] = st.read(path, good_codes="0")
    assert not read.other_readings
    assert np.isnan(read.pv).sum() == (codes == 1).sum()
    assert st.diagnose(read).verdict == "stiction"


def test_readings_that_agree_are_reported(tmp_path):
    record = loop(2)
    path = tmp_path / "FIC1.csv"
    rows = zip(
        record.pv.round(3), record.op.round(3), np.where(np.arange(len(record)) == 7, "STOP", "RUN"), strict=True
    )
    path.write_text(
        "time_s,PV,OP,Status\n" + "\n".join(f"{k},{pv},{op},{code}" for k, (pv, op, code) in enumerate(rows))
    )
    found = st.diagnose(st.read(path)[0])
    assert found.verdict == "stiction"
    assert any("same with each reading" in note for note in found.record.provenance.assumptions)


def test_the_map_names_the_good_codes(tmp_path):
    path, plan = tmp_path / "FIC1.csv", tmp_path / "map.csv"
    path.write_text("time_s,PV,OP,X\n" + "\n".join(f"{k},{PV[k]},{OP[k]},{k % 10 // 8}" for k in range(N)))
    plan.write_text("tag,loop,role,good\nPV,FIC1,pv,\nOP,FIC1,op,\nX,FIC1,quality,0;2\n")
    [record] = st.read(path, map=plan)
    assert np.flatnonzero(np.isnan(record.pv)).tolist() == [k for k in range(N) if k % 10 > 7]
    plan.write_text("tag,loop,role,good\nPV,FIC1,pv,0\nOP,FIC1,op,\n")
    with pytest.raises(RecordError, match="give it for a quality column"):
        st.read(path, map=plan)


def test_a_column_of_a_long_table_that_is_not_used_is_named(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"FIC1.{tag},{k},{x[k]},{k % 3}" for tag, x in (("PV", PV), ("OP", OP)) for k in range(N)]
    path.write_text("\n".join(["tag,time_s,value,batch", *rows]))
    [record] = st.read(path)
    assert "Columns of the long table that are not used: batch." in record.provenance.assumptions

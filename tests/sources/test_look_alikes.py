"""Columns that look like a clock, a tag or a quality and are none, and signals that end at times of their own."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError

START = datetime(2026, 2, 1, 10)
N = 600
K = np.arange(N)
PV = np.round(200 + 9 * np.cos(K / 9.5), 3)
OP = np.round(50 + 6 * np.sin(K / 9.5), 3)


def stamp(seconds: float, start: datetime = START) -> str:
    return (start + timedelta(seconds=float(seconds))).isoformat(" ")


def lines(header, *columns):
    return "\n".join([header, *(",".join(str(cell) for cell in row) for row in zip(*columns, strict=True))])


def guesses(record):
    return " ".join(record.provenance.assumptions)


@pytest.mark.parametrize("header", ["time_s,PV,T,OP", "time_s,PV,T [degC],OP", "time_s,PV,Seconds,OP"])
def test_a_temperature_between_pv_and_op_is_no_clock(read_text, header):
    [record] = read_text(lines(header, K, PV, np.round(50 + 2 * np.cos(K / 9.5), 1), OP))
    assert (record.dt, len(record)) == (1.0, N)
    np.testing.assert_array_equal(record.op, OP)


@pytest.mark.parametrize("sign", [1, -1])
def test_local_time_beside_utc_over_a_change_of_the_clock(read_text, sign):
    start = datetime(2026, 3, 29, 0, 50) if sign > 0 else datetime(2026, 10, 25, 0, 50)
    utc = [stamp(10 * k, start) + "Z" for k in K]
    local = [stamp(10 * k + 3600 + sign * 3600 * (k >= 60), start) for k in K]
    [record] = read_text(lines("UTC,PV,Local time,OP", utc, PV, local, OP))
    assert (record.dt, len(record)) == (10.0, N)
    np.testing.assert_array_equal(record.op, OP)


def test_a_clock_that_is_only_late_is_one_of_its_own(read_text):
    text = lines("Time,FIC.PV,Time,FIC.OP", *(map(str, x) for x in zip(*pair_rows(20), strict=True)))
    [record] = read_text(text)
    assert len(record) == N
    assert np.isnan(record.op[:20]).all()
    np.testing.assert_array_equal(record.op[20:], OP[20:])


def pair_rows(late):
    return [(stamp(k), PV[k], stamp(k + late), OP[k + late]) if k + late < N else (stamp(k), PV[k], "", "") for k in K]


@pytest.mark.parametrize(
    ("status", "bad"),
    [
        (["Running"] * (N - 1) + ["Bad"], [N - 1]),
        (["OK"] * 100 + ["Running"] * 500, []),
        (["NORMAL"] * 300 + ["HI ALARM"] * 300, []),
        (["1"] * 400 + ["2"] * 200, []),
        (["192.0"] * 590 + ["0.0"] * 10, list(range(590, 600))),
    ],
)
def test_a_status_of_the_plant_is_no_quality(read_text, status, bad):
    [record] = read_text(lines("time_s,PV,OP,Status", K, PV, OP, status))
    assert np.flatnonzero(np.isnan(record.pv)).tolist() == bad


@pytest.mark.parametrize("header", ["Time,PV,OP,Name", "Time,PV,OP,Loop", "Time,PV,OP,Controller"])
@pytest.mark.parametrize(
    "names",
    [
        ["Alarm" if 100 <= k < 115 else "" for k in K],
        ["A12" if k < 200 else "B7" if k < 400 else "C1" for k in K],
        ["Smith" if k // 100 % 2 else "Jones" for k in K],
        ["AUTO" if k < 300 else "MAN" for k in K],
    ],
)
def test_names_that_are_no_tags_split_nothing(read_text, header, names):
    [record] = read_text(lines(header, map(stamp, K), PV, OP, names))
    assert len(record) == N
    assert "does not name loops" in guesses(record)


def test_loops_with_clocks_of_their_own_are_laid_out_each_by_itself(read_text):
    rows = [f"{stamp(k)},{PV[k]},{OP[k]},{stamp(5 * k)},{2 * PV[k]},{OP[k]}" for k in K]
    flow, level = read_text("\n".join(["Time,FIC.PV,FIC.OP,Time,LIC.PV,LIC.OP", *rows]))
    assert [(one.tag, one.dt, len(one)) for one in (flow, level)] == [("FIC", 1.0, N), ("LIC", 5.0, N)]
    np.testing.assert_array_equal(flow.op, OP)
    np.testing.assert_array_equal(level.pv, 2 * PV)


def test_what_ends_halfway_does_not_stand_until_the_end(read_text):
    rows = [f"{stamp(k)},{PV[k]}," + (f"{stamp(k)},{OP[k]}" if k < 300 else ",") for k in K]
    [record] = read_text("\n".join(["Time,FIC.PV,Time,FIC.OP", *rows]))
    np.testing.assert_array_equal(record.op[:300], OP[:300])
    assert np.isnan(record.op[330:]).all()


def test_a_value_of_a_sparse_table_does_not_stand_over_a_gap(read_text):
    op = [x if k % 3 == 0 and not 250 <= k < 550 else "" for k, x in enumerate(OP)]
    [record] = read_text(lines("Time,PV,OP", map(stamp, K), PV, op))
    np.testing.assert_array_equal(record.op[:250], OP[K[:250] // 3 * 3])
    assert np.isnan(record.op[320:549]).all()


def test_a_set_point_of_a_sparse_table_stands_until_the_next(read_text):
    op = [x if k % 3 == 0 else "" for k, x in enumerate(OP)]
    sp = [200.0 if k == 0 else 205.0 if k == 300 else "" for k in K]
    [record] = read_text(lines("Time,PV,OP,SP", map(stamp, K), PV, op, sp))
    assert record.sp.tolist() == [200.0] * 300 + [205.0] * 300


def test_pairs_with_stamps_to_the_minute_are_spread(read_text):
    clock = [stamp(10 * k)[:16] for k in K]
    rows = [f"{clock[k]},{PV[k]}," + (f"{clock[k]},{OP[k]}" if k < N - 1 else ",") for k in K]
    [record] = read_text("\n".join(["Time,FIC.PV,Time,FIC.OP", *rows]))
    assert (record.dt, len(record)) == (10.0, N)
    assert "share each stamp" in guesses(record)


@pytest.mark.parametrize(
    ("start", "first"), [(datetime(2026, 4, 4, 23, 0), 360), (datetime(2025, 10, 26, 2, 0, 10), 360)]
)
def test_the_hour_that_comes_twice(read_text, start, first):
    # Chile: Saturday 24:00 is Saturday 23:00. Central Europe: Sunday 03:00 is 02:00, here a sample later.
    [record] = read_text(lines("Time,PV,OP", [stamp(10 * k - 3600 * (k >= first), start) for k in K], PV, OP))
    assert (record.dt, len(record), record.provenance.clock_jumps) == (10.0, N, 1)
    np.testing.assert_array_equal(record.op, OP)


def test_the_period_of_jittered_pairs_is_a_short_number(read_text):
    late = 10.0 * K + np.random.default_rng(1).uniform(-0.3, 0.3, N)
    text = lines("Time,FIC.PV,Time,FIC.OP", map(stamp, late), PV, map(stamp, late + 3.0), OP)
    [record] = read_text(text)
    assert record.dt == 10.0
    assert abs(len(record) - N) <= 1


def test_refusals_in_words(read_text):
    with pytest.raises(RecordError, match="without a time column"):
        read_text("\n".join(["Tag,Value", *(f"FIC.{'PO'[k % 2]}{'VP'[k % 2]},{stamp(k)}" for k in K)]))
    with pytest.raises(RecordError, match=r"among the columns Flow, Valve, Ctrl"):
        read_text(lines("Time,Flow,Valve,Ctrl", map(stamp, K), PV, OP, ["AUTO"] * N))
    with pytest.raises(RecordError, match=r"all values of FIC.OP are flagged as bad"):
        read_text(lines("time_s,FIC.PV,FIC.OP,FIC.OP.Quality", K, PV, OP, ["Bad"] * N))


def test_a_loop_whose_clock_stands_is_left_out_and_said(read_text):
    good = [f"F1,{stamp(k)},{PV[k]},{OP[k]}" for k in range(300)]
    stands = [f"F2,{stamp(0)},{PV[k]},{OP[k]}" for k in range(300)]
    [record] = read_text("\n".join(["Tag,Time,PV,OP", *good, *stands]))
    assert (record.tag, len(record)) == ("F1", 300)
    assert "Left out: stream, line 2: all time stamps are equal" in guesses(record)

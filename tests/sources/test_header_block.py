"""What exporters write above a table: titles, key and value lines, tag tables, several header rows."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError

START = datetime(2026, 2, 1, 10, 0, 0)
NAMES = "Time,FIC101.PV,FIC101.SP,FIC101.OP"
N = 60

BLOCKS = {
    "one key and value": "Trend export\nStart time,2026-02-01 10:00:00\n\n",
    "keys and values": "Trend export\nStart time,2026-02-01 10:00:00\nInterval [s],1\n\n",
    "without a blank line": "Trend export\nStart time,2026-02-01 10:00:00\nInterval [s],1\nSamples,60\n",
    "padded": "Trend export,,,\nFrom,2026-02-01 10:00:00,,\nTo,2026-02-01 10:00:59,,\nInterval [s],1,,\n,,,\n",
    "padded, no blank line": "Trend export,,,\nFrom,2026-02-01 10:00:00,,\nInterval [s],1,,\n",
    "comments": "# start,2026-02-01 10:00:00\n# interval,1\n",
    "a lone date": "2026-02-01 10:00:00\n\n",
    "a lone padded date": "2026-02-01 10:00:00,,,\n",
    "a lone number": "60\n",
    "a tag table": "Tag,Description,Low,High\nFIC101.PV,Feed flow,0,300\nFIC101.OP,Feed valve,0,100\n\n",
    "a tag table with more numbers": "Tag,No,Low,High\nFIC101.PV,1,0,300\nFIC101.SP,2,0,300\nFIC101.OP,3,0,100\n\n",
    "a tag table right above": "Tag,Name of the signal,Low,High\nFIC101.PV,Feed flow,0,300\nFIC101.OP,Valve,0,100\n",
}


def values(n=N):
    k = np.arange(n)
    return np.round(50 + 3 * np.sin(k / 5), 3), np.full(n, 50.5), np.round(40 + 4 * np.cos(k / 5), 3)


def rows(n=N, stamp=lambda k: str(START + timedelta(seconds=int(k))), mark=",", point="."):
    cells = (
        [stamp(k), *(str(x).replace(".", point) for x in row)] for k, row in enumerate(zip(*values(n), strict=True))
    )
    return "".join(mark.join(row) + "\n" for row in cells)


@pytest.mark.parametrize("n", [10, N])
@pytest.mark.parametrize("block", BLOCKS)
def test_blocks_above_the_table(block, n, read_text):
    [record] = read_text(f"{BLOCKS[block]}{NAMES}\n{rows(n)}")
    pv, sp, op = values(n)
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC101", 1.0, START, n)
    np.testing.assert_array_equal(record.pv, pv)
    np.testing.assert_array_equal(record.sp, sp)
    np.testing.assert_array_equal(record.op, op)
    written = sum(bool(line.strip(",")) for line in BLOCKS[block].splitlines())
    told = [note for note in record.provenance.assumptions if "above the header" in note]
    assert len(told) == 1
    assert int(told[0].split()[0]) in (written, written - 1)  # a row of titles may be taken for a row of the header
    assert record.provenance.pv_unit == ""


@pytest.mark.parametrize("block", ["keys and values", "padded", "a lone padded date", "a tag table"])
def test_blocks_above_a_table_of_seconds(block, read_text):
    [record] = read_text(f"{BLOCKS[block]}time_s,FIC101.PV,FIC101.SP,FIC101.OP\n{rows(stamp=lambda k: str(2 * k))}")
    assert (record.tag, record.dt, len(record)) == ("FIC101", 2.0, N)
    np.testing.assert_array_equal(record.op, values()[2])


def test_a_block_above_rows_without_time(read_text):
    pv, _, op = values()
    text = "Trend export\nStart time,2026-02-01 10:00:00\nInterval [s],1\n\nPV,OP\n"
    text += "".join(f"{a},{b}\n" for a, b in zip(pv, op, strict=True))
    [record] = read_text(text, dt=1.0)
    np.testing.assert_array_equal(record.pv, pv)


def test_a_german_block(read_text):
    def stamp(k):
        return (START + timedelta(seconds=int(k))).strftime("%d.%m.%Y %H:%M:%S")

    block = "Trendexport\nVon;01.02.2026 10:00:00\nBis;01.02.2026 10:00:59\nIntervall [s];1,0\n\n"
    text = f"{block}Zeit;FIC101.PV;FIC101.SP;FIC101.OP\n{rows(stamp=stamp, mark=';', point=',')}"
    [record] = read_text(text)
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC101", 1.0, START, N)
    np.testing.assert_array_equal(record.pv, values()[0])


HEADERS = {
    "names first": [
        NAMES,
        "Local,Feed flow,Feed flow set point,Feed valve",
        "s,t/h,t/h,%",
        "Time,Double,Double,Double",
    ],
    "names last": ["Local,Feed flow,Feed flow set point,Feed valve", ",t/h,t/h,%", "Time,Double,Double,Double", NAMES],
    "names between": [
        "Local,Feed flow,Feed flow set point,Feed valve",
        NAMES,
        ",t/h,t/h,%",
        "-,Double,Float32,Float32",
    ],
    "with ranges": [
        NAMES,
        "Description,Feed flow,Feed flow set point,Feed valve",
        "Unit,t/h,t/h,%",
        "Low,0,0,0",
        "High,300,300,9",
    ],
}


@pytest.mark.parametrize("case", HEADERS)
def test_four_header_rows(case, read_text):
    [record] = read_text("\n".join(HEADERS[case]) + "\n" + rows())
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC101", 1.0, START, N)
    np.testing.assert_array_equal(record.op, values()[2])
    assert record.provenance.pv_unit == "t/h"


MERGED = {
    "merged": [",FIC101,,", "Time,PV,SP,OP"],
    "merged, time above": ["Time,FIC101,,", ",PV,SP,OP"],
    "merged, units": [",FIC101,,", "Time,PV,SP,OP", "s,t/h,t/h,%"],
    "merged, of no letters": [",Feed,,", "Time,PV,SP,OP"],
    "repeated": [",FIC101,FIC101,FIC101", "Time,PV,SP,OP"],
    "a tag in the corner": ["FIC101,,,", "Time,PV,SP,OP"],
    "under a title": ["Trend of unit 3,,,", ",FIC101,,", "Time,PV,SP,OP"],
    "in German": [",FIC101,,", "Zeit,Istwert,Sollwert,Stellgrad"],
}


@pytest.mark.parametrize("case", MERGED)
def test_a_tag_over_the_signals_of_one_loop(case, read_text):
    [record] = read_text("\n".join(MERGED[case]) + "\n" + rows())
    assert record.tag == ("Feed" if "no letters" in case else "FIC101")
    assert record.provenance.pv_unit == ("t/h" if "units" in case else "")
    np.testing.assert_array_equal(record.sp, values()[1])
    np.testing.assert_array_equal(record.op, values()[2])


@pytest.mark.parametrize(
    "above", ["Trend of unit 3,,,", ",t/h,t/h,%", ",Double,Double,Double", ",filtered,raw,raw", ",,,%"]
)
def test_what_is_no_tag_over_the_signals_names_no_loop(above, read_text):
    [record] = read_text(f"{above}\nTime,PV,SP,OP\n{rows()}")
    assert record.tag == "stream"


def test_line_ends_within_a_heading(read_text):
    block = '"Trend\nexport"\n\nTime,"FIC101.PV\n[t/h]",FIC101.SP,"FIC101.OP\n[%]"\n'
    [record] = read_text(block + rows())
    assert (record.tag, record.start, len(record), record.provenance.rows) == ("FIC101", START, N, N)
    assert record.provenance.assumptions == ("1 line above the header is not used.",)


def test_influx_annotations(read_text):
    block = (
        "#group,false,false,true,true,false,false,false\n"
        "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,double\n"
        "#default,_result,,,,,,\n"
    )
    ends = "2026-02-01T10:00:00Z,2026-02-01T11:00:00Z"
    pv, _, op = values()
    lines = (f",,0,{ends},{START + timedelta(seconds=k):%Y-%m-%dT%H:%M:%SZ},{pv[k]},{op[k]}\n" for k in range(len(pv)))
    text = block + ",result,table,_start,_stop,_time,FIC101.PV,FIC101.OP\n" + "".join(lines)
    [record] = read_text(text)
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC101", 1.0, START.replace(tzinfo=UTC), N)
    np.testing.assert_array_equal(record.pv, pv)
    assert record.provenance.pv_unit == ""


@pytest.mark.parametrize("text", ["Bad", "Bad Input", "Not Available", "[-11059] No Good Data"])
@pytest.mark.parametrize("first", [0, 3])
def test_texts_in_the_first_rows_are_rows_of_data(text, first, read_text):
    lines = rows().splitlines()
    for k in range(first, first + 12):
        lines[k] = f"{START + timedelta(seconds=k)},{text},{text},{text}"
    [record] = read_text(f"{BLOCKS['keys and values']}{NAMES}\n" + "\n".join(lines) + "\n")
    assert (len(record), record.start) == (N, START)
    assert np.flatnonzero(np.isnan(record.pv)).tolist() == list(range(first, first + 12))
    assert record.provenance.bad_values[text] == 36


def test_sparse_rows_are_rows_of_data(read_text):
    lines = rows().splitlines()
    pv, _, op = values()
    for k in range(N):  # PV and OP stored by turns
        lines[k] = f"{START + timedelta(seconds=k)},{pv[k]},," if k % 2 else f"{START + timedelta(seconds=k)},,,{op[k]}"
    [record] = read_text(f"{BLOCKS['padded']}{NAMES}\n" + "\n".join(lines) + "\n")
    assert record.start == START
    assert len(record) == N // 2  # each has its own times, every second one
    np.testing.assert_array_equal(record.op, op[::2])


def test_a_header_that_comes_again_on_each_page_costs_no_row(read_text):
    lines = rows().splitlines()
    text = "\n".join([NAMES, *lines[:25], NAMES, *lines[25:50], NAMES, *lines[50:]]) + "\n"
    [record] = read_text(text)
    assert (record.start, len(record)) == (START, N)
    np.testing.assert_array_equal(record.op, values()[2])


def test_a_block_without_a_header_is_refused_with_the_line_of_the_data(read_text):
    with pytest.raises(RecordError, match="line 4: there is no header above the 4 columns"):
        read_text("Trend export\nInterval [s],1\n\n" + rows())


@pytest.mark.parametrize("names", ["time_s,PV,OP", '"time_s","PV","OP"'])
def test_a_column_without_a_name_is_refused_and_an_empty_one_is_not(names, read_text):
    # R writes row numbers so; a name further left, PV would be read as OP.
    pv, _, op = values()
    lines = [f"{k + 1},{2 * k},{x},{y}" for k, (x, y) in enumerate(zip(pv, op, strict=True))]
    with pytest.raises(RecordError, match="has 3 names for 4 columns; write one name above each column"):
        read_text("\n".join([names, *lines]))
    [record] = read_text("\n".join([f"row,{names}", *lines]))
    assert record.dt == 2.0
    np.testing.assert_array_equal(record.op, op)
    [record] = read_text("\n".join([names, *(f"{line[line.index(',') + 1 :]}," for line in lines)]))
    np.testing.assert_array_equal(record.op, op)


def test_a_mode_behind_empty_cells_is_no_zone_of_the_clock(read_text):
    lines = [line.replace(",", "\t") + "\tAUTO" for line in rows(10).splitlines()]
    lines[:5] = [line.split("\t")[0] + "\t\t\t\tAUTO" for line in lines[:5]]
    [record] = read_text("\n".join([f"{NAMES},FIC101.MODE".replace(",", "\t"), *lines]) + "\n")
    assert (record.tag, record.dt, record.start, len(record)) == ("FIC101", 1.0, START, 10)
    np.testing.assert_array_equal(record.op[5:], values(10)[2][5:])

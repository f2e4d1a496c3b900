"""Every bad input is one clear sentence that names the file, the place and the remedy; never a traceback."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import ParameterError, RecordError
from stiction.records import summarise
from stiction.sources import read

ROWS = "".join(f"{k},{50 + k % 7},{40 + k % 5}\n" for k in range(60))
BAD = {
    "empty": (b"", "is empty; export"),
    "only blanks": (b"\n \n\t\n", "is empty; export"),
    "binary": (bytes(range(256)) * 20, "is binary, not text; export"),
    "Excel": (b"PK\x03\x04" + b"x" * 500, "is damaged or cut off"),
    "MATLAB": (b"MATLAB 5.0 MAT-file" + b"\0" * 500, "is damaged .*save it again in MATLAB"),
    "gzip": (b"\x1f\x8b\x08" + b"x" * 500, "is damaged or cut off"),
    "prose": (b"Dear all,\nplease find the trend attached.\n", "no row of numbers"),
    "header only": (b"time_s,PV,OP\n", "no row of numbers"),
    "one column": (b"PV\n" + b"5\n" * 50, "no loop with OP and PV.*columns="),
    "no OP": (f"time_s,PV,XX\n{ROWS}".encode(), "no loop with OP and PV.*PV, XX.*columns="),
    "no header": (ROWS.encode(), "line 1: there is no header.*columns="),
    "two PV": (f"PV,PV,OP\n{ROWS}".encode(), "'PV' and 'PV' are both the PV"),
    "no time": (f"foo,PV,OP\n{ROWS}".encode(), "no column was recognised as the time.*dt in"),
    "one row": (b"time_s,PV,OP\n0,1,2\n", "has 1 rows? of data; 10 or more"),
    "three rows": (b"time_s,PV,OP\n0,1,2\n1,2,3\n2,3,4\n", "has 3 rows of data; 10 or more"),
    "all missing": (
        b"time_s,PV,OP\n" + b"".join(b"%d,Bad,5\n" % k for k in range(50)),
        "column PV: contains no number",
    ),
    "text as OP": (
        b"time_s,PV,OP\n" + b"".join(b"%d,5.5,open\n" % k for k in range(50)),
        "column OP: contains no number.*'open'",
    ),
    "time stands still": (b"time_s,PV,OP\n" + b"5,1,2\n" * 50, "all time stamps are equal; give dt"),
    "time not understood": (
        b"Time,PV,OP\n" + b"soon,1,2\n" * 50,
        "line 2: 'soon' is not a known form of time stamp; give",
    ),
    "a century's gap": (
        b"time_s,PV,OP\n" + b"".join(b"%d,1,2\n" % (k if k < 30 else k + 10**9) for k in range(60)),
        "rows 30 and 31 .* 1e\\+09 s apart.*cut the file",
    ),
    "decimal comma between commas": (
        b"time_s,PV,OP\n" + b"".join(b"%d,1,5,2,5\n" % k for k in range(50)),
        "decimal comma between commas.*semicolons",
    ),
    "a very long line": (b"1," * 2_000_000, "line 1: is longer than 1000000 characters"),
    "an open quote": (b'time_s,PV,OP\n"' + b"1" * 500_000, "quote that never closes"),
    "a later open quote": (
        f'time_s,PV,OP\n{ROWS * 5}"{ROWS * 500}'.encode(),
        "line [0-9]+: cannot be split into columns",
    ),
    "long table, no OP": (
        b"tag,timestamp,value\n" + b"F.PV,2026-01-01,5\nF.PV,2026-01-02,6\n" * 9,
        "no loop with OP and PV",
    ),
    "long table, no time": (b"tag,value\n" + b"F.PV,5\n" * 50, "without a time column"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_content(case):
    data, message = BAD[case]
    began = time.perf_counter()
    with pytest.raises(RecordError, match=message) as caught:
        read(io.BytesIO(data))
    assert str(caught.value).startswith("stream")
    assert "\n" not in str(caught.value)
    assert time.perf_counter() - began < 5.0


def test_bad_paths(tmp_path):
    with pytest.raises(RecordError, match=r"nothing.csv: no such file"):
        read(tmp_path / "nothing.csv")
    with pytest.raises(RecordError, match=r"is a folder without files; give the folder"):
        read(tmp_path)
    with pytest.raises(RecordError, match=r"cannot be read"):
        read("a\0b")
    with pytest.raises(RecordError, match=r"cannot read an object of type int"):
        read(5)
    with pytest.raises(RecordError, match=r"opened as text; open it with mode 'rb'"):
        read(io.StringIO("time_s,PV,OP\n"))


@pytest.mark.skipif(
    os.name != "posix" or (hasattr(os, "geteuid") and os.geteuid() == 0), reason="root may read anything"
)
def test_no_rights(tmp_path):
    path = tmp_path / "locked.csv"
    path.write_text("x")
    path.chmod(0)
    with pytest.raises(RecordError, match="cannot be read"):
        read(path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dt": -1.0}, "dt = -1 s is not positive"),
        ({"decimal": "x"}, "decimal = 'x'"),
        ({"delimiter": "::"}, "delimiter = '::'"),
        ({"op_range": (20, 4)}, "op_range"),
        ({"loop_type": "steam"}, "loop_type 'steam' is unknown"),
    ],
)
def test_bad_options(options, message):
    with pytest.raises(ParameterError, match=message):
        read(io.BytesIO(f"time_s,PV,OP\n{ROWS}".encode()), **options)


def test_bad_time_format():
    with pytest.raises(RecordError, match="time_format"):
        read(io.BytesIO(b"Time,PV,OP\n" + b"soon,1,2\n" * 50), time_format="%Q")


class Endless(io.RawIOBase):
    """A stream without end that counts what was taken from it."""

    def __init__(self, pattern: bytes) -> None:
        self.pattern, self.taken = pattern, 0

    def read(self, size: int = -1) -> bytes:
        assert size > 0, "an endless stream was read whole"
        self.taken += size
        return (self.pattern * (size // len(self.pattern) + 1))[:size]


def test_a_stream_of_zeros_is_refused_from_its_first_bytes():
    stream = Endless(b"\0")
    with pytest.raises(RecordError, match="is binary"):
        read(stream)
    assert stream.taken <= 2 * 1024 * 1024


def test_an_endless_text_stops_at_the_limit():
    stream = Endless(b"1,2,3,4\n")
    with pytest.raises(RecordError, match=r"larger than 50 MB .* max_bytes"):
        read(stream, max_bytes=50_000_000)
    assert stream.taken <= 55_000_000


def test_standard_input():
    code = "from stiction.sources import read; [r] = read('-'); print(r.tag, r.provenance.source, len(r))"
    text = f"time_s,PV,OP\n{ROWS}"
    done = subprocess.run([sys.executable, "-c", code], input=text, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["stdin", "stdin", "60"]


def test_constant_op_is_read_and_left_to_the_data_checks():
    [record] = read(io.BytesIO(b"time_s,PV,OP\n" + b"".join(b"%d,%d,5\n" % (k, k % 7) for k in range(90))))
    assert np.ptp(record.op) == 0.0


def test_one_dead_loop_does_not_stop_the_others():
    text = "time_s,FIC-1.PV,FIC-1.OP,FIC-2.PV,FIC-2.OP\n" + "".join(f"{k},Bad,5,{k % 7},{k % 5}\n" for k in range(60))
    [record] = read(io.BytesIO(text.encode()))
    assert record.tag == "FIC-2"
    assert any("FIC-1" in note for note in record.provenance.assumptions)


def test_ragged_rows_are_counted():
    text = "time_s,PV,OP\n" + ROWS + "60,5\n61,5,6,7\nEnd of report\n"
    [record] = read(io.BytesIO(text.encode()))
    assert len(record) == 62
    assert np.isnan(record.op[60])
    assert any("3 rows do not have 3 cells" in note for note in record.provenance.assumptions)


def test_summary_tells_rows_loops_period_gaps_bad_values_and_assumptions():
    text = "Zeit;FIC-1.PV;FIC-1.OP;FIC-1.MODE\n" + "".join(
        f"{5 * k};{'Bad' if k < 6 else k % 7};{40 + k % 3},5;AUTO\n" for k in range(60)
    )
    report = summarise(read(io.BytesIO(text.encode())))
    [line] = report.loops
    stored = line.to_dict()
    assert [stored[key] for key in ("tag", "rows", "samples", "dt")] == ["FIC-1", 60, 60, 5]
    assert [stored[key] for key in ("bad_percent", "gaps", "longest_gap_s", "auto_percent")] == [10, 1, 30, 100]
    assert [stored[key] for key in ("bad_values", "op_unit", "unused_columns")] == [{"Bad": 6}, "% of span", []]
    shown = report.summary()
    for part in (
        "1 loop read",
        "FIC-1 (flow)",
        "60 rows",
        "every 5 s",
        "10 % without OP or PV (1 gap, the longest 30 s)",
        "PV = FIC-1.PV",
        "6 x 'Bad'",
        "decimal comma",
    ):
        assert part in shown
    assert json.loads(json.dumps(report.to_dict()))["loops"][0]["columns"]["op"] == "FIC-1.OP"


def test_a_thousand_rows_need_no_heavy_import_but_polars():
    code = """
import io, sys, time
import polars
from stiction.records import summarise
from stiction.sources import read
rows = "".join(f"{k},{k % 97 / 7:.5f},{k % 89 / 9:.5f}\\n" for k in range(1000))
times = []
for _ in range(7):
    began = time.perf_counter()
    read(io.BytesIO(f"time_s,PV,OP\\n{rows}".encode()))
    times.append(time.perf_counter() - began)
print(min(times), *[name for name in ("numba", "scipy", "plotly", "pandas", "sqlalchemy") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    best, *heavy = done.stdout.split()
    assert float(best) < 0.15  # 30 ms on an idle machine
    assert heavy == []


def test_columns_that_name_no_signals_are_refused(read_text):
    with pytest.raises(ParameterError, match="does not map signals to columns; give for example"):
        read_text("time_s,PV,OP\n0,1,2\n", columns="OP")


def _rows(n, last="{:.4f}"):
    k = np.arange(n)
    return [f"{i},{np.sin(i / 7):.3f},{last.format(50 + np.cos(i / 5))}" for i in k]


@pytest.mark.parametrize("left", ["51.", "51.2", "51", ""])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_cut_off_within_its_last_row_is_reported_and_the_rest_is_read(left, end, read_text):
    rows = _rows(80)
    cut = rows[-1].rsplit(",", 1)[0] + (f",{left}" if left else "")
    [record] = read_text(end.join(["time_s,PV,OP", *rows[:-1], cut]))
    assert len(record) == 79
    assert np.isfinite(record.op).all()
    [told] = [note for note in record.provenance.assumptions if "cut off" in note]
    assert "line 81" in told
    assert repr(cut) in told
    [whole] = read_text(end.join(["time_s,PV,OP", *rows, ""]))
    assert len(whole) == 80


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_cut_is_reported_in_any_encoding_and_with_semicolons(encoding, read_text):
    rows = [row.replace(",", ";").replace(".", ",") for row in _rows(80)]
    [record] = read_text("\n".join(["time_s;PV;OP", *rows])[:-3], encoding)
    assert len(record) == 79
    assert any("line 81" in note for note in record.provenance.assumptions)


def test_a_last_row_without_a_line_end_is_no_cut_where_nothing_is_missing(read_text):
    for rows in (
        _rows(80),
        [f"{i},{np.sin(i / 7):.3f},{round(50 + np.cos(i / 5), 4)!r}" for i in range(79)] + ["79,0.5,50.5"],
        [f"{i},{np.sin(i / 7):.3f},{50 + 9 * np.cos(i / 5):.0f}" for i in range(79)] + ["79,0.5,9"],
        [f"{i},{np.sin(i / 7):.3f},{50 + np.cos(i / 5):.3f}," for i in range(79)] + ["79,0.5,50.123"],
        [*_rows(79), "79,0.500,"],
    ):
        header = "time_s,PV,OP," if rows[0].endswith(",") else "time_s,PV,OP"
        [record] = read_text("\n".join([header, *rows]))
        assert len(record) == 80
        assert not any("cut off" in note for note in record.provenance.assumptions), rows[-1]


@settings(deadline=None, max_examples=40)
@given(keep=some.integers(-24, -1))
def test_wherever_a_file_is_cut_off_all_whole_rows_are_read(keep, read_text):
    text = "\n".join(["time_s,PV,OP", *_rows(80), ""])
    [record] = read_text(text[:keep])
    whole = text[:keep].count("\n") - 1  # the header has one
    assert whole <= len(record) <= whole + 1
    [full] = read_text(text)
    assert np.isnan(record.op[-1]) or record.op[-1] == full.op[len(record) - 1]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"tag": 5}, "tag is of type int; give a text"),
        ({"delimiter": 5}, "delimiter is of type int"),
        ({"time_format": 5}, "time_format is of type int"),
        ({"day_first": "yes"}, "day_first is of type str; give True or False"),
        ({"columns": {"op": None}}, r"columns\['op'\] = None is neither a name nor a number; give the name"),
        ({"columns": {5: "OP"}}, "a signal of columns is of type int; give its name"),
        ({"dt": 10**400}, "dt is a number in s beyond"),
    ],
)
def test_options_of_another_kind_are_refused(options, told, read_text):
    with pytest.raises(ParameterError, match=told):
        read_text("time_s,PV,OP\n" + "\n".join(f"{k},{k % 5},{k % 7}" for k in range(60)), **options)

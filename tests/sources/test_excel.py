"""Workbooks: xlsx, xls and ods as openpyxl, xlwt and odfpy write them."""

from __future__ import annotations

import zipfile
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

import openpyxl
import openpyxl.styles
import pandas as pd
import polars as pl
import pytest
import xlwt

from stiction.errors import ParameterError, RecordError
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import excel
from stiction.sources.options import ReadOptions

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.table import RawTable

N = 60
TIMES = [datetime(2026, 3, 1, 23, 58, 0) + timedelta(seconds=5 * k) for k in range(N)]  # midnight is one of them
PV = [3.0 + 0.1 * (k % 7) for k in range(N)]
OP = [40.0 + round((k % 5) / 3.0, 9) for k in range(N)]  # openpyxl writes 16 digits
HEADER = ["Time", "FIC101.PV", "FIC101.OP"]


def read(path: Path, **asked: object) -> list[RawTable]:
    options = ReadOptions(**asked)  # type: ignore[arg-type]
    source = open_sources(path, options)[0]
    assert excel.recognises(source.head, path.name)
    return excel.read(source, options)


def write_xlsx(path: Path, rows: list[list[object]], sheet: str = "Sheet1") -> None:
    book = openpyxl.Workbook()
    page = book.active
    assert page is not None
    page.title = sheet
    for row in rows:
        page.append(row)
    book.save(path)


def write(path: Path) -> None:
    rows = [HEADER, *map(list, zip(TIMES, PV, OP, strict=True))]
    if path.suffix == ".xls":
        book = xlwt.Workbook()
        page = book.add_sheet("Sheet1")
        stamp = xlwt.easyxf(num_format_str="YYYY-MM-DD HH:MM:SS")
        for r, row in enumerate(rows):
            for c, cell in enumerate(row):
                page.write(r, c, cell, *([stamp] if isinstance(cell, datetime) else []))
        book.save(str(path))
    elif path.suffix == ".ods":
        pd.DataFrame(rows[1:], columns=HEADER).to_excel(path, index=False, engine="odf")
    else:
        write_xlsx(path, rows)


@pytest.mark.parametrize("ending", ["xlsx", "xlsm", "xls", "ods"])
def test_numbers_and_times_are_read_exactly(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"trend.{ending}"
    write(path)
    [table] = read(path)
    assert table.header == [HEADER]
    assert table.column(0).to_list() == TIMES
    assert table.column(1).to_list() == PV
    assert table.column(2).to_list() == OP
    assert table.origin.stem == "trend"
    assert table.first_line == 2
    assert table.sample[0][:2] == ["2026-03-01 23:58:00", "3"]


def test_title_blank_rows_and_status_texts(tmp_path: Path) -> None:
    rows: list[list[object]] = [["Export of unit 4"], [], HEADER, ["", "m3/h", "%"]]
    rows += [[time, pv if k != 9 else "Bad", op] for k, (time, pv, op) in enumerate(zip(TIMES, PV, OP, strict=True))]
    write_xlsx(tmp_path / "a.xlsx", rows)
    [table] = read(tmp_path / "a.xlsx")
    assert table.header[0] == HEADER
    assert table.first_line == 5
    assert table.column(0).to_list() == TIMES
    assert [table.column(1)[k] for k in (8, 9)] == [repr(PV[8]), "Bad"]
    assert table.column(2).to_list() == OP


def test_formula_gives_its_stored_value_and_errors_are_text(tmp_path: Path) -> None:
    write_xlsx(tmp_path / "a.xlsx", [HEADER, *([k, 1.5, "=1/0"] for k in range(N))])
    with zipfile.ZipFile(tmp_path / "a.xlsx") as old, zipfile.ZipFile(tmp_path / "b.xlsx", "w") as new:
        for name in old.namelist():
            text = old.read(name)
            stored = b"<f>1/0</f><v>7.5</v>"
            new.writestr(name, text.replace(b"<f>1/0</f><v></v>", stored).replace(b"<f>1/0</f><v />", stored))
    [table] = read(tmp_path / "b.xlsx")
    assert table.column(2).to_list() == [7.5] * N


def test_each_sheet_with_a_table_is_one(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for name in ("Notes", "FIC101", "FIC102", "Hidden"):
        page = book.create_sheet(name)
        for row in [["Time", "PV", "OP"], *zip(TIMES, PV, OP, strict=True)] if name != "Notes" else [["as agreed"]]:
            page.append(list(row))
    book["Hidden"].sheet_state = "hidden"
    book.save(tmp_path / "a.xlsx")
    assert [table.origin.stem for table in read(tmp_path / "a.xlsx")] == ["FIC101", "FIC102"]
    assert [table.origin.stem for table in read(tmp_path / "a.xlsx", sheet="fic102")] == ["FIC102"]
    with pytest.raises(ParameterError, match=r"has no sheet 'FIC7'; give one of .*FIC101"):
        read(tmp_path / "a.xlsx", sheet="FIC7")
    with pytest.raises(RecordError, match=r"no sheet contains a table"):
        read(tmp_path / "a.xlsx", sheet="Notes")


def test_day_counts_and_texts_stay_what_they_are(tmp_path: Path) -> None:
    rows = [["Time", "PV", "Mode"], *([timedelta(seconds=5 * k), k, "AUTO"] for k in range(N))]
    write_xlsx(tmp_path / "a.xlsx", rows)
    [table] = read(tmp_path / "a.xlsx")
    assert table.column(0).dtype in (pl.Duration("us"), pl.String)
    assert table.column(1).to_list() == list(range(N))
    assert set(table.column(2)) == {"AUTO"}


def test_damaged_and_encrypted_workbooks(tmp_path: Path) -> None:
    write(tmp_path / "a.xlsx")
    whole = (tmp_path / "a.xlsx").read_bytes()
    flipped = bytearray(whole)
    flipped[whole.index(b"xl/worksheets/sheet1.xml") + 200] ^= 0xFF
    (tmp_path / "b.xlsx").write_bytes(flipped)
    with pytest.raises(RecordError, match=r"b.xlsx: is damaged"):
        read(tmp_path / "b.xlsx")
    (tmp_path / "c.xls").write_bytes(excel.OLE_START + b"\0" * 3000)
    with pytest.raises(RecordError, match=r"c.xls: is damaged .*save it again"):
        read(tmp_path / "c.xls")
    write(tmp_path / "d.xls")
    (tmp_path / "d.xls").write_bytes((tmp_path / "d.xls").read_bytes() + "EncryptedPackage".encode("utf-16-le"))
    book = (tmp_path / "d.xls").read_bytes()
    (tmp_path / "d.xls").write_bytes(book[:512] + b"\xff" * 2000 + book[2512:])
    with pytest.raises(RecordError, match=r"d.xls: is (encrypted|damaged)"):
        read(tmp_path / "d.xls")


def test_workbook_that_states_wrong_sizes_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.xlsx")
    with zipfile.ZipFile(tmp_path / "a.xlsx", "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/media/zeros", bytes(30_000_000))
    data = (tmp_path / "a.xlsx").read_bytes()
    (tmp_path / "b.xlsx").write_bytes(data.replace((30_000_000).to_bytes(4, "little"), (30_000).to_bytes(4, "little")))
    with pytest.raises(RecordError, match=r"b.xlsx: is damaged"):
        read(tmp_path / "b.xlsx")


def test_cell_far_from_the_table_is_refused(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    page = book.active
    assert page is not None
    for row in [HEADER, *zip(TIMES, PV, OP, strict=True)]:
        page.append(list(row))
    page["XFD1048576"] = 1.0
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(RecordError, match=r"reaches to row 1,048,576 and column 16,384.*delete cells"):
        read(tmp_path / "a.xlsx")
    page["XFD1048576"].value = None
    page["XFD1048576"].font = openpyxl.styles.Font(bold=True)  # an empty cell with a format is no cell
    book.save(tmp_path / "a.xlsx")
    [table] = read(tmp_path / "a.xlsx")
    assert table.column(1).to_list() == PV


def test_damaged_xls_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.xls")
    data = bytearray((tmp_path / "a.xls").read_bytes())
    number_record = b"\x03\x02\x0e\x00"
    first = data.index(number_record)
    second = data.index(number_record, first + 18)
    data[first + 4 : first + 6] = b"\xff\xff"  # row
    data[second + 6 : second + 8] = b"\xff\xff"  # column
    (tmp_path / "a.xls").write_bytes(data)
    with pytest.raises(RecordError, match=r"a.xls: is damaged .*more memory"):
        read(tmp_path / "a.xls")


def test_panic_of_the_library_is_not_shown(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.xls"
    book = xlwt.Workbook()
    book.add_sheet("loop").write(0, 0, "PV")
    book.save(str(path))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - 54])  # within the directory of the file
    [source] = open_sources(path, ReadOptions())
    with pytest.raises(RecordError, match="is damaged"):
        excel.read(source, ReadOptions())
    assert "panicked" not in capfd.readouterr().err

"""Text tables: encodings, marks, headers and rows, against cells written by the csv module or by hand."""

from __future__ import annotations

import csv
import io

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stiction.errors import RecordError
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text
from stiction.sources.formats.text_lines import BLOCK_BYTES
from stiction.sources.options import ReadOptions

N = 60
ROWS = [[str(k), f"{50 + k % 7}.5", f"{40 + k % 5}"] for k in range(N)]
NAMES = ["time_s", "PV", "OP"]


def lines(rows=ROWS, header=(NAMES,), mark=",", end="\n"):
    return "".join(mark.join(row) + end for row in [*header, *rows])


def read_table(data, encoding="utf-8", **options):
    chosen = ReadOptions(**options)
    data = data if isinstance(data, bytes) else data.encode(encoding)
    [table] = text.read(open_sources(io.BytesIO(data), chosen)[0], chosen)
    return table


def cells(table):
    """All cells by row; an empty cell is "" """
    table.load(range(table.width))
    return [
        ["" if cell is None else cell for cell in row]
        for row in zip(*map(table.column, range(table.width)), strict=True)
    ]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_line_ends(encoding, end):
    header = [["time_s", "TIC-1.PV [°C]", "Größe"]]
    table = read_table(lines(header=header, end=end), encoding)
    assert (table.header, table.first_line, cells(table)) == (header, 2, ROWS)
    assert table.notes == ([] if encoding.startswith("utf-8") else [f"The text encoding is taken as {encoding}."])


@pytest.mark.parametrize("header", [["时间", "反应器温度 ℃", "阀门开度 %"], ["时间", "FIC-101.测量值", "FIC-101.输出"]])
def test_chinese_text(header):
    assert read_table(lines(header=[header]), "gb18030").header == [header]
    table = read_table(lines([*ROWS * 3000, ["1", "2", "手动"]]), "gb18030")  # far behind the first bytes
    assert cells(table)[-1][2] == "手动"


@pytest.mark.parametrize("word", ["Température [°C]", "Größe", "m³/h", "Ärvärde", "ÄÖ", "Ø 5 °C", "Mittaus ±"])
def test_western_text_is_not_chinese(word):
    assert read_table(lines(header=[["time_s", word, "OP"]]), "latin-1").header[0][1] == word


@pytest.mark.parametrize("mark", [",", ";", "\t", "|", " ", "   "])
@pytest.mark.parametrize("decimal", [".", ","])
def test_delimiters_and_decimal_marks(mark, decimal):
    if mark == decimal:
        return
    rows = [[cell.replace(".", decimal) for cell in row] for row in ROWS]
    table = read_table(lines(rows, mark=mark))
    assert (cells(table), table.header, table.decimal) == (rows, [NAMES], decimal)
    name = {";": "semicolons", "\t": "tabs", "|": "pipes", ",": ""}.get(mark, "spaces")
    assert ([f"Columns are separated by {name}."] if name else []) == [n for n in table.notes if "separated" in n]
    assert ("Numbers have a decimal comma." in table.notes) == (decimal == ",")
    given = read_table(lines(rows, mark=mark), decimal=decimal, delimiter=mark[0])
    assert (cells(given), given.notes) == (rows, [])


@pytest.mark.parametrize("first", ["sep=;", '"sep=;"', "SEP=;"])
def test_the_delimiter_line_of_a_spreadsheet_program(first):
    table = read_table(f"{first}\n" + lines(mark=";"))
    assert (table.header, table.above, table.first_line, cells(table)) == ([NAMES], [], 3, ROWS)


def test_titles_header_rows_and_blank_lines():
    above = [["Trend of unit 3"], ["From", "2026-02-01 10:00:00"]]
    header = [NAMES, ["s", "t/h", "%"]]
    table = read_table("Trend of unit 3\nFrom,2026-02-01 10:00:00\n\n" + lines(header=header) + "\n,,\n \n")
    assert (table.header, table.above, table.first_line, cells(table)) == (header, above, 6, ROWS)
    assert table.notes == ["2 lines above the header are not used."]


def test_markers_above_the_data_are_kept():
    table = read_table('"#NAMES"\n"t_stamp","PV","OP"\n"#TYPES"\n"date","D","D"\n"#ROWS","60"\n' + lines(header=()))
    assert (table.header, cells(table)) == ([["date", "D", "D"]], ROWS)
    assert table.above == [["#NAMES"], ["t_stamp", "PV", "OP"], ["#TYPES"], ["#ROWS", "60"]]


def test_the_table_begins_in_quotes_of_several_lines():
    table = read_table('"A ""report"",\nof November"\n\ntime_s,"PV\n[m3/h]","OP\n[%]"\n' + lines(header=()))
    assert (table.header, table.first_line, cells(table)) == ([["time_s", "PV [m3/h]", "OP [%]"]], 7, ROWS)


@pytest.mark.parametrize("quoted", ['="{}"', '"=""{}"""'])
def test_the_formula_of_a_text_is_that_text(quoted):
    rows = [[f"2026-11-21 14:{k // 60:02d}:{k % 60:02d}", *row[1:]] for k, row in enumerate(ROWS)]
    table = read_table(lines([[quoted.format(row[0]), *row[1:]] for row in rows]))
    assert (cells(table), table.sample) == (rows, rows)


@pytest.mark.parametrize("written", ['"{}"', ' "{}"', '"{}" ', ' "{}" ', " {} ", "\t{}"])
def test_blanks_and_quotes_about_cells(written):
    table = read_table(lines([[written.format(cell) for cell in row] for row in ROWS]))
    assert (cells(table), table.notes) == (ROWS, [])


def test_rows_with_other_numbers_of_cells_are_counted():
    rows = [*ROWS, ["60", "5"], ["61", "5", "6", "7"], ["End of report"]]
    table = read_table(lines(rows))
    assert cells(table) == [*ROWS, ["60", "5", ""], ["61", "5", "6"], ["End of report", "", ""]]
    assert table.notes == [
        "3 rows do not have 3 cells (first near line 62): missing cells are empty, extra cells are left out."
    ]


@pytest.mark.parametrize(("row", "again"), [(30, None), (50, None), (30, 34), (4, 59)])
def test_a_quote_that_is_not_closed_is_refused_where_it_opens(row, again):
    rows = [list(row) for row in ROWS]
    rows[row][1] = f'"{rows[row][1]}'
    if again is not None:
        rows[again][1] += '"'
    with pytest.raises(RecordError, match=f"line {row + 2}: cannot be split into columns .a cell in quotes goes on"):
        read_table(lines(rows))


def test_a_quote_left_open_in_the_last_row_costs_that_row():
    table = read_table(lines([*ROWS[:-1], ["59", '"53.5', "44"]]))
    assert (len(cells(table)), cells(table)[-1][2]) == (N, "")
    assert "near line 61" in table.notes[0]


def test_one_odd_row_in_several_blocks_costs_no_other():
    rows = ROWS * (3 * BLOCK_BYTES // len(lines(header=())))
    place = len(rows) // 2
    text = lines([*rows[:place], ["x", "y"], [], *rows[place:]])
    table = read_table(text)
    expected = pl.DataFrame([*rows[:place], ["x", "y", None], *rows[place:]], ["c0", "c1", "c2"], orient="row")
    assert pl.DataFrame([table.column(k) for k in range(table.width)]).equals(expected)
    assert f"near line {place + 2})" in table.notes[0]
    with pytest.raises(RecordError, match=f"line {len(rows) + 3}: is longer than 1000000 characters"):
        read_table(text.rstrip("\n")[: -len(",".join(rows[-1]))] + "1" * 1_100_000 + "\n5,5,5\n")


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("left", ["51.", "51.2", "51", ""])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_cut_off_within_its_last_row_is_reported(end, left, encoding):
    rows = [[str(k), f"{k / 7:.3f}", f"{50 + k / 9:.4f}"] for k in range(80)]
    cut = ",".join(rows[-1][:2]) + (f",{left}" if left else "")
    table = read_table(end.join(map(",".join, [NAMES, *rows[:-1], [cut]])), encoding)
    assert cells(table) == rows[:-1]
    assert f"ends within line 81 ({cut!r}), so it was cut off: that row is left out" in table.notes[-1]
    assert cells(read_table(end.join(map(",".join, [NAMES, *rows])), encoding)) == rows


BAD = {
    "prose": (b"Dear all,\nplease find the trend attached.\n", "no row of numbers"),
    "header only": (b"time_s,PV,OP\n", "no row of numbers"),
    "a very long line": (b"1," * 2_000_000, "line 1: is longer than 1000000 characters"),
    "an open quote": (b'time_s,PV,OP\n"' + b"1" * 500_000, "quote that never closes"),
    "decimal comma between commas": (
        lines([[f"{k}", "1,5", "2,5"] for k in range(N)]).encode(),
        "decimal comma between",
    ),
    "thousands between commas": (
        lines([[f"{k}", f"{700 + 10 * k:,}.5", "40"] for k in range(N)]).encode(),
        "commas between columns and within numbers, such as 1,0",
    ),
    "thousands only late": (
        lines([[f"{k}", f"{700 + k:,}.5", "40"] for k in range(400)]).encode(),
        "commas between columns and within numbers, such as 1,0",
    ),
    "a missing name": (lines([[f"{k}", *row] for k, row in enumerate(ROWS)]).encode(), "has 3 names for 4 columns"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_content(case):
    data, message = BAD[case]
    with pytest.raises(RecordError, match=f"^stream.*{message}"):
        read_table(data)


def test_units_behind_numbers_are_a_header_row():
    rows = [[a, f"{b} bar", f"{c} %"] for a, b, c in ROWS]
    assert read_table(lines(rows)).header == [NAMES, ["", "bar", "%"]]


@pytest.mark.parametrize(
    ("pv", "mark", "note"),
    [
        ('"3,000"', ",", "'3,000' is read as 3000; if that is wrong give the decimal mark (decimal) ','."),
        ("1.100", ";", "'1.100' is read as 1.1; if that is wrong give the decimal mark (decimal) ','."),
        ("1,100", ";", "'1,100' is read as 1.1; if that is wrong give the decimal mark (decimal) '.'."),
    ],
)
def test_thousands_that_may_be_decimals_are_reported(pv, mark, note):
    rows = [[a, pv, "40"] for a, _, _ in ROWS]
    assert note in read_table(lines(rows, mark=mark)).notes
    other = [[a, pv, c.replace(".", pv[1] if pv[1] in ".," else ",")] for a, c, _ in ROWS]
    assert mark == "," or note not in read_table(lines(other, mark=mark)).notes  # another signal settles the mark


cell_text = st.text(st.sampled_from('ab1.5-"; \t'), max_size=6).map(str.strip)


@settings(deadline=None, max_examples=80)
@given(
    notes=st.lists(cell_text, min_size=N, max_size=N),
    mark=st.sampled_from(",;\t|"),
    quoting=st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL, csv.QUOTE_NONNUMERIC]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_what_the_csv_module_writes_is_read(notes, mark, quoting, end):
    rows = [[*row, note] for row, note in zip(ROWS, notes, strict=True)]
    file = io.StringIO()
    writer = csv.writer(file, delimiter=mark, quoting=quoting, lineterminator=end)
    writer.writerow([*NAMES, "Comment"])
    writer.writerows(rows)
    table = read_table(file.getvalue(), delimiter=mark, decimal=".")
    assert (cells(table), table.notes) == (rows, [])


@settings(deadline=None, max_examples=80)
@given(odd=st.lists(st.text(st.sampled_from('1x.,,"" '), max_size=9), max_size=8), places=st.randoms())
def test_odd_lines_are_split_as_the_csv_module_does(odd, places):
    good = lines().splitlines()
    all_lines = good[:30] + sorted([*good[30:], *odd], key=lambda _: places.random()) + ["60,50.5,40"]
    twin = []
    for line in all_lines[1:]:
        reader = csv.reader(iter([line + "\n", "\n"]), skipinitialspace=True)
        row = next(reader)
        if reader.line_num > 1:
            with pytest.raises(RecordError, match=f"line {all_lines.index(line) + 1}: cannot be split"):
                read_table("\n".join(all_lines) + "\n")
            return
        if any(map(str.strip, row)):
            twin.append([cell.strip() for cell in [*row, "", "", ""][:3]])
    try:
        table = read_table("\n".join(all_lines) + "\n", delimiter=",", decimal=".")
    except RecordError as error:
        assert "within numbers" in str(error)  # noqa: PT017 (an odd line may look like split thousands)
        return
    assert cells(table) == twin

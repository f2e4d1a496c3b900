"""Tags below each other, each under a heading of its own, as some historians print them."""

from __future__ import annotations

import io

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.sources import read
from stiction.sources.byte_source import open_sources
from stiction.sources.formats import text as text_format
from stiction.sources.options import ReadOptions


def blocks(signals, heading="Tag: {}", header="Time,Value", *, loop="FIC101", decimal=".", unit="", rows=None):
    """Blocks of PV and OP, with a blank line after each."""
    _, pv, op, _ = signals
    mark = next((mark for mark in "\t;" if mark in header), ",")
    lines = []
    for word, values in (("PV", pv), ("OP", op)):
        lines += [heading.format(f"{loop}.{word}"), *[f"Units: {unit}"] * bool(unit), *[header] * bool(header)]
        for k, value in list(enumerate(values.tolist()))[:rows]:
            lines += [f"2026-02-01 10:{k // 60:02d}:{k % 60:02d}{mark}{f'{value!r}'.replace('.', decimal)}"]
        lines += [""]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("heading", "header", "decimal"),
    [
        ("Tag: {}", "Time,Value", "."),
        ("{}", "", "."),
        ("{}", "Timestamp,Value", "."),
        ("[{}]", "Timestamp\tValue", "."),
        ("Point;{};", "Zeit;Wert", ","),
        ("Tag Name,{}", "Date/Time,Value", "."),
        ('"{}"', '"Time","Value"', "."),
    ],
)
@pytest.mark.parametrize("above", ["", "Trend of unit 3\nPrinted by me\n\n"])
def test_blocks_under_headings(heading, header, decimal, above, signals, read_text):
    text = above + blocks(signals, heading, header, decimal=decimal)
    [record] = read_text(text)
    assert (record.tag, record.loop_type, record.dt) == ("FIC101", "flow", 1.0)
    assert (record.pv.tolist(), record.op.tolist()) == (signals[1].tolist(), signals[2].tolist())
    assert not any("Left out" in guess for guess in record.provenance.assumptions)
    assert [r.tag for r in read_text(text + blocks(signals, heading, header, decimal=decimal, loop="LIC7"))] == [
        "FIC101",
        "LIC7",
    ]


def test_a_unit_under_the_heading_is_the_block_s(signals, read_text):
    scaled = (*signals[:2], 4.0 + 0.16 * signals[2], signals[3])
    [record] = read_text(blocks(scaled, unit="mA"))
    np.testing.assert_allclose(record.op, signals[2], rtol=1e-12)
    assert record.provenance.pv_unit == "mA"


def test_every_line_keeps_its_number(signals):
    text = blocks(signals)
    lines = text.split("\n")
    [table] = text_format.read(open_sources(io.BytesIO(text.encode()), ReadOptions())[0], ReadOptions())
    assert lines[table.first_line - 1].startswith("2026-02-01 10:00:00")
    with pytest.raises(RecordError, match=rf"line {len(lines) - 10}: cannot be split"):
        read(io.BytesIO("\n".join([*lines[:-11], lines[-11].replace(",", ',"'), *lines[-10:]]).encode()))


def test_a_heading_over_one_loop_is_none_of_a_block(signals, table, read_text):
    t, pv, op, _ = signals
    for title in ("FIC101.PV", "Tag: FIC101.PID", "Tag: FIC101.PV\nTag: FIC101.OP"):
        [record] = read_text(table([title, "Time,PV,OP"], t, pv, op))
        assert record.pv.tolist() == pv.tolist()

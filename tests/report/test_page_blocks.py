"""Blocks, payload and the page they make."""

from __future__ import annotations

import base64
import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra import numpy as some_arrays

from stiction.errors import ParameterError
from stiction.report import (
    Cell,
    Collapsible,
    Figure,
    Heading,
    SideBySide,
    Table,
    Text,
    TrustedHtml,
    downsample,
    render_page,
)
from stiction.report.plot_json import to_json
from stiction.report.rendering import format_cell

EVIL = '</script><script>window.hacked=1</script><img src=x onerror="window.hacked=1">'
FIGURE = Figure({"data": [{"y": [1.0, 2.0], "name": EVIL}], "layout": {}}, f"Title {EVIL}", f"Caption {EVIL}")


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), dtype=f"<{packed['dtype']}")


@given(
    some_arrays.arrays(
        np.float64, some.integers(1, 60), elements=some.floats(-1e9, 1e9) | some.just(math.nan) | some.just(101325.0)
    )
)
def test_packed_arrays_come_back(y):
    back = unpacked(json.loads(to_json({"y": y}))["y"])
    assert np.array_equal(np.isnan(back), np.isnan(y))
    good = ~np.isnan(y)
    if good.any():
        assert np.abs(back[good] - y[good]).max() <= 1e-4 * np.ptp(y[good])


def test_a_small_ripple_on_a_large_value_keeps_its_shape():
    y = 101325.0 + 0.001 * np.sin(np.arange(50.0))
    assert np.allclose(unpacked(json.loads(to_json({"y": y}))["y"]), y, atol=1e-7, rtol=0.0)


def test_matrices_keep_their_shape():
    packed = json.loads(to_json({"z": np.zeros((3, 4))}))["z"]
    assert packed["shape"] == "3, 4"
    assert len(unpacked(packed)) == 12


def test_payload_cannot_end_its_element():
    text = to_json({"name": EVIL + "<!-- &amp;"})
    assert not set("<>&") & set(text)
    assert json.loads(text)["name"] == EVIL + "<!-- &amp;"


def test_payload_refuses_what_json_cannot_hold():
    with pytest.raises(ValueError):
        to_json({"range": [0.0, math.nan]})
    with pytest.raises(TypeError, match="A plot holds a set"):
        to_json({"data": {1, 2}})


def test_text_is_escaped_everywhere():
    page = render_page(
        EVIL,
        [
            Heading(EVIL, anchor='a" onclick="x'),
            Text(EVIL),
            FIGURE,
            SideBySide([FIGURE, FIGURE]),
            Table([EVIL], [[EVIL], [Cell(EVIL, sort=EVIL, href='#" onclick="x')]], EVIL, sortable=True),
            Collapsible(EVIL, [Text(EVIL)], anchor='b" onclick="x'),
        ],
        subtitle=EVIL,
        footer=EVIL,
    )
    assert "<script>window" not in page
    assert "<img" not in page.split('<script type="text/plain"')[0]
    assert '" onclick=' not in page


def test_html_is_the_one_way_for_markup():
    assert "<b>bold</b>" in render_page("t", [TrustedHtml("<b>bold</b>")])
    assert "<b>bold</b>" not in render_page("t", [Text("<b>bold</b>")])


def test_plot_library_comes_once_and_only_when_needed():
    without = render_page("t", [Text("no figure")])
    folded = render_page("t", [Collapsible("f", [SideBySide([FIGURE, FIGURE])])])
    assert len(without) < 30_000
    assert 4_000_000 < len(folded) < 6_000_000
    assert folded.count('id="plot-library"') == 1
    assert 'id="plot-library"' not in without.split("<script>")[0]


def test_the_same_blocks_make_the_same_page():
    code = (
        "import hashlib; from stiction.report.blocks import Table, Text; from stiction.report.page import render_page\n"
        "page = render_page('t', [Text('a word'), Table(['a', 'b'], [[1, 2], [3, 4]], 'Numbers.', sortable=True)])\n"
        "print(hashlib.sha256(page.encode()).hexdigest())"
    )
    digests = {
        subprocess.check_output([sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed})
        for seed in ("1", "2")
    }
    assert len(digests) == 1


@pytest.mark.parametrize(("title", "caption"), [("", "words"), ("words", " ")])
def test_a_figure_needs_words(title, caption):
    with pytest.raises(ParameterError, match="title and a one-sentence caption"):
        Figure({"data": []}, title, caption)


def test_a_row_must_fill_its_columns():
    with pytest.raises(ParameterError, match="row 1 has 1 cells for 2 columns"):
        Table(["a", "b"], [[1, 2], [1]])


@pytest.mark.parametrize("href", ["javascript:alert(1)", "http://plain.example", "//host", "file:///etc"])
def test_a_cell_links_to_the_page_or_to_https_only(href):
    with pytest.raises(ParameterError, match="links to"):
        Cell("x", href=href)


def test_a_heading_level_outside_the_page_is_refused():
    with pytest.raises(ParameterError, match="level 1"):
        Heading("x", level=1)


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (math.inf, "–"), (0.0, "0"), (12.3456, "12.35"), (98765.4, "98765"), ("a", "a")]
)
def test_table_values(value, text):
    assert format_cell(value) == text


def test_numbers_of_any_kind_stand_right():
    page = render_page("t", [Table(["a", "b"], [[np.int64(3), "x"], [np.float32(2.5), 1.0]])])
    assert page.count('<td class="number">') == 2
    assert '<td class="number">2.5</td>' in page


def test_thinning_keeps_peaks_and_gaps():
    y = np.sin(np.arange(200_000) / 500.0)
    y[123_456] = 9.0
    y[50_000:60_000] = np.nan
    keep = downsample.downsample(y)
    assert len(keep) <= downsample.MAX_POINTS
    assert 123_456 in keep
    assert np.isnan(y[keep]).any()
    assert np.all(np.diff(keep) > 0)

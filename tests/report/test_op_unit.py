"""S and J are always shown in the unit of OP: % of span only where the check "op scale" accepts OP as a percentage."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from report.diagnoses import record
from stiction.compensation.shop_tests import plan_staircase
from stiction.records import LoopRecord
from stiction.records.assess import assess_quality
from stiction.report import labels, write_report
from stiction.report.pages.loop import loop_blocks
from stiction.report.pages.overview import overview

IN_PERCENT = re.compile(
    r"\b[SJ] ?(?:=|is|of|from|changes by)? ?\d[\d.]* ?%|OP (?:amplitude|by|moves) [\d.]+ %"
    r"|\[% of span]|% deadband|per %|% per PV unit"
)
"""S, J, OP or a gain in % of span, in a sentence or on an axis."""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A sticky loop stored with OP from 4 to 20 without a unit, read as it is and with its range."""
    run = record(measured=True)
    file = tmp_path_factory.mktemp("plant") / "current.csv"
    columns = {
        "time": run.time,
        "SP": run.sp,
        "PV": run.pv,
        "OP": 4 + 0.16 * run.op,
        "valve position": 4 + 0.16 * run.mv,
    }
    table = np.column_stack(list(columns.values()))
    np.savetxt(file, table, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    return {
        unit: st.diagnose(st.read(file, op_range=given, loop_type="flow")[0])
        for unit, given in (("OP units", None), ("% of span", (4, 20)))
    }


def all_text(found, folder):
    """All texts of a diagnosis, with plain blanks."""
    page = write_report([found], folder / "one.html").read_text()
    several = write_report([found, found], folder / "two.html").read_text()
    texts = {
        "page": page.split("<body", 1)[1],
        "overview": several.split("<body", 1)[1],
        "headline": labels.headline(found),
        "blocks": str(loop_blocks(found)),
        "reason": found.reason,
        "work order": st.work_order(found, st.compensate(found, seeds=1)).to_text(),
    }
    return {name: re.sub(r"\\u00a0|\s", " ", unescape(text)) for name, text in texts.items()}


def test_nothing_calls_s_a_percentage_where_op_is_none(found, tmp_path):
    for name, text in all_text(found["OP units"], tmp_path).items():
        assert not IN_PERCENT.findall(text), name
        assert "OP units" in text, name


def test_the_same_record_with_its_range_is_in_percent(found, tmp_path):
    for name, text in all_text(found["% of span"], tmp_path).items():
        assert IN_PERCENT.search(text), name
        assert "OP units" not in text, name


def test_both_are_one_valve(found):
    current, percent = (found[unit].identification for unit in ("OP units", "% of span"))
    assert pytest.approx(percent.S, rel=0.05) == 6.25 * current.S


@pytest.mark.parametrize("unit", ["OP units", "% of span"])
def test_json_says_the_unit(found, unit):
    assert found[unit].to_dict()["op_unit"] == unit


def test_no_remedy_is_set_for_an_op_in_another_unit(found):
    trial = st.compensate(found["OP units"], seeds=1)
    assert trial.refused
    assert "(op_range)" in trial.reason
    assert "op_range" not in st.compensate(found["% of span"], seeds=1).reason


def test_the_work_order_has_no_sizes_in_another_unit(found):
    order = st.work_order(found["OP units"])
    assert np.isnan([order.S, order.S_low, order.S_high, order.J, order.J_low, order.J_high]).all()
    plan = order.before[0]
    assert (plan.settings["low"], plan.settings["high"]) == (42.5, 57.5)  # 50 % and three times 5 %
    assert order.before[1] == plan_staircase(50.0, 5.0)
    assert "of the stroke" not in order.to_text()


def test_the_scale_of_s_needs_percent(found, tmp_path):
    for unit, bars in (("OP units", 0), ("% of span", 1)):
        page = write_report([found[unit]], tmp_path / "page.html").read_text()
        assert page.count('class="severity-bar"') == bars
        assert page.count("The scale of S needs OP in % of span") == 1 - bars


def test_a_table_of_loops_names_the_unit_that_is_not_that_of_its_heading(found):
    fraction, percent = found["OP units"], found["% of span"]
    mixed, alone = overview([percent, fraction]), overview([fraction])
    assert [name for name in mixed.columns if "[%" in name] == ["S [% of span]", "OP\u00a0± [%]"]
    assert [name for name in alone.columns if "%" in name] == []
    for k, cells in enumerate(mixed.rows):
        assert [str(cells[n].value).endswith("OP units") for n in (3, 5)] == [k == 1, k == 1]
    assert (labels.S_text(fraction).endswith("OP units"), "units" in labels.S_text(percent)) == (True, False)


@given(
    op=some.lists(
        some.floats(-30.0, 130.0) | some.floats(0.0, 1.2) | some.just(-9999.0) | some.just(np.nan), min_size=1
    )
)
def test_the_unit_follows_the_check_of_the_op_scale(op):
    run = LoopRecord("FIC-101", 1.0, op=op, pv=np.arange(len(op)))
    severities = {check.name: check.severity for check in assess_quality(run).checks}
    assert run.op_in_percent == (severities.get("op scale", "ok") == "ok")


def test_a_code_for_a_bad_value_does_not_change_the_unit():
    run = record(600)
    op = np.where(np.arange(600) == 300, -9999.0, run.op)
    assert (replace(run, op=op).op_unit, replace(run, op=op / 100.0).op_unit) == ("% of span", "OP units")

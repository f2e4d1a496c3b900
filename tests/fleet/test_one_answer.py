"""One loop, one answer: the audit's row has the numbers of `diagnose`, and every surface shows them."""

from __future__ import annotations

import csv
import html
import json
import re
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

import stiction as st
from fleet.drawn_plant import KINDS, UNITS, draw_loop, write_drawn_plant
from stiction.fleet import LoopRow, write_exports
from stiction.report import write_audit_page, write_loop_page

if TYPE_CHECKING:
    from pathlib import Path

LOOPS = 14


def diagnose_files(folder: Path, tag_map: Path) -> dict[str, st.Diagnosis]:
    """Diagnose the loops of each file, read alone."""
    records = [record for path in sorted(folder.iterdir()) for record in st.read(path, map=tag_map)]
    return {record.tag: st.diagnose(record) for record in records}


def require_one_answer(row: LoopRow, found: st.Diagnosis) -> None:
    """The row has the verdict, the numbers, the cause, the state and the advice of the diagnosis."""
    assert row.verdict == found.verdict, row.tag
    assert row.probability == pytest.approx(found.probability, rel=1e-9, abs=1e-12), row.tag
    assert row.loop_state == found.loop_state.state, row.tag
    assert row.oscillation_cause == found.cause, row.tag
    assert row.reason == found.reason, row.tag
    if row.group is None or not row.finding_text.startswith("Oscillates with"):  # else the group says what to do first
        assert row.action == found.action, row.tag
    assert (row.period_s is not None) == found.oscillation.oscillating, row.tag
    if row.period_s is not None:
        assert row.period_s == pytest.approx(found.oscillation.period, rel=1e-9), row.tag
    valve = found.identification
    is_good = found.verdict == "no_stiction" and found.finding != "backlash"  # play has a size
    if valve is None or is_good or not found.loop_state.in_control:
        assert (row.S, row.J) == (None, None), row.tag
        return
    for name in ("S", "S_low", "S_high", "J", "J_low", "J_high"):
        number = row[name]
        assert (np.nan if number is None else number) == pytest.approx(
            getattr(valve, name), rel=1e-9, abs=1e-12, nan_ok=True
        ), (row.tag, name)


def require_one_answer_of_all(audit: st.Audit, diagnoses: dict[str, st.Diagnosis]) -> None:
    assert {row.tag for row in audit.rows} == diagnoses.keys()
    for row in audit.rows:
        require_one_answer(row, diagnoses[row.tag])


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn") / "plant"
    return folder, write_drawn_plant(folder, LOOPS)


@pytest.fixture(scope="module")
def diagnoses(plant):
    return diagnose_files(*plant)


@pytest.fixture(scope="module")
def audit(plant, tmp_path_factory):
    from fleet.in_process_audit import audits_in_this_process

    with audits_in_this_process():
        return st.audit(plant[0], tmp_path_factory.mktemp("audit") / "audit", map=plant[1])


def test_drawn_loops_are_of_all_kinds(diagnoses):
    """The states and verdicts that a test of equality needs, and OP in % of span whatever its unit was."""
    assert len(diagnoses) == LOOPS == 2 * len(KINDS)
    assert {found.loop_state.state for found in diagnoses.values()} >= {"in_control", "manual"}
    assert {found.verdict for found in diagnoses.values()} == {"stiction", "no_stiction", "undecided"}
    for k in range(len(UNITS)):
        drawn = draw_loop(k)
        read = diagnoses[drawn.tag].record
        assert np.nanmean(read.op) == pytest.approx(np.nanmean(drawn.op), abs=0.5)


def test_audit_says_what_diagnose_says(audit, diagnoses):
    require_one_answer_of_all(audit, diagnoses)


def test_stored_rows_are_equal(audit):
    assert st.open_audit(audit.folder).rows == audit.rows
    for row in audit.rows:
        assert LoopRow.from_dict(json.loads(json.dumps(row.to_dict()))) == row


@pytest.mark.processes
@pytest.mark.parametrize("engine", [{"workers": 2}, {"dask": "local", "workers": 2}])
def test_workers_say_what_diagnose_says(plant, diagnoses, tmp_path, engine):
    if "dask" in engine:
        pytest.importorskip("distributed")
    require_one_answer_of_all(st.audit(plant[0], tmp_path / "audit", map=plant[1], **engine), diagnoses)


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize("engine", [{}, {"dask": "local", "workers": 2}])
def test_300_loops_have_one_answer(tmp_path, engine):
    tags = write_drawn_plant(tmp_path / "plant", 300)
    found = st.audit(tmp_path / "plant", tmp_path / "audit", map=tags, **engine)
    require_one_answer_of_all(found, diagnose_files(tmp_path / "plant", tags))


@pytest.mark.slow
def test_demo_loops_have_one_answer(tmp_path, audit_in_process):
    from stiction.records.parquet_writer import to_parquet
    from stiction.simulation.demo import demo_plant

    records = [loop.record for loop in demo_plant()]
    to_parquet(records, tmp_path / "demo.parquet")
    found = st.audit(tmp_path / "demo.parquet", tmp_path / "audit")
    require_one_answer_of_all(found, {record.tag: st.diagnose(record) for record in st.read(tmp_path / "demo.parquet")})


@pytest.mark.slow
def test_demo_plant_has_one_answer(tmp_path, audit_in_process):
    from stiction.apps.demo_plant import write_plant_files
    from stiction.simulation.plant import simulate_plant

    data, tags, links = write_plant_files(simulate_plant(0), tmp_path)
    found = st.audit(data, tmp_path / "audit", map=tags, connections=links)
    require_one_answer_of_all(found, {record.tag: st.diagnose(record) for record in st.read(data, map=tags)})


def require_digits(text: str, value: float | None) -> None:
    """A printed number is the value rounded to the digits that it has; a dash or nothing where it is unknown."""
    text, _, unit = text.replace("\xa0", " ").strip().partition(" ")
    scale = {"min": 60.0, "h": 3600.0, "d": 86400.0}.get(unit, 1.0)
    if value is None:
        assert text in ("", "–")
    elif text.startswith(("<", ">")):
        assert value < 0.01 if text == "<0.01" else value > 0.99
    else:
        decimals = len(text.partition(".")[2])
        assert scale * float(text) == pytest.approx(value, abs=0.5001 * scale * 10.0**-decimals)


def page_rows(path: Path) -> dict[str, dict[str, str]]:
    """Texts of the numbers in the table of the page of an audit, by tag."""
    data = re.search(r'id="data-rows">(.*?)</script>', path.read_text(encoding="utf-8"), re.S)
    assert data is not None
    table = json.loads(data[1])
    return {row[0]: row[len(table["columns"])] for row in table["rows"]}


def test_surfaces_agree_to_their_digits(audit, capsys):
    """Terminal, JSON, workbook, CSV, Parquet, the page of the audit and the table of the browser."""
    from python_calamine import CalamineWorkbook

    from stiction.apps.audit import print_audit
    from stiction.apps.web.audit_files import audit_rows

    files = write_exports(audit)
    with files[0].open(newline="", encoding="utf-8") as file:
        in_csv = {row["tag"]: row for row in csv.DictReader(file)}
    in_parquet = {row["tag"]: row for row in pl.read_parquet(files[1]).to_dicts()}
    head, *cells = CalamineWorkbook.from_path(str(files[2])).get_sheet_by_name("Loops").to_python()
    in_excel = {row[0]: dict(zip(head, row, strict=True)) for row in cells}
    on_page = page_rows(write_audit_page(audit))
    in_browser = {row["tag"]: row for row in json.loads(audit_rows(str(audit.folder), 0))["rows"]}
    in_json = {row["tag"]: row for row in json.loads(json.dumps(audit.to_dict()))["loops"]}
    capsys.readouterr()
    print_audit(audit)
    printed = [re.split(r"\s{2,}", line.strip()) for line in capsys.readouterr().out.splitlines()]
    in_terminal = {cells[0]: cells for cells in printed if cells[0] in in_json}
    for row in audit.rows:
        for name in ("probability", "S", "J", "S_low", "S_high", "period_s", "severity", "priority"):
            value = row[name]
            assert in_json[row.tag][name] == in_parquet[row.tag][name] == value
            assert float(in_csv[row.tag][name] or "nan") == pytest.approx(
                value if value is not None else np.nan, nan_ok=True
            )
            assert (in_excel[row.tag][name.replace("_", " ")] or None) == pytest.approx(value or None)
        shown_p = row.probability if row.in_control else None
        shown_S = row.S if row.finding in ("sticks", "probably_sticks", "backlash") else None
        for name, value in (
            ("probability", shown_p),
            ("S", shown_S),
            ("period_s", row.period_s),
            ("priority", row.priority),
        ):
            require_digits(on_page[row.tag][name], value)
            require_digits(in_browser[row.tag]["texts"].get(name, ""), value)
        if row.tag in in_terminal:
            assert in_terminal[row.tag][-1] == row.text("priority")
            for name in ("S", "period_s"):  # the finding stands in place of the probability
                text = row.text(name).replace("\xa0", " ")
                assert not text or text in [cell.replace("\xa0", " ") for cell in in_terminal[row.tag]]
    assert len(in_terminal) == min(10, len(audit.worst(10)))


def test_page_of_a_loop_has_the_numbers_of_its_row(audit):
    row = next(row for row in audit.rows if row.verdict == "stiction")
    text = html.unescape(re.sub(r"<[^>]+>", " ", write_loop_page(audit, row.tag).read_text(encoding="utf-8")))
    size = re.search(r"S\s=\s([\d.]+)\s% of span", text)
    assert size is not None
    assert size[1] == row.text("S")
    assert row.action.split(".")[0] in re.sub(r"\s+", " ", text)

"""Exports and the page of an audit, read back by other libraries and opened in a browser."""

from __future__ import annotations

import csv
import time
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from stiction.fleet import Audit, LoopRow, write_exports
from stiction.report import write_audit_page

FORMULAS = ["=1+1", "+1", "-FIC", "@sum", "\tTAB", "\rCR"]


def make_audit(folder, count: int) -> Audit:
    """An audit with made-up rows; the first tags look like formulas or markup."""
    rng = np.random.default_rng(0)
    tags = [
        *FORMULAS,
        "<script>alert(1)</script>",
        'FIC "quoted"',
        *(f"U{k % 40:02d}/FIC-{k:05d}" for k in range(count)),
    ]
    rows, parts = [], {}
    for k, tag in enumerate(tags[:count]):
        row = LoopRow(
            tag, f"U{k % 40:02d}", source="plant.parquet", status="diagnosed",
            verdict=("stiction", "no_stiction", "undecided")[k % 3], finding_text="What was found",
            reason="why", loop_state="in_control", probability=float(rng.uniform()), priority=1.0 - k / count,
            S=float(rng.uniform(-5, 5)) if k % 3 else None, period_s=float(rng.uniform(10, 1000)),
            data_warnings=("gaps",) if k % 7 == 0 else (),
        )  # fmt: skip
        rows.append(row)
        parts[tag] = (k + 1, "")
    run = {"started": "2026-03-02T06:00:00", "finished": None, "window": "..", "since": None, "until": None}
    return Audit(folder, rows, [], {"sources": ["plant.parquet"], "places": {}}, run, parts)


def test_exports_are_read_back_equal(tmp_path):
    audit = make_audit(tmp_path, 60)
    csv_path, parquet, excel = write_exports(audit)
    frame = pl.read_parquet(parquet)
    assert frame["tag"].to_list() == [row["tag"] for row in audit.rows]
    assert frame["S"].to_list() == [row["S"] for row in audit.rows]
    with csv_path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["tag"] for row in rows[:6]] == ["'" + tag for tag in FORMULAS]
    assert rows[20]["tag"] == audit.rows[20]["tag"]
    assert [float(row["S"]) for row in rows if row["S"]] == [row["S"] for row in audit.rows if row["S"] is not None]
    assert any(row["S"].startswith("-") for row in rows)
    from openpyxl import load_workbook
    from python_calamine import CalamineWorkbook

    sheet = load_workbook(excel)["Loops"]
    cells = list(sheet.iter_rows(values_only=True))
    assert cells[0][0] == "tag"
    assert sheet.freeze_panes == "B2"
    [table] = sheet.tables.values()
    assert (table.ref, table.autoFilter.ref) == (sheet.dimensions, sheet.dimensions)
    assert {cell.data_type for cell in sheet["A"]} == {"s"}
    S = cells[0].index("S")
    assert [row[S] for row in cells[1:]] == pytest.approx([row["S"] for row in audit.rows], nan_ok=True)
    calamine = CalamineWorkbook.from_path(str(excel)).get_sheet_by_name("Loops").to_python()
    assert [row[0] for row in calamine[1:]] == [row[0].replace("_x000D_", "\r") for row in cells[1:]]
    assert calamine[1][0] == "=1+1"


def test_empty_audit_has_exports(tmp_path):
    audit = replace(make_audit(tmp_path, 1), rows=[], signal_parts={})
    write_exports(audit)
    assert write_audit_page(audit).is_file()


def test_areas_are_drawn_only_where_they_are_known(tmp_path):
    audit = make_audit(tmp_path, 60)
    assert '<svg class="treemap"' in write_audit_page(audit).read_text()
    nameless = replace(audit, rows=[replace(row, area="") for row in audit.rows])
    page = write_audit_page(nameless).read_text()
    assert '<svg class="treemap"' not in page
    assert "No areas are known. The column area of a map, given with --map" in page


def test_page_of_10_000_loops_in_a_browser(tmp_path, browser):
    audit = make_audit(tmp_path, 10_000)
    page = browser.new_page()
    problems, requests = [], []
    page.on("console", lambda message: problems.append(message.text))
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(write_audit_page(audit).as_uri())
    page.wait_for_selector("tr.row")
    assert page.locator("tr.row").first.locator("td").first.text_content() == "=1+1"
    assert page.locator("#shown").text_content() == "10000 of 10000 loops"
    script = """(name) => { const button = document.querySelector(`[data-name="${name}"]`);
                const began = performance.now(); button.click(); document.body.offsetHeight;
                return performance.now() - began; }"""
    times = {name: min(page.evaluate(script, name) for _ in range(3)) for name in ("tag", "S", "priority")}
    assert max(times.values()) < 200.0, times
    page.locator('[data-name="S"]').click()
    wanted = sorted(row["S"] for row in audit.rows if row.text("S"))
    shown = float(page.locator("tr.row").first.locator("td").nth(4).text_content())
    assert shown in (pytest.approx(wanted[0], rel=1e-3), pytest.approx(wanted[-1], rel=1e-3))
    page.fill("#find", "u07/ 00047")
    assert page.locator("#shown").text_content() == "1 of 10000 loops"
    page.locator("tr.row").first.click()
    assert page.locator("#details-title").text_content() == "U07/FIC-00047"
    page.keyboard.press("Escape")
    page.fill("#find", "<script>")
    assert page.locator("tr.row").count() == 1
    time.sleep(0.2)
    assert problems == []
    assert [url for url in requests if not url.startswith("file://")] == []
    page.close()

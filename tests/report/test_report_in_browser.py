"""The report as a browser shows it: offline, drawn, sortable by keyboard, whole on paper."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from report.diagnoses import diagnosis, record
from stiction.report import Cell, Table, write_page, write_report

if TYPE_CHECKING:
    from pathlib import Path

EVIL = '</script><script>window.hacked=1</script><img src="https://elsewhere.example/x.png" onerror="window.hacked=1">'


@pytest.fixture
def visit(browser):
    """Open a file; fail on any request off the disk and on any error or complaint in the console."""
    pages, trouble = [], []

    def opened(path: Path, anchor: str = ""):
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        pages.append(page)
        page.on(
            "request",
            lambda request: request.url.startswith(("file://", "data:", "blob:")) or trouble.append(request.url),
        )
        page.on("console", lambda message: trouble.append(message.text))
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.goto(path.as_uri() + anchor)
        return page

    yield opened
    for page in pages:
        page.close()
    assert trouble == []


def until(page, said):
    """Wait until the expression is true; the page's own policy forbids playwright's way of waiting."""
    for _ in range(100):
        if page.evaluate(said):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"still not true after 5 s: {said}")


def drawn(page):
    page.locator(".plot .main-svg").first.wait_for()
    return page.locator(".plot[data-drawn]").count()


def test_one_loop_draws_every_figure_and_a_zoom_moves_both_trends(tmp_path, visit):
    page = visit(write_report([diagnosis(800)], tmp_path / "one.html"))
    page.get_by_text("How each measured feature counts").click()
    for k in range(11):
        page.locator(".plot").nth(k).scroll_into_view_if_needed()
    until(page, "document.querySelectorAll('.plot .xy, .plot .draglayer').length >= 11")
    assert drawn(page) == 11
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280
    buttons = (
        page.locator(".plot").first.locator(".modebar-btn").evaluate_all("(all) => all.map((b) => b.dataset.title)")
    )
    assert any("Zoom" in button for button in buttons)
    assert not [button for button in buttons if re.search("share|cloud|studio|upload|edit", button, re.IGNORECASE)]
    page.evaluate("Plotly.relayout(document.querySelector('.plot'), {'xaxis.range': [5, 10]})")
    axes = page.evaluate(
        "(() => { const plots = document.querySelector('.plot')._fullLayout._plots;"
        " return [plots.xy.xaxis.range, plots.xy2.xaxis.range]; })()"
    )
    assert axes == [[5, 10], [5, 10]]


def test_folded_loops_are_drawn_only_when_opened(tmp_path, visit):
    loops = [diagnosis(400, run=record(400, tag=f"FIC-{k}")) for k in range(3)]
    page = visit(write_report(loops, tmp_path / "three.html"))
    page.wait_for_timeout(200)
    assert page.locator(".plot[data-drawn]").count() == 0
    assert page.evaluate("typeof Plotly") == "undefined"
    page.get_by_role("link", name="FIC-1").focus()
    page.keyboard.press("Enter")
    assert drawn(page) > 0
    assert page.locator("details[open]").count() == 1
    assert page.locator("details[open] > summary").inner_text().startswith("FIC-1 ")


def test_the_table_sorts_by_keyboard_and_says_so(tmp_path, visit):
    rows = [["b", 10.0], ["a", 9.0], ["c", None], [Cell("d", sort="aa"), Cell("big", sort=1e3)]]
    page = visit(write_page("t", [Table(["name", "value"], rows, sortable=True)], tmp_path / "table.html"))

    def press(column):
        page.get_by_role("button", name=column).focus()
        page.keyboard.press("Enter")
        return "".join(page.locator("tbody tr td:first-child").all_inner_texts())

    assert press("value") == "abdc"
    assert page.locator("th[aria-sort]").get_attribute("aria-sort") == "ascending"
    assert press("value") == "dbac"
    assert page.locator("th[aria-sort]").get_attribute("aria-sort") == "descending"
    assert press("name") == "adbc"
    assert page.locator("th[aria-sort]").count() == 1


def test_loops_without_a_period_and_files_not_diagnosed_come_last_either_way(tmp_path, visit):
    loops = [diagnosis(400, run=record(400, tag=tag)) for tag in ("FIC-1", "FIC-2", "FIC-3")]
    rhythms = ((False, 1.0, 9.0), (True, 9.0, 1.0), (True, 60.0, 2.0))
    loops = [
        replace(
            loop,
            segment=replace(
                loop.segment,
                oscillation=replace(loop.oscillation, oscillating=cycles, period=period, amplitude_op=swing),
            ),
        )
        for loop, (cycles, period, swing) in zip(loops, rhythms, strict=True)
    ]
    page = visit(write_report(loops, tmp_path / "some.html", failures=[("b.csv", "no such file.")]))
    for column in ("Period", "OP ±"):
        for way in ("ascending", "descending"):
            page.get_by_role("button", name=column).first.click()
            assert page.locator("th[aria-sort]").get_attribute("aria-sort") == way
            assert page.locator("tbody tr td:first-child").all_inner_texts()[2:4] == ["FIC-1", "b.csv"]


def test_on_a_phone_the_whole_table_is_in_sight(tmp_path, visit):
    loops = [diagnosis(400, run=record(400, tag=f"FIC-{k}")) for k in range(2)]
    page = visit(write_report(loops, tmp_path / "phone.html"), "#loop-1")
    page.set_viewport_size({"width": 390, "height": 844})
    drawn(page)
    until(page, "document.documentElement.scrollWidth <= 390")  # plots drawn on the wide page follow a moment later
    beyond = (
        "[...document.querySelectorAll('main td, main th, main p')].filter((e) => e.offsetParent !== null"
        " && e.getBoundingClientRect().right > 391).map((e) => e.textContent)"
    )
    assert page.evaluate(beyond) == []
    row = page.locator("table.sortable tbody tr").first
    assert row.locator("td").last.is_visible()
    assert row.evaluate("(row) => row.getBoundingClientRect().height") < 300
    assert page.get_by_role("button", name="Period").is_visible()


def test_names_from_a_file_run_nothing(tmp_path, visit):
    run = replace(record(400), tag=EVIL)
    evidence = tuple(replace(one, why=EVIL) for one in diagnosis(400).evidence)
    bad = diagnosis(400, run=run, evidence=evidence)
    page = visit(write_report([bad, replace(bad, verdict="undecided")], tmp_path / "evil.html"), "#loop-1")
    drawn(page)
    assert page.evaluate("window.hacked") is None
    assert page.locator("img").count() == 0


def test_an_anchor_opens_a_loop_and_paper_clips_nothing_of_it(tmp_path, visit):
    loops = [diagnosis(400, run=record(400, tag=f"FIC-{k}")) for k in range(2)]
    page = visit(write_report(loops, tmp_path / "print.html"), "#loop-1")
    drawn(page)
    assert page.locator("details[open]").get_attribute("id") == "loop-1"
    page.set_viewport_size({"width": 680, "height": 1000})
    page.emulate_media(media="print")
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    widest = page.evaluate(
        "Math.max(...[...document.querySelectorAll('.plot .main-svg, table, .headline, .figure')]"
        ".filter((e) => e.offsetParent !== null || e.closest('.plot')).map((e) => e.getBoundingClientRect().right))"
    )
    assert widest <= 681
    assert page.locator(".plot[data-drawn]").count() == 9  # the bars of the features stay folded
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 1280, "height": 900})
    until(page, "document.querySelector('.plot[data-drawn] .main-svg').getBoundingClientRect().width > 900")

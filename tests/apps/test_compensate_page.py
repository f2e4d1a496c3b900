"""The page of ``stiction compensate``: every block it promises, and what a browser makes of it."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest

from stiction.apps.cli import main
from stiction.report.figures.label_placement import PLOT_SIZE_PX, place_labels
from stiction.report.pages.trial import settings_text

FIGURES = (
    "PV before and after", "OP and valve position before and after", "PV deviation against stem travel",
    "Sensitivity to S and J", "The twin over the record", "Oscillation and load response by retuning",
)  # fmt: skip
SECTIONS = ("Before and after", "The remedies", "The twin", "Retuning", "Work order")
REMEDIES = (
    "do nothing", "fix the valve", "retune", "knocker", "variable pulses", "constant reinforcement",
    "knocker that stops", "integral deadband", "two-move", "four-move",
)  # fmt: skip


@pytest.fixture(scope="module")
def page(tmp_path_factory, sticky_csv):
    """The page of a sticky loop's record."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "a.csv").write_text(sticky_csv)
    assert main(["compensate", str(folder / "a.csv"), "--seeds", "2", "--report", str(folder / "r.html")]) == 1
    return folder / "r.html"


def test_all_blocks_are_there(page):
    text = page.read_text()
    assert re.findall(r"<h2[^>]*>([^<]+)</h2>", text) == list(SECTIONS)
    assert re.findall(r'figure-title">([^<]+)<', text) == list(FIGURES)
    assert "Until the shutdown: " in text
    assert "Drawbacks: stem travel" in text
    assert "Work order: control valve of FIC-101, repair" in text
    assert "Compensation off, by / date" in text
    rows = re.findall(r"<tr>\s*<td[^>]*>(.*?)</td>", text, re.DOTALL)
    names = [re.sub(r"<svg.*?</svg>", "", row).strip() for row in rows]
    for name in REMEDIES:
        assert names.count(name) == 2, name


def test_what_if_has_neither_overlay_nor_work_order(run, folder):
    run("compensate", "--valve", "kano:S=5,J=2", "--seeds", "1", "--report", "r.html")
    text = (folder / "r.html").read_text()
    assert re.findall(r"<h2[^>]*>([^<]+)</h2>", text) == list(SECTIONS[:-1])
    assert "The twin over the record" not in text
    assert "The loop was not identified from a record" in text


def test_a_refusal_is_a_page_without_figures(run, folder, healthy_csv):
    run("compensate", "-", "--report", "r.html", stdin=healthy_csv.encode())
    text = (folder / "r.html").read_text()
    assert "No advice" in text
    assert "nothing to compensate" in text
    assert len(text) < 100_000, "the plot library was written for no plot"


def test_a_line_ends_only_between_two_settings():
    tried = SimpleNamespace(remedy=SimpleNamespace(settings={"Kc": 0.2, "Ti": 10.0, "move": None}))
    assert settings_text(tried).split(" ") == ["Kc\u00a00.2\u00a0%\u00a0per\u00a0PV\u00a0unit,", "Ti\u00a010\u00a0s"]


def test_names_cover_neither_points_nor_each_other():
    """Ten points as trials have them, three of them in one place: each name is written once."""
    at = [(5.0, 40.0), (6.0, 41.0), (4.0, 40.0), (60.0, 80.0), (170.0, 300.0), (150.0, 280.0), (172.0, 315.0)]
    at += [(240.0, 140.0), (238.0, 160.0), (290.0, 60.0)]
    placed = place_labels(REMEDIES, at)
    written = [name for text, _ in placed for name in text.split("<br>") if name]
    assert sorted(written) == sorted(REMEDIES)
    assert placed[0][0].count("<br>") == 2
    right = {name: place for (name, place) in placed if name == REMEDIES[9]}
    assert right[REMEDIES[9]].endswith("left"), f"a name beside the edge of {PLOT_SIZE_PX} must turn inwards"


@pytest.fixture
def tab(browser):
    """A browser's tab; fails on any request off the disk and on any complaint in the console."""
    trouble = []
    opened = browser.new_page(viewport={"width": 390, "height": 900})
    opened.on("request", lambda r: r.url.startswith(("file://", "data:", "blob:")) or trouble.append(r.url))
    opened.on("console", lambda message: trouble.append(message.text))
    opened.on("pageerror", lambda error: trouble.append(str(error)))
    yield opened
    assert trouble == []


def test_a_browser_draws_it_whole_on_telephone_screen_and_paper(page, tab):
    tab.goto(page.as_uri())
    plots = tab.locator(".plot")
    for k in range(len(FIGURES)):
        plots.nth(k).scroll_into_view_if_needed()
        plots.nth(k).locator(".main-svg").first.wait_for()
    shown = " ".join(plots.nth(2).locator("text").all_text_contents())
    for name in REMEDIES:
        assert name in shown
    panels = plots.nth(0).locator(".annotation-text").all_text_contents()
    assert (panels[0], panels[-1], len(panels)) == ("do nothing", "fix the valve", 3)
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    captions = "Math.max(...[...document.querySelectorAll('caption')].map((e) => e.getBoundingClientRect().width))"
    assert tab.evaluate(captions) <= 390 - 2 * 16
    tab.set_viewport_size({"width": 1280, "height": 900})
    tab.wait_for_timeout(300)
    assert tab.evaluate("document.documentElement.scrollWidth") <= 1280
    hidden = "Math.max(...[...document.querySelectorAll('.table-box')].map((e) => e.scrollWidth - e.clientWidth))"
    assert tab.evaluate(hidden) == 0
    tab.set_viewport_size({"width": 680, "height": 1000})
    tab.emulate_media(media="print")
    tab.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    tab.wait_for_timeout(300)
    printed = "[...document.querySelectorAll('.plot .main-svg, table, .sheet')]"
    assert tab.evaluate(f"Math.max(...{printed}.map((e) => e.getBoundingClientRect().right))") <= 681

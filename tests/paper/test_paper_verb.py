"""``stiction paper``: text, JSON, page; the page offline in a browser."""

from __future__ import annotations

import contextlib
import io
import json
import re

import pytest

from stiction.apps.cli import main
from stiction.report.pages.paper import PARTS


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """The page and the text of one run."""
    target = tmp_path_factory.mktemp("paper") / "paper.html"
    with contextlib.redirect_stdout(io.StringIO()) as text:
        assert main(["paper", "--report", str(target)]) == 0
    return target, text.getvalue()


@pytest.fixture
def page(walked):
    return walked[0]


def test_text_names_every_part(walked):
    out = walked[1]
    for name in PARTS.values():
        assert f"\n{name}\n" in out
    assert "5 slips of 0.95 in" in out
    assert "recorded data of the paper are not available" in out


def test_json_holds_the_numbers_of_all_parts(capsys):
    assert main(["paper", "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert list(numbers) == list(PARTS)
    # N8 and N9: cycles A and C of the paper's loop.
    cycles = [c for c in numbers["figure7"]["corrected"] if c["family"] == "half" and c["kind"] == "cycle"]
    assert [c["amplitude"] for c in cycles] == pytest.approx([0.5730, 0.9448], abs=1e-4)
    assert [c["period_s"] for c in cycles] == pytest.approx([21.11, 16.28], abs=0.01)
    assert [c["exact"]["period_s"] for c in cycles] == pytest.approx([21.115, 16.234], rel=1e-3)
    printed = numbers["figure7"]["printed"]
    assert (printed[-1]["amplitude"], printed[-1]["period_s"]) == pytest.approx((0.987, 20.7), rel=2e-3)
    assert len(json.dumps(numbers)) < 200_000


def test_one_figure_brings_its_series(capsys):
    assert main(["paper", "--figure", "2", "--json"]) == 0
    (panel, *_) = json.loads(capsys.readouterr().out)["figure2"]["panels"]
    assert len(panel["position"]) == len(panel["pressure"]) == 9001


@pytest.mark.parametrize("number", ["1", "9"])
def test_a_figure_that_is_not_there_is_wrong_usage(capsys, number):
    assert main(["paper", "--figure", number]) == 2
    assert "is outside 2 to 8" in capsys.readouterr().err


def test_a_page_of_another_program_is_left_alone(tmp_path, capsys):
    other = tmp_path / "thesis.html"
    other.write_text("mine")
    assert main(["paper", "--figure", "3", "--report", str(other)]) == 3
    assert other.read_text() == "mine"
    assert "is not replaced" in capsys.readouterr().err


def test_page_says_what_is_simulated_and_asks_no_network(page):
    text = page.read_text(encoding="utf-8")
    assert "Every curve here is simulated" in text
    body = text[: text.index("<script")] + text[text.rindex("</script>") :]
    assert re.findall(r'(?:src|href)="(https?://[^"]+)"', body) == []


def test_page_draws_every_figure_offline(page, browser):
    trouble: list[str] = []
    view = browser.new_page(viewport={"width": 1280, "height": 900})
    local = ("file://", "data:", "blob:")
    view.on("request", lambda request: request.url.startswith(local) or trouble.append(request.url))
    view.on("console", lambda message: trouble.append(message.text))
    view.on("pageerror", lambda error: trouble.append(str(error)))
    view.goto(page.as_uri())
    plots = view.locator(".plot")
    # Six panels of Fig. 2, four ramps, two each of Fig. 5, eq. 5, eqs. 6-7 and Fig. 7, one each of Figs. 6 and 8.
    assert plots.count() == 20
    for k in range(plots.count()):
        plots.nth(k).scroll_into_view_if_needed()
        plots.nth(k).locator(".main-svg").first.wait_for()
    assert view.locator(".plot[data-drawn]").count() == 20
    assert view.evaluate("document.documentElement.scrollWidth") <= 1280
    assert view.locator("figcaption").count() >= 20
    assert trouble == []

"""The what-if and textbook screens in Chromium: sliders, numbers, address, keyboard, errors, accessibility."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

import stiction as st

WAIT_MS = 180_000
"""Longest time until the kernels of a new server are warm [ms]."""


def open_screen(page: Any, address: str) -> None:
    """Open a screen, a part of the address after "#/"."""
    page.evaluate("place => { location.hash = place; }", f"#/{address}")
    expect(page.locator(f".screen-{address.split('?')[0]} h1")).to_be_visible()


def open_whatif(page: Any, query: str = "") -> Any:
    """Open the what-if screen; return the locator of its sentence."""
    open_screen(page, f"whatif{query}")
    sentence = page.locator("#whatif-answer")
    expect(sentence).to_contain_text("simulated loop", timeout=WAIT_MS)
    return sentence


def move(page: Any, name: str, position: int) -> None:
    """Move a slider as the mouse does."""
    page.locator(f".slider[data-name={name}]").evaluate(
        "(slider, position) => { slider.value = position; slider.dispatchEvent(new Event('input', {bubbles: true})); }",
        str(position),
    )


def serious_faults(page: Any) -> list[str]:
    """Faults of accessibility that axe calls serious or critical."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [f"{one['id']}: {one['nodes'][0]['html']}" for one in found if one["impact"] in ("serious", "critical")]


def test_a_slider_moves_the_picture_the_number_and_the_address(page: Any) -> None:
    sentence = open_whatif(page)
    before = sentence.inner_text()
    expect(page.locator(".cycles-sentence")).to_contain_text("One stable limit cycle is predicted", timeout=WAIT_MS)
    move(page, "S", 600)
    expect(sentence).not_to_have_text(before)
    number = page.locator(".number-field[data-name=S]")
    expect(number).to_have_value("12")
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(12.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    [cycle] = st.predict_limit_cycles(loop)
    assert cycle.exact is not None
    row = page.locator("[aria-label='Predicted limit cycles'] tbody tr")
    expect(row).to_contain_text(f"{float(f'{cycle.exact.period:.5g}'):g} s")
    expect(page).to_have_url(re.compile(r"#/whatif\?.*S=12(&|$)"))
    shown = sentence.inner_text()
    page.reload()
    expect(sentence).to_have_text(shown, timeout=WAIT_MS)
    page.get_by_role("button", name="Reset to the example").click()
    expect(sentence).to_have_text(before)
    expect(number).to_have_value("5")


def test_the_number_field_and_the_keyboard_do_what_the_slider_does(page: Any) -> None:
    sentence = open_whatif(page)
    number, slider = page.locator(".number-field[data-name=Kc]"), page.locator(".slider[data-name=Kc]")
    number.fill("0.1")
    number.press("Enter")
    number.blur()
    expect(slider).to_have_attribute("aria-valuetext", re.compile("^0.1 "))
    slider.focus()
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    assert float(number.input_value()) > 0.1
    page.get_by_label("Valve model").select_option("ideal")
    expect(sentence).to_have_text("The simulated loop comes to rest: OP stays at 50 %, PV at the set point.")
    expect(page.locator(".cycles-sentence")).to_have_text("No limit cycle: the valve does not stick.", timeout=WAIT_MS)
    page.get_by_label("Valve model").select_option("srinivasan")
    expect(page.locator(".slider[data-name=r]")).to_be_visible()


def test_number_out_of_range_is_refused_and_the_screen_goes_on(page: Any) -> None:
    sentence = open_whatif(page)
    number = page.locator(".number-field[data-name=S]")
    number.fill("300")
    number.blur()
    trouble = page.locator(".trouble .problem")
    expect(trouble).to_have_text(
        "Deadband plus stickband S = 300 % of span is outside 0 to 100 % of span. Give a value within these limits."
    )
    expect(sentence).to_have_text("These settings cannot be simulated.")
    number.fill("wide")
    number.blur()
    expect(trouble).to_contain_text("must be a number in % of span")
    number.fill("4")
    number.blur()
    expect(sentence).to_contain_text("oscillates")
    expect(trouble).to_have_count(0)


def test_unknown_loop_is_refused(server: Any, open_page: Any) -> None:
    page = open_page(server, "#/whatif?set=session&key=7", expected=("404",))
    expect(page.locator(".problem").filter(has_text="This loop is unknown")).to_be_visible()


def test_the_screen_starts_from_a_dropped_record(serve: Any, open_page: Any) -> None:
    server = serve()
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 150.0, 2500.0, np.r_[np.full(30, 3.0), np.zeros(2470)], 3, pv_start=150.0, op_start=50.0)
    assert record.pv is not None
    assert record.sp is not None
    rows = zip(range(2500), record.pv, record.sp, record.op, strict=True)
    lines = [f"{t},{y:.3f},{r:g},{u:.3f}\n" for t, y, r, u in rows]
    loops, [key] = server.read_and_diagnose("time,FIC-1.PV,FIC-1.SP,FIC-1.OP\n" + "".join(lines))
    page = open_page(server)
    sentence = open_whatif(page, f"?set={loops}&key={key}")
    expect(page.locator("h1")).to_have_text("What if? FIC-1")
    expect(page.locator(".record-sentence")).to_contain_text("The record oscillates with a period of")
    assert float(page.locator(".number-field[data-name=S]").input_value()) == pytest.approx(5.0, rel=0.1)
    identified = sentence.inner_text()
    page.get_by_role("button", name="Repaired valve").click()
    expect(sentence).not_to_have_text(identified)
    page.get_by_role("button", name="Reset to identified").click()
    expect(sentence).to_have_text(identified)
    assert serious_faults(page) == []


def test_the_textbook_answers_to_sliders_and_drag(page: Any) -> None:
    open_screen(page, "textbook")
    three = page.locator("[data-model='Three parameters (eq. 5)']")
    expect(three).to_have_text("The stem goes in stairs of 2 %.", timeout=WAIT_MS)
    ramp = page.locator(".draggable")
    box = ramp.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 - 200, box["y"] + box["height"] / 2, steps=10)
    page.mouse.up()
    expect(three).to_have_text("The stem sticks, jumps by 2 % and follows.")
    assert float(page.locator(".number-field[data-name=ramp-rate]").input_value()) > 0.5
    cycles = page.locator(".textbook-section .answer").first
    expect(cycles).to_contain_text("4 stable limit cycles", timeout=WAIT_MS)
    page.get_by_label("Valve model").select_option("kano")
    expect(cycles).to_contain_text("stable limit cycle, of period", timeout=WAIT_MS)
    jump = page.locator(".textbook-section .answer").last
    expect(jump).to_contain_text("moves the loop from one limit cycle", timeout=WAIT_MS)
    number = page.locator(".number-field[data-name=jump-pulse]")
    number.fill("0.1")
    number.blur()
    expect(jump).to_contain_text("does not move the loop")
    expect(page).to_have_url(re.compile(r"jump\.pulse=0\.1"))


def test_on_a_phone_a_slider_is_moved_beside_the_plot_of_pv(page: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    open_whatif(page)
    for name in ("S", "Kc", "dead_time"):
        slider = page.locator(f".slider[data-name={name}]")
        is_free = slider.evaluate(
            """slider => {
              slider.scrollIntoView({ block: "end" });
              const box = slider.getBoundingClientRect();
              return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2) === slider;
            }"""
        )
        assert is_free, name
        at, plot = slider.bounding_box(), page.locator(".whatif-near .uplot").bounding_box()
        answer = page.locator("#whatif-answer").bounding_box()
        assert 0 <= answer["y"] < answer["y"] + answer["height"] <= plot["y"] + 1, name
        assert plot["y"] + plot["height"] <= at["y"] < at["y"] + at["height"] <= 845, name


@pytest.mark.parametrize("screen", ["whatif", "textbook"])
@pytest.mark.parametrize("width", [390, 1280, 3840])
def test_no_screen_is_wider_than_the_window_or_hard_to_use(page: Any, screen: str, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    open_screen(page, screen)
    expect(page.locator(".uplot").first).to_be_visible(timeout=WAIT_MS)
    for _ in range(50):  # plots take their new width after the window's
        if page.evaluate("document.documentElement.scrollWidth") <= width:
            break
        page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("figure:not([aria-label])").count() == 0
    assert serious_faults(page) == []

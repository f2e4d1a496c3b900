"""Every screen and written page at the width of a phone and of a desk, light and dark: no fault of accessibility."""

from __future__ import annotations

import shutil
import time

import pytest

import stiction as st
from apps.web.screens import first_key, picture
from stiction.apps import cli
from stiction.report import write_audit_page, write_loop_page
from stiction.watch.alarm_rules import update_alarms
from stiction.watch.configuration import AlarmSettings, SourceSettings, WatchConfig
from stiction.watch.store import WatchStore

SCREENS = ("#/drop", "#/loops", "#/loop/audit1/{key}", "#/groups", "#/compare", "#/whatif", "#/whatif/audit1/{key}",
           "#/textbook")  # fmt: skip
READY = {"#/loops": ".virtual td.tag", "#/loop/": ".trends .u-over", "#/whatif": ".u-over", "#/textbook": ".u-over"}
"""Begin of a place -> what shows that it is drawn."""


def faults(page) -> list[str]:
    """Faults of accessibility of the page, all of them, and of its contrast in the dark; and what is too wide."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    page.emulate_media(color_scheme="dark")
    found += Axe().run(page, options={"runOnly": ["color-contrast"]}).response["violations"]
    page.emulate_media(color_scheme="light")
    wide = [] if page.evaluate("document.documentElement.scrollWidth <= innerWidth") else ["scrolls sideways"]
    return [f"{one['id']}: {one['nodes'][0]['html'][:200]}" for one in found] + wide


@pytest.mark.parametrize("width", [390, 1440])
def test_every_screen_is_accessible_in_both_themes(audit_server, open_page, width):
    """Pages that write an error to the console, or ask another server, fail in `open_page`."""
    page = open_page(audit_server, viewport={"width": width, "height": 900})
    for screen in SCREENS:
        place = screen.format(key=first_key(audit_server))
        page.evaluate("place => { location.hash = place; }", place)
        page.wait_for_selector(next((ready for begin, ready in READY.items() if place.startswith(begin)), "main h1"))
        page.wait_for_timeout(200)
        assert faults(page) == [], place
        picture(page, f"{place.strip('#/').split('/')[0]}-{width}")


@pytest.mark.parametrize("width", [390, 1440])
def test_every_written_page_is_accessible_in_both_themes(audit_folder, browser, width):
    audit = st.open_audit(audit_folder / "now")
    assert cli.main(["worklist", str(audit.folder), "--orders", "1"]) == 1
    pages = [write_audit_page(audit), write_loop_page(audit, "FIC-101"), *(audit.folder / "worklist").rglob("*.html")]
    assert len(pages) == 4
    context = browser.new_context(viewport={"width": width, "height": 900})
    page = context.new_page()
    trouble = []
    page.on("console", lambda message: message.type == "error" and trouble.append(message.text))
    page.on("request", lambda request: request.url.startswith("http") and trouble.append(request.url))
    for path in pages:
        page.goto(path.as_uri())
        assert faults(page) == [], path.name
    context.close()
    assert not trouble


def test_the_page_of_a_watch_is_accessible_at_both_widths(serve, open_page, audit_folder, tmp_path):
    shutil.copytree(audit_folder / "now", tmp_path / "watch" / "audit")
    store = WatchStore(tmp_path / "watch")
    config = WatchConfig(source=(SourceSettings(address="data"),), alarms=AlarmSettings(raise_windows=1))
    with store.transaction():
        update_alarms(store, config, st.open_audit(tmp_path / "watch" / "audit").rows, time.time())
    counts = dict.fromkeys(("tags", "received", "filled", "late", "lost", "breaks"), 3)
    source = {"connected": True, "failure": "", "warning": "", "refused": {}, **counts}
    store.set_fact("status", {"time": time.time(), "sources": {"opc.tcp://plant": source}})
    store.close()
    page = open_page(serve(str(tmp_path / "watch" / "audit")))
    page.click("nav >> text=Now")
    page.wait_for_selector("td:has-text('FIC-101')")
    for width in (390, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        assert faults(page) == [], width
        picture(page, f"now-{width}")


def test_a_very_wide_screen_does_not_scroll_sideways(audit_server, open_page):
    page = open_page(audit_server, "#/loops", viewport={"width": 3840, "height": 900})
    page.wait_for_selector(".virtual td.tag")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")

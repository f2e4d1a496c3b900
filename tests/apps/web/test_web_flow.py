"""The way of an engineer through the page, in Chromium: from a dropped file to a note that is still there."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest
import python_calamine

import stiction as st
from apps.web.screens import SCREENSHOTS, first_key, picture
from stiction.apps.output_files import csv_text


def sticky_csv(rename=("A1", "B2", "C3")) -> str:
    """A sticky flow loop whose headings say nothing."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    record = st.simulate(loop, 150.0, 1200.0, seed=1, pv_start=148.0, op_start=50.0, loop_type="flow")
    header, rows = csv_text(record).split("\n", 1)
    assert header == "time_s,SP,PV,OP,MV"
    lines = [",".join(line.split(",")[:4]) for line in rows.splitlines()]
    return "\n".join([",".join(["time_s", *rename]), *lines]) + "\n"


def serious_faults(page) -> list[str]:
    """Faults of accessibility that axe calls serious or critical."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [
        f"{one['id']}: {node['html'][:200]}"
        for one in found
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"][:3]
    ]


def test_from_a_dropped_file_to_a_saved_report(serve, open_page, tmp_path):
    server = serve()
    page = open_page(server)
    page.set_input_files(
        "input[type=file] >> nth=0", [{"name": "trend.csv", "mimeType": "text/csv", "buffer": sticky_csv().encode()}]
    )
    page.wait_for_selector("text=One loop was found.")  # by the data, under the name of the file
    page.click("summary:has-text('Which column is which')")
    for column, role in (("A1", "sp"), ("B2", "pv"), ("C3", "op")):
        page.get_by_label(f"Role of {column}").select_option(role)
        page.get_by_label(f"Loop of {column}").fill("FIC-101")
    assert serious_faults(page) == []
    page.click("text=Read again with these columns")
    page.wait_for_selector("td:text-is('FIC-101')")
    page.click("summary:has-text('Which column is which')")
    picture(page, "files")
    with page.expect_download() as download:
        page.click("text=Download the map")
    saved = tmp_path / "map.csv"
    download.value.save_as(saved)
    source = tmp_path / "trend.csv"
    source.write_text(sticky_csv())
    [record] = st.read(source, map=saved)
    assert (record.tag, record.provenance.columns["pv"]) == ("FIC-101", "B2")

    page.click("text=Diagnose the loop")
    page.wait_for_selector("h1:has-text('FIC-101')")
    assert page.locator(".verdict .chip").inner_text() == "Stiction"
    assert "Valve stiction: S" in page.locator(".lead").inner_text()
    page.wait_for_selector(".trends .u-over")
    picture(page, "loop")
    assert serious_faults(page) == []

    over = page.locator(".trends .u-over").first.bounding_box()
    page.mouse.move(over["x"] + 100, over["y"] + 50)
    page.mouse.down()
    page.mouse.move(over["x"] + 300, over["y"] + 50, steps=4)
    page.mouse.up()
    page.wait_for_selector(".trends .caption:has-text('From')")
    page.get_by_label("Show the whole record").click()
    page.wait_for_selector(".trends .caption:has-text('The whole record')")

    page.click("text=Compare repair, retuning and compensation")
    page.wait_for_selector("table:has-text('fix the valve')")
    with page.expect_download() as download:
        page.click("text=Save the full report")
    report = tmp_path / "report.html"
    download.value.save_as(report)
    assert "Valve stiction" in report.read_text(encoding="utf-8")

    page.click("text=Try it: what if?")
    page.wait_for_selector("main h1:has-text('What')")


def test_hostile_names_stay_text(serve, open_page):
    server = serve()
    page = open_page(server)
    evil = "<img src=x onerror=alert(1)>"
    text = sticky_csv((f"{evil}.SP", f"{evil}.PV", f"{evil}.OP"))
    page.set_input_files(
        "input[type=file] >> nth=0", [{"name": f"{evil}.csv", "mimeType": "text/csv", "buffer": text.encode()}]
    )
    page.click("text=Diagnose the loop")
    page.wait_for_selector(".verdict h1")
    assert evil in page.locator(".verdict h1").inner_text()
    page.fill("textarea[name=note]", evil)
    page.click("text=Save the note")
    page.wait_for_selector(".notes li:has-text('onerror')")
    page.evaluate("location.hash = '#/loops'")
    page.wait_for_selector(".virtual td.tag a")
    assert page.locator("img[src=x]").count() == 0


def test_pasted_table_is_read(page):
    page.click("summary:has-text('Paste a table')")
    pasted = sticky_csv(("FIC-7.SP", "FIC-7.PV", "FIC-7.OP")).replace(",", "\t")
    page.get_by_label("Table copied from a spreadsheet").fill(pasted)
    page.click("text=Read the pasted table")
    page.wait_for_selector("td:has-text('FIC-7')")


def test_table_pasted_and_file_dropped_anywhere_are_read(page):
    """Neither needs the zone: a browser opens a file that misses it, and the page would be gone."""
    texts = [sticky_csv((f"{loop}.SP", f"{loop}.PV", f"{loop}.OP")) for loop in ("FIC-8", "FIC-9")]
    page.evaluate(
        """([pasted, dropped]) => {
          const clipboard = new DataTransfer();
          clipboard.setData("text/plain", pasted);
          document.body.dispatchEvent(new ClipboardEvent("paste", {clipboardData: clipboard, bubbles: true}));
          const files = new DataTransfer();
          files.items.add(new File([dropped], "trend.csv"));
          document.body.dispatchEvent(new DragEvent("drop", {dataTransfer: files, bubbles: true}));
        }""",
        texts,
    )
    for loop in ("FIC-8", "FIC-9"):
        page.wait_for_selector(f"td:text-is('{loop}')")


def test_file_that_is_too_large_is_said_before_it_is_sent(page, tmp_path):
    large = tmp_path / "year.csv"
    with large.open("wb") as file:
        file.truncate(600_000_000)
    sent = []
    page.on("request", lambda request: request.method == "PUT" and sent.append(request.url))
    page.set_input_files("input[type=file] >> nth=0", large)
    page.wait_for_selector(".problem:has-text('year.csv is larger than 500 MB. Start the server with it')")
    assert sent == []


@pytest.mark.parametrize(("text", "words"), [("120", "outside 0 to 100 % of span"), ("abc", "must be a number")])
def test_slider_value_out_of_range_is_said(server, open_page, text, words):
    page = open_page(server, "#/whatif")
    page.locator("#whatif-answer", has_text="oscillates").wait_for()
    field = page.get_by_label("Deadband plus stickband S, number")
    field.fill(text)
    field.blur()
    page.wait_for_selector(f".problem:has-text('{words}')")
    field.fill("3")
    field.blur()
    page.locator("#whatif-answer", has_text="oscillates").wait_for()
    assert page.locator(".problem").count() == 0


def test_an_audit_is_browsed_exported_and_noted(serve, open_page, audit_folder, tmp_path):
    server = serve(str(audit_folder / "now"), str(audit_folder / "before"))
    page = open_page(server)
    page.wait_for_selector(".virtual td.tag a")
    assert page.locator("text=4 loops").count() == 1
    assert serious_faults(page) == []
    picture(page, "loops")
    page.get_by_label("Filter by text").fill("stiction fic-101")
    page.wait_for_selector("text=1 of 4 loops")
    for kind in ("xlsx", "csv", "parquet"):
        with page.expect_download() as download:
            page.click(f".exports button:has-text('{kind}')")
        download.value.save_as(tmp_path / f"loops.{kind}")
    frame = pl.read_parquet(tmp_path / "loops.parquet")
    assert frame["Loop"].to_list() == ["FIC-101"]
    assert frame["S [%]"].dtype == pl.Float64
    assert frame["S [%]"][0] == pytest.approx(5.0, abs=1.0)
    sheet = python_calamine.load_workbook(tmp_path / "loops.xlsx").get_sheet_by_index(0).to_python()
    assert [row[0] for row in sheet] == ["Loop", "FIC-101"]
    assert pl.read_csv(tmp_path / "loops.csv").columns == frame.columns

    page.locator(".virtual-box").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("h1:has-text('FIC-101')")
    page.wait_for_selector(".trends .caption:has-text('raw samples')")
    page.get_by_label("Mark").select_option("repaired")
    page.fill("textarea[name=note]", "packing replaced")
    page.click("text=Save the note")
    page.wait_for_selector(".notes li:has-text('packing replaced')")
    assert server.stop() == 0

    server = serve(str(audit_folder / "now"), str(audit_folder / "before"))
    page = open_page(server)
    page.wait_for_selector("text=notes confirm 1 of 1 verdicts")
    page.click(".virtual td.tag a:has-text('FIC-101')")
    page.wait_for_selector(".notes li:has-text('packing replaced')")
    for place, wanted in (("#/groups", "text=/group|No loops share/"), ("#/compare", "td:has-text('FIC-101')")):
        page.evaluate("place => { location.hash = place; }", place)
        page.wait_for_selector(wanted)
        page.wait_for_timeout(200)
        assert serious_faults(page) == []
        picture(page, place.strip("#/"))
    assert "New" in page.locator("tr:has-text('FIC-101')").inner_text()


def test_audit_beside_the_open_one_is_opened_and_compared(serve, open_page, audit_folder):
    server = serve(str(audit_folder / "now"))
    page = open_page(server, "#/compare")
    choice = page.get_by_label("Open another audit")
    choice.wait_for()
    name = f"{audit_folder.name}/before"
    assert name in choice.locator("option").all_inner_texts()
    choice.select_option(name)
    page.wait_for_selector("tr:has-text('FIC-101') :text('New')")
    assert serious_faults(page) == []
    assert server.call("POST", "/api/sets", {"name": str(audit_folder / "before")}).status == 404
    assert server.call("POST", "/api/sets", {"name": "../../etc"}).status == 404


def test_trends_open_on_some_cycles(audit_server, open_page):
    page = open_page(audit_server, f"#/loop/audit1/{first_key(audit_server)}")
    page.wait_for_selector(".trends .caption:has-text('From ')")
    picker = page.get_by_label("Time shown")
    assert picker.locator("option:checked").inner_text() == "8 cycles"
    picker.select_option("Whole record")
    page.wait_for_selector(".trends .caption:has-text('The whole record')")


def test_two_tabs_that_edit_one_note(serve, open_page, audit_folder):
    server = serve(str(audit_folder / "before"))
    one, other = (open_page(server, expected=("409",)) for _ in range(2))
    for page in (one, other):
        page.click(".virtual td.tag a:has-text('FIC-102')")
        page.wait_for_selector(".notes li:has-text('No note yet')")
    one.fill("textarea[name=note]", "packing ordered")
    one.click("text=Save the note")
    one.wait_for_selector(".notes li:has-text('packing ordered')")
    other.fill("textarea[name=note]", "valve is fine")
    other.click("text=Save the note")
    other.wait_for_selector("text=Another note was saved")
    told = other.locator(".problem").inner_text()
    assert "packing ordered" in told
    assert "valve is fine" in told
    other.click("text=Save mine too")
    other.wait_for_selector(".notes li:has-text('valve is fine')")
    from stiction.fleet.labels import read_labels

    assert [label.note for label in read_labels(audit_folder / "before")] == ["packing ordered", "valve is fine"]


def test_wrong_token_is_said_on_the_page(server, open_page, browser):
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.port}/#token=wrong")
    page.wait_for_selector("text=belongs to an earlier run")
    page.goto(f"http://127.0.0.1:{server.port}/#/loops")
    page.reload()
    page.wait_for_selector("text=not signed in")
    context.close()


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("#/loop/session/99", "This loop is unknown"),
        ("#/loop/nowhere/1", "not open"),
        ("#/nothing", "There is no screen"),
        ("#/loops/audit9", "not open"),
    ],
)
def test_unknown_places_are_said(server, open_page, place, message):
    page = open_page(server, place, expected=("404", "422"))
    page.wait_for_selector(f"text={message}")


def test_loop_prints_on_one_page(audit_server, open_page, tmp_path):
    server = audit_server
    page = open_page(server, f"#/loop/audit1/{first_key(server)}")
    page.wait_for_selector(".trends .u-over")
    page.wait_for_timeout(500)
    pdf = page.pdf(path=tmp_path / "loop.pdf", format="A4", prefer_css_page_size=True)
    if SCREENSHOTS:
        Path(SCREENSHOTS, "loop.pdf").write_bytes(pdf)
    assert count_pages(pdf) == 1


def count_pages(pdf: bytes) -> int:
    import re

    return max(int(number) for number in re.findall(rb"/Count (\d+)", pdf))

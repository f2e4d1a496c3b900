"""The local web page in Chromium: start, memory, a table of 10 000 loops, a day at 1 s, zoom."""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from bench import Row, Section

LOOPS = 10_000
"""Rows of the table [-]."""
DAY_SAMPLES = 86_400
"""Samples of a day at 1 s [-]."""
REPEATS = 7
PAINTED = """const painted = () => new Promise((done) => requestAnimationFrame(() => {
    const channel = new MessageChannel();
    channel.port1.onmessage = done;
    channel.port2.postMessage(0);
  }));
  const change = async (element, before) => {
    const end = performance.now() + 30000;
    while (element.textContent === before) {
      if (performance.now() > end) throw new Error(`${before}: nothing changed`);
      await new Promise((done) => setTimeout(done, 1));
    }
  };
  const present = (selector) => new Promise((done) => {
    const look = () => document.querySelector(selector) ? done() : requestAnimationFrame(look);
    look();
  });"""
OPEN = f"""async ([place, selector]) => {{
  {PAINTED}
  const begin = performance.now();
  location.hash = place;
  await present(selector);
  await painted();
  return performance.now() - begin;
}}"""
"""Opens a screen; returns the time until an element is painted [ms]."""
SORT = f"""async (name) => {{
  {PAINTED}
  const button = [...document.querySelectorAll(".virtual .sort")].find((one) => one.textContent === name);
  const begin = performance.now();
  button.click();
  await painted();
  return performance.now() - begin;
}}"""
FILTER = f"""async (text) => {{
  {PAINTED}
  const field = document.querySelector("input[type=search]");
  const count = document.querySelector(".tools [role=status]");
  const before = count.textContent;
  const begin = performance.now();
  field.value = text;
  field.dispatchEvent(new Event("input"));
  await change(count, before);
  await painted();
  return performance.now() - begin;
}}"""
ZOOM = f"""async (label) => {{
  {PAINTED}
  const caption = document.querySelector(".trends > .caption");
  const before = caption.textContent;
  const begin = performance.now();
  document.querySelector(`[aria-label="${{label}}"]`).click();
  await change(caption, before);
  await painted();
  return performance.now() - begin;
}}"""
"""Presses a zoom button; returns the time until the new trend is painted [ms]."""


def web() -> Section:
    """Measure all bounds of the page, one after the other, on one server."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = write_audit(Path(name))
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        begin = time.perf_counter()
        command = [sys.executable, "-m", "stiction", "serve", "--no-open", str(folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            page = browser.new_page(viewport={"width": 1920, "height": 1080})
            page.goto(address)
            page.wait_for_selector("main h1")
            start = time.perf_counter() - begin
            page.wait_for_selector(".virtual tbody td.tag", timeout=120_000)
            cold = time.perf_counter() - begin
            time.sleep(15)  # all workers are warm
            rows = measure(page)
            memory = resident_mb(server.pid)
            server.terminate()
            server.wait(20)
        browser.close()
    return Section(
        f"Web page: {LOOPS} loops, a day at 1 s",
        [Row("command to first page", start, "s"), Row("command to table, workers cold", cold, "s"), *rows,
         Row("resident memory of the server", memory, "MB")],
        ("bounds: first page 1.5 s, table 1 s, sort and filter 200 ms, day 1 s, zoom 100 ms, memory 100 MB",),
    )  # fmt: skip


def measure(page: Any) -> list[Row]:
    table = []
    for _ in range(REPEATS):
        page.evaluate(OPEN, ["#/drop", ".drop-zone"])
        table.append(page.evaluate(OPEN, ["#/loops", ".virtual tbody td.tag"]))
    sorts = [page.evaluate(SORT, name) for _ in range(REPEATS) for name in ("Loop", "Probability", "Verdict")]
    texts = ("fic-12", "no stiction", "u7", "u99/fic-1", "", "cannot tell", "fic-9")
    filters = [page.evaluate(FILTER, text) for text in texts]
    page.evaluate(FILTER, "")
    key = page.evaluate("document.querySelector('.virtual tbody tr:not(.spacer)').dataset.key")
    days = []
    for k in range(REPEATS):
        page.evaluate(OPEN, ["#/drop", ".drop-zone"])
        days.append(page.evaluate(OPEN, [f"#/loop/audit1/{int(key) + k}", ".trends .u-over"]))
    zooms = [page.evaluate(ZOOM, label) for _ in range(REPEATS) for label in ("Zoom in", "Later", "Earlier")]
    again = []
    for k in range(REPEATS):
        page.evaluate(OPEN, ["#/drop", ".drop-zone"])
        again.append(page.evaluate(OPEN, [f"#/loop/audit1/{int(key) + k}", ".trends .u-over"]))
    return [
        *pair("table, first paint", table),
        *pair("sort", sorts),
        *pair("filter", filters),
        *pair("day, first time", days),
        *pair("day, again", again),
        *pair("zoom", zooms),
    ]


def pair(what: str, times: list[float]) -> list[Row]:
    return [Row(f"{what}, median", statistics.median(times), "ms"), Row(f"{what}, longest", max(times), "ms")]


def resident_mb(process: int) -> float:
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1000.0
    return float("nan")


def write_audit(folder: Path) -> Path:
    """Audit some loops of a day at 1 s, and repeat their rows in the ledger until there are `LOOPS`."""
    import stiction as st
    from stiction.fleet.ledger import Ledger, ResultKey, sqlite_url
    from stiction.records.parquet_writer import to_parquet

    loop = st.Loop(st.PID(0.2, 30.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 30.0, 10.0), dt=1.0, noise=0.05)
    duration = float(DAY_SAMPLES)
    records = [
        st.simulate(loop, 150.0, duration, seed=k, pv_start=148.0, op_start=50.0, tag=f"FIC-{k}", loop_type="flow")
        for k in range(REPEATS + 1)
    ]
    to_parquet([replace(record, mv=None) for record in records], folder / "plant.parquet")
    out = folder / "audit"
    st.audit(folder / "plant.parquet", out, workers=1)
    book = Ledger(sqlite_url(out / "ledger.sqlite"))
    run = book.read_runs()[-1]
    key = ResultKey(*(run[name] for name in ResultKey._fields))
    real = book.read_results(key)
    places = book.read_loops()
    number, first = next(iter(real.items()))
    tags = [f"U{k % 100}/FIC-{k}" for k in range(LOOPS - len(real))]
    new = book.register([(tag, places[number]) for tag in tags])
    verdicts = ("stiction", "no_stiction", "undecided")
    rows = [
        replace_result(first, new[tag], {"tag": tag, "area": f"U{k % 100}", "verdict": verdicts[k % 3],
                       "probability": (k * 37 % 1000) / 1000, "priority": (k * 91 % 1000) / 2000})
        for k, tag in enumerate(tags)
    ]  # fmt: skip
    book.write_results(key, [(row, 0.1) for row in rows])
    loops = sorted({*run["body"]["loops"], *new.values()})
    book.end_run(run["id"], run["body"] | {"groups": [], "loops": loops})
    book.close()
    return out


def replace_result(row: Any, number: int, changes: dict[str, Any]) -> Any:
    return row._replace(loop=number, body=json.loads(json.dumps(row.body)) | changes)

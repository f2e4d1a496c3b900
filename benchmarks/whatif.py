"""The what-if screen in Chromium: the time from a move of a slider to the picture of the simulated trend."""

from __future__ import annotations

import shutil
import statistics
import subprocess
import sys
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from bench import Row, Section

if TYPE_CHECKING:
    from collections.abc import Iterator

MOVES = 200
"""Moves of a slider that are measured [-]."""
START_LIMIT_MS = 180_000
"""Longest time until the kernels are warm [ms]."""
SETTINGS = ("S", "J", "Kc", "Ti", "gain", "dead_time")
"""Settings that are moved in turn."""
MEASURE = """async ({moves, names}) => {
  const root = document.querySelector(".screen");
  const times = [];
  const painted = () => new Promise((done) => requestAnimationFrame(() => {
    const channel = new MessageChannel();
    channel.port1.onmessage = done;
    channel.port2.postMessage(0);
  }));
  for (let k = 0; k < moves; k += 1) {
    const slider = document.querySelector(`.slider[data-name="${names[k % names.length]}"]`);
    const drawn = new Promise((done) => root.addEventListener("drawn", done, {once: true}));
    const begin = performance.now();
    slider.value = String(350 + ((k * 37) % 300));
    slider.dispatchEvent(new Event("input", {bubbles: true}));
    await drawn;
    await painted();
    times.push(performance.now() - begin);
    await new Promise((done) => setTimeout(done, k % 10 === 9 ? 150 : 30));
  }
  return times;
}"""
"""Moves sliders one after the other and returns the times to the next painted frame [ms].

After every tenth move a longer pause lets the prediction of the limit cycles begin in its own process.
"""


def whatif() -> Section:
    """Median and 95 % of the moves; the kernels are warm."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None or find_spec("playwright") is None:
        return Section("What-if: slider to picture", [], ("not measured: no chromium, or playwright is not installed",))
    from playwright.sync_api import sync_playwright

    with serve() as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1920, "height": 1080})
        page.goto(address)
        page.wait_for_selector("main h1")
        page.goto(address.split("#", maxsplit=1)[0] + "#/whatif")
        page.locator("#whatif-answer", has_text="oscillates").wait_for(timeout=START_LIMIT_MS)
        page.locator(".cycles-sentence", has_text="predicted").wait_for(timeout=START_LIMIT_MS)
        page.evaluate(MEASURE, {"moves": 20, "names": SETTINGS})
        times = page.evaluate(MEASURE, {"moves": MOVES, "names": SETTINGS})
        browser.close()
    return Section(
        f"What-if: slider to picture, {MOVES} moves in Chromium",
        [
            Row("median", statistics.median(times), "ms"),
            Row("95 %", statistics.quantiles(times, n=20)[-1], "ms"),
            Row("longest", max(times), "ms"),
        ],
        ("bounds: median 50 ms, 95 % 100 ms; limit cycles are predicted after every tenth move",),
    )


@contextmanager
def serve() -> Iterator[str]:
    """Run the server and give its address."""
    command = (sys.executable, "-m", "stiction", "serve", "--no-open", "--port", "0")
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            yield server.stdout.readline().strip()
        finally:
            server.terminate()
            server.wait(10)

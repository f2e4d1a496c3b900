"""Draw the pictures of the documentation from simulated loops: `make picture`."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import stiction as st

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parent / "pictures"
INK, GRID, OP, MV, PV = "#24292f", "#d0d7de", "#0969da", "#bc4c00", "#1a7f37"


def sticky_loop() -> st.LoopRecord:
    """A flow loop whose valve has S = 5 %, J = 2 %, in its limit cycle."""
    loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = st.simulate(loop, sp=150.0, duration=3000.0, pv_start=149.0, op_start=50.0)
    return record.window(len(record) - 420, len(record))


class Panel:
    """A rectangle of the picture with its own scales."""

    def __init__(self, left: float, top: float, width: float, height: float, x: tuple, y: tuple) -> None:
        self.left, self.top, self.width, self.height, self.x, self.y = left, top, width, height, x, y
        self.parts = [f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="{GRID}"/>']

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Point of the picture."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return self.left + across * self.width, self.top + (1.0 - up) * self.height

    def line(self, x: np.ndarray, y: np.ndarray, colour: str) -> None:
        """A curve."""
        points = " ".join("{:.1f},{:.1f}".format(*self.at(a, b)) for a, b in zip(x, y, strict=True))
        self.parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.8"/>')

    def ticks(self, x: list[float], y: list[float]) -> None:
        """Numbers along the left and, if given, the lower edge."""
        for value in y:
            self.label(self.left - 6, self.at(0.0, value)[1] + 4, f"{value:g}", "end")
        for value in x:
            self.label(self.at(value, 0.0)[0], self.top + self.height + 16, f"{value:g}", "middle")

    def label(self, x: float, y: float, text: str, anchor: str = "start", colour: str = INK) -> None:
        """A word."""
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{text}</text>')


def room(signal: np.ndarray) -> tuple[float, float]:
    """Limits with a tenth of the range to spare."""
    spare = 0.1 * float(signal.max() - signal.min())
    return float(signal.min()) - spare, float(signal.max()) + spare


def picture(record: st.LoopRecord) -> str:
    """OP, valve position and PV in time; the valve's signature beside them."""
    op, pv, mv, t = record.op, record.pv, record.mv, record.time
    assert pv is not None
    assert mv is not None
    stem = Panel(50, 34, 480, 150, (0.0, t[-1]), room(op))
    stem.line(t, op, OP)
    stem.line(t, mv, MV)
    stem.ticks([], [48.0, 50.0, 52.0])
    stem.label(50, 24, "OP (controller output) [%]", colour=OP)
    stem.label(240, 24, "valve position [%]", colour=MV)
    flow = Panel(50, 214, 480, 110, (0.0, t[-1]), room(pv))
    flow.line(t, pv, PV)
    flow.ticks([0.0, 100.0, 200.0, 300.0, 400.0], [146.0, 150.0, 154.0])
    flow.label(50, 204, "PV [m³/h]", colour=PV)
    flow.label(530, 358, "time [s]", "end")
    valve = Panel(610, 34, 290, 290, room(op), room(op))
    valve.line(op, mv, MV)
    valve.ticks([48.0, 50.0, 52.0], [48.0, 50.0, 52.0])
    valve.label(610, 24, "valve position over OP: S = 5 %, J = 2 %", colour=MV)
    valve.label(900, 358, "OP [%]", "end")
    parts = "\n".join(part for panel in (stem, flow, valve) for part in panel.parts)
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 920 370" font-family="sans-serif" font-size="13"'
        ' role="img" aria-label="A loop with a sticky valve: its trends and the signature of its valve">\n'
        f'<rect width="920" height="370" fill="#ffffff"/>\n{parts}\n</svg>\n'
    )


def remedies() -> str:
    """PV and valve position of one loop with nothing done, with what is recommended and with a good valve."""
    loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    trial = st.compensate(loop, seeds=8)
    now = trial["do nothing"].behaviour
    parts = []
    names = ("do nothing", str(trial.recommended), "fix the valve")
    step = int(np.flatnonzero(np.diff(trial.trends[names[0]]["sp"]))[0])
    around = slice(step - 300, step + 300)
    runs = [{signal: series[around] for signal, series in trial.trends[name].items()} for name in names]
    pv = room(np.concatenate([run["pv"] for run in runs]))
    mv = room(np.concatenate([run[signal] for run in runs for signal in ("op", "mv")]))
    for k, (name, run) in enumerate(zip(names, runs, strict=True)):
        b, left = trial[name].behaviour, 50 + 295 * k
        t = run["time"] - run["time"][0]
        above, below = (
            Panel(left, 50, 270, 130, (0.0, t[-1]), pv),
            Panel(left, 210, 270, 110, (0.0, t[-1]), mv),
        )
        above.line(t, run["sp"], GRID)
        above.line(t, run["pv"], PV)
        below.line(t, run["op"], OP)
        below.line(t, run["mv"], MV)
        above.ticks([], [40.0, 50.0] if k == 0 else [])
        below.ticks([0.0, 200.0, 400.0], [50.0, 55.0] if k == 0 else [])
        above.label(left, 20, name)
        above.label(left, 40, f"PV deviation {b.pv_std / now.pv_std:.2f}, stem travel {b.travel / now.travel:.1f}")
        parts += [*above.parts, *below.parts]
    last = Panel(50, 210, 270, 110, (0.0, 1.0), mv)
    last.label(50, 200, "OP (controller output) [%]", colour=OP)
    last.label(235, 200, "valve position", colour=MV)
    last.label(910, 340, "time [s]", "end")
    body = "\n".join([*parts, *last.parts[1:]])
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 920 350" font-family="sans-serif" font-size="13"'
        ' role="img" aria-label="One loop with nothing done, with a compensator and with a good valve">\n'
        f'<rect width="920" height="350" fill="#ffffff"/>\n{body}\n</svg>\n'
    )


def drawn() -> Iterator[tuple[str, str]]:
    """Name and text of each picture."""
    yield "sticky-valve", picture(sticky_loop())
    yield "remedies", remedies()


def report_picture(target: Path) -> None:
    """Photograph the first lines of the report of a sticky loop; it needs Chromium and playwright."""
    from playwright.sync_api import sync_playwright

    loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    record = st.simulate(
        loop, sp=51.0, duration=3600.0, seed=1, pv_start=50.0, op_start=50.0, loop_type="flow", tag="FIC-101"
    )
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        page_file = Path(folder) / "report.html"
        st.write_report([st.diagnose(record)], page_file)
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1100, "height": 760}, color_scheme="light")
        page.goto(page_file.as_uri())
        page.wait_for_timeout(1500)
        page.screenshot(path=str(target))
        browser.close()


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, text in drawn():
        target = FOLDER / f"{name}.svg"
        target.write_text(text, encoding="utf-8")
        print(target)
    report_picture(FOLDER / "report.png")

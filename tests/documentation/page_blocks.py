"""Code blocks of the Markdown pages, and the files that the pages use."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stiction.simulation.plant import SimulatedPlant

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(
    r"(?:<!-- no-run: (?P<why>.+?) -->\n+)?^```(?P<kind>python|console)\n(?P<text>.*?)^```$", re.M | re.S
)
GENERATED = {"_build", "gallery", "generated"}


@dataclass(frozen=True)
class Block:
    """One block of a page."""

    page: str
    line: int
    kind: str
    text: str
    why_not: str

    @property
    def commands(self) -> list[str]:
        """Lines after a dollar sign, without the comment behind them."""
        return [line.split("  #")[0].strip() for line in re.findall(r"^\$ (.+)$", self.text, re.M)]


def pages() -> list[Path]:
    """All pages that people write."""
    inside = [path for path in (ROOT / "docs").rglob("*.md") if not GENERATED & set(path.parts)]
    return sorted([*ROOT.glob("*.md"), *inside])


def blocks(page: Path) -> list[Block]:
    """All blocks of a page that run or say why they do not."""
    text = page.read_text(encoding="utf-8")
    name = page.relative_to(ROOT).as_posix()
    return [
        Block(name, text.count("\n", 0, one.start("text")) + 1, one["kind"], one["text"], one["why"] or "")
        for one in BLOCK.finditer(text)
    ]


@cache
def simulate_one_unit(seed: int) -> SimulatedPlant:
    """One hour of the first of the four units of the demo plant; a test of the command runs all of it."""
    from stiction.simulation.plant import SimulatedPlant, simulate_plant

    plant = simulate_plant(seed, hours=1.0)
    loops = plant.loops[: len(plant.loops) // 4]
    tags = {one.record.tag for one in loops}
    return SimulatedPlant(loops, tuple(pair for pair in plant.connections if tags.issuperset(pair)))


def write_example_files(folder: Path) -> None:
    """Write the files that pages take as those of the reader: a loop, the same in German, and a small plant."""
    import stiction as st
    from stiction.apps.demo_plant import write_plant_files

    (folder / "stiction-plant").mkdir()
    write_plant_files(simulate_one_unit(0), folder / "stiction-plant")

    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, sp=51.0, duration=3600.0, seed=1, pv_start=50.0, op_start=50.0)
    rows = list(zip(run.time, run.sp, run.pv, run.op, strict=True))
    lines = ["time_s,SP,PV,OP", *(",".join(f"{value:.4f}" for value in row) for row in rows)]
    (folder / "FIC-101.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    german = ["Zeit;Durchfluss;Ventil", *(f"{t:.0f};{pv:.4f};{op:.4f}".replace(".", ",") for t, _, pv, op in rows)]
    (folder / "export.csv").write_text("\n".join(german) + "\n", encoding="utf-8")

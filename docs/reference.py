"""Write `reference.md`, the list of public names, from their docstrings: `make reference`."""

from __future__ import annotations

import inspect
from pathlib import Path

import stiction as st

PAGE = Path(__file__).with_name("reference.md")
ROOMS = {
    "stiction.models": "Valves, controllers, processes and compensators",
    "stiction.records": "Records",
    "stiction.sources": "Reading",
    "stiction.simulation": "Simulation",
    "stiction.limitcycle": "Limit cycles",
    "stiction.diagnosis": "Diagnosis",
    "stiction.valvetests": "Valve tests",
    "stiction.compensation": "Until the repair",
    "stiction.fleet": "Many loops",
    "stiction.report": "Reports",
    "stiction.errors": "What can go wrong",
}
HEAD = """# Public names

`import stiction as st` gives these; `help(st.diagnose)` tells parameters, units, errors, source and an example of each.
Written by `make reference` from the docstrings. Commands tell themselves: `stiction --help`.
"""


def page() -> str:
    """The page."""
    parts = [HEAD]
    for room, names in st._ROOMS.items():
        parts.append(f"\n## {ROOMS[room]}\n\n| `st.` | |\n|---|---|\n")
        parts += [f"| `{name}` | {_first_line(getattr(st, name))} |\n" for name in sorted(names, key=str.lower)]
    parts.append("\n## Data checks\n\n| `st.quality.` | |\n|---|---|\n")
    parts += [f"| `{name}` | {_first_line(getattr(st.quality, name))} |\n" for name in st.quality.__all__]
    return "".join(parts)


def _first_line(thing: object) -> str:
    said = (inspect.getdoc(thing) or "").splitlines()[0]
    return said.rstrip(".").replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

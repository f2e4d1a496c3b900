"""Write the numbers of the validation and the benchmark into the README: ``python docs/trust_numbers.py``."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README, VALIDATION, BENCHMARK = (ROOT / name for name in ("README.md", "docs/validation.md", "docs/benchmark.md"))
PLACE = re.compile(r"(<!-- trust numbers: .*? -->\n).*?(<!-- end of trust numbers -->)", re.S)


def trust_numbers(text: str, benchmark: str) -> str:
    """Return the list for the README from the texts of the validation and the benchmark page."""
    first, second = score_row(text, "## First simulator"), score_row(text, "## Second simulator")
    coverage = re.search(r"hold the true S in ([\d.]+)", text)
    recorded = re.search(r"(\d+) of (\d+) loops right, (\d+) wrong above 0.9 or below 0.1", text)
    if coverage is None or recorded is None:
        raise SystemExit(f"{VALIDATION.name} has another form than this script knows; adapt the script.")
    right, loops, wrong = map(int, recorded.groups())
    undecided = recorded_calls(text, "undecided")
    ours, best = zip(*re.findall(r"the verdict finds \*\*(\d+ %)\*\* .*?\*\*(\d+ %)\*\*", benchmark, re.S), strict=True)
    rate = re.search(r"At (\d+ %) false alarms", benchmark)
    if rate is None or len(ours) != 2:
        raise SystemExit(f"{BENCHMARK.name} has another form than this script knows; adapt the script.")
    return f"""1. Of simulated loops with a decided verdict, **{percent(first["right"])}** are right; {percent(first["undecided"])} are left undecided.
2. **{percent(first["false_alarms"])}** of the good valves are called sticky. At {rate[1]} false alarms **{ours[0]}** of the sticky ones are found; the best of
   ten published methods finds {best[0]} (second simulator: {ours[1]} and {best[1]}), see the [benchmark](docs/benchmark.md).
3. On a second simulator that was never used for training, **{percent(second["right"])}** of the decided verdicts are right.
4. The 95 % intervals of S contain the true value in **{percent(float(coverage[1]))}** of the sticky loops that were found.
5. Of {loops} recorded plant loops that the model never saw, **{right}** are right, {undecided} undecided, {loops - right - undecided} wrong ({wrong} of them with
   a probability above 0.9 or below 0.1).

All numbers come from the [validation](docs/validation.md), which `make validate` computes again.
"""  # noqa: E501


def score_row(text: str, heading: str) -> dict[str, float]:
    """Scores of all loops below a heading: name of the column -> value."""
    part = text[text.index(heading) :]
    lines = [line for line in part.splitlines() if line.startswith("|")]
    names = [cell.strip().replace(" ", "_") for cell in lines[0].strip("|").split("|")]
    values = next(line for line in lines if line.startswith("| all "))
    cells = [cell.strip() for cell in values.strip("|").split("|")]
    return {name: float(value) for name, value in zip(names[1:], cells[1:], strict=True)}


def recorded_calls(text: str, call: str) -> int:
    """Recorded loops with a call."""
    part = text[text.index("## Recorded loops") :].split("\n## ")[0]
    return sum(line.rstrip().endswith(f"| {call} |") for line in part.splitlines())


def percent(share: float) -> str:
    """Return a share as text."""
    return f"{100 * share:.0f} %"


def readme_with_numbers() -> str:
    """Return the README with the numbers of the validation page."""
    numbers = trust_numbers(*(page.read_text(encoding="utf-8") for page in (VALIDATION, BENCHMARK)))
    return PLACE.sub(rf"\g<1>\n{numbers}\g<2>", README.read_text(encoding="utf-8"))


def main() -> int:
    """Write the README."""
    README.write_text(readme_with_numbers(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

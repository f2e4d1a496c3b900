"""Measure what an audit loses: sticky loops that the screen leaves out, and verdicts that the short record changes.

``python -m calibration.screen_miss_rate --chunks 10`` prints counts for each simulator, of loops that were not used for
training.
"""

from __future__ import annotations

import argparse
from collections import Counter
from itertools import cycle, islice

from stiction.fleet.loop_diagnosis import diagnose_record
from stiction.fleet.screen import screen_record

import stiction as st
from calibration.loop_sets import FIRST_SIMULATOR, draw_chunk
from stiction.fleet import common_clock
from stiction.fleet.loop_row import WorkSettings
from stiction.fleet.source_parts import LoopPlace, SourcePart

__all__ = ["count_losses"]

SEEDS = {"first": 8, "second": 5}
"""Seeds of the loops of the validation."""


def count_losses(simulator: str, chunks: int) -> Counter[str]:
    """Diagnose each loop fully and as an audit does, and count.

    Parameters
    ----------
    simulator : str
        "first" or "second".
    chunks : int
        Chunks of loops [-].

    Returns
    -------
    Counter
        "loops", "skipped", "sticky", "sticky skipped", "called" (sticky and called so by the full diagnosis), "called,
        skipped", "called, not in the audit", "false" (good and called sticky by the full diagnosis), "false in the
        audit".
    """
    names = FIRST_SIMULATOR if simulator == "first" else ("second",)
    counts: Counter[str] = Counter()
    for number, name in enumerate(islice(cycle(names), chunks)):
        for known in draw_chunk(name, number, SEEDS[simulator]):
            record = known.record
            place = LoopPlace(record.tag, SourcePart(("simulation",)), 0)
            settings = WorkSettings(common_clock([record]))
            row = screen_record(place, record, settings).row
            skipped = row["status"] == "skipped"
            full = st.diagnose(record).verdict == "stiction"
            audited = not skipped and diagnose_record(record, settings, row)["verdict"] == "stiction"
            found = {
                "loops": True,
                "skipped": skipped,
                "sticky": known.sticky,
                "sticky skipped": known.sticky and skipped,
                "called": known.sticky and full,
                "called, skipped": known.sticky and full and skipped,
                "called, not in the audit": known.sticky and full and not audited,
                "called in the audit alone": known.sticky and audited and not full,
                "false": full and not known.sticky,
                "false in the audit": audited and not known.sticky,
            }
            counts.update(one for one, is_true in found.items() if is_true)
    return counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chunks", type=int, default=10, help="chunks of loops from each simulator")
    asked = parser.parse_args()
    for simulator in SEEDS:
        counts = count_losses(simulator, asked.chunks)
        print(f"{simulator} simulator: {', '.join(f'{name} {number}' for name, number in counts.items())}", flush=True)


if __name__ == "__main__":
    main()

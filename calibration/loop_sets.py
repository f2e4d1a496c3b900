"""Numbered chunks of loops with a known truth, drawn anew from their seeds wherever they are needed."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from calibration.populations import Case
    from calibration.populations.kinds import KindCase
    from calibration.second_simulator.kinds import SecondKind
    from stiction.records import LoopRecord

__all__ = ["FIRST_SIMULATOR", "SETS", "KnownLoop", "draw_chunk", "read_recorded_loops"]

CAUSES = (
    "stiction", "deadband", "tight tuning", "external disturbance",
    "stiction", "sensor", "saturation", "none",
)  # fmt: skip
"""Causes of the eight loops of a chunk of `population`: one in four sticks."""
STORED_EFFECTS = ("sampling", "averaging", "interpolation", "exception", "swinging door", "quantisation")
"""What a historian does to a loop of the set `stored`."""
STORED_SHARE = 0.25
"""Share of the loops of the set `kinds` that a historian stores [-]."""
MAX_EFFECT = 0.3
"""Largest strength of that effect [-]."""
FIRST_SIMULATOR = (
    "population", "stored", "plant", "upset", "position",
    "population", "stored", "plant", "wandering", "population", "split_range", "two_faults",
)  # fmt: skip
"""Sets of the first simulator, in the order of their chunks; half of the loops as a historian stores them."""
SETS = {
    "population": 8,
    "position": 8,
    "stored": 8,
    "plant": 6,
    "upset": 6,
    "wandering": 6,
    "two_faults": 6,
    "split_range": 6,
    "second": 8,
    "kinds": 24,
    "second_kinds": 19,
}
"""Sets of simulated loops and the loops in a chunk of each."""


@dataclass(frozen=True, slots=True)
class KnownLoop:
    """A record and what is known of its loop."""

    record: LoopRecord
    """The record."""
    loop: str
    """Name of the loop; records of one loop share it."""
    sticky: bool
    """Whether the valve sticks."""
    truth: dict[str, str | float] = field(default_factory=dict)
    """What else is known: cause, S, J, how the record was stored."""


def draw_chunk(name: str, number: int, seed: int) -> Iterator[KnownLoop]:
    """Draw the loops of one chunk.

    Parameters
    ----------
    name : str
        One of `SETS`.
    number : int
        Number of the chunk [-].
    seed : int
        Seed of the whole set.

    Yields
    ------
    KnownLoop
        One loop after the other.

    Examples
    --------
    >>> [loop.sticky for loop in draw_chunk("upset", 0, seed=1)]
    [True, False, False, True, False, False]
    """
    from calibration import populations

    own, count = 100_000 * seed + number, SETS[name]
    if name in ("second", "kinds", "second_kinds"):
        draw_own = {"second": _draw_second, "kinds": _draw_kinds, "second_kinds": _draw_second_kinds}[name]
        yield from draw_own(own, count)
        return
    if name in ("population", "stored", "position"):
        cases = populations.population(count, CAUSES, own, historian=False, position=name == "position")
    else:
        draw = {
            "plant": populations.plant_population, "upset": populations.upset_population,
            "wandering": populations.wandering_population, "two_faults": populations.two_fault_population,
            "split_range": populations.split_range_population,
        }[name]  # fmt: skip
        cases = islice(draw(count, own), count)
    rng = np.random.default_rng([own, 46])
    for i, case in enumerate(cases):
        record, effects = case.record, case.effects
        if name == "stored":
            record, effects = _store(case, rng)
        truth: dict[str, str | float] = {
            "cause": case.cause, "true_S": case.S, "true_J": case.J, "storage": "+".join(effects) or "raw",
            "stem_turns": count_stem_turns(record.op, case.S, case.J),
        }  # fmt: skip
        yield KnownLoop(record, f"{name}-{own}-{i}", case.sticky, truth)


def count_stem_turns(op: NDArray[np.float64], S: float, J: float) -> int:
    """How often the stem of a valve (S, J) reverses over a recorded OP; where it hardly does, stiction cannot show."""
    from stiction.diagnosis.identification.candidates import Valve
    from stiction.diagnosis.identification.identify import whole_position
    from stiction.records.gaps import interpolate_gaps

    if not S > 0.0 or not np.isfinite(op).any():
        return 0
    moves = np.diff(whole_position(interpolate_gaps(op), Valve(S, min(J / S, 1.0), 0.0, 0.0)))
    direction = np.sign(moves[moves != 0.0])
    return int(np.count_nonzero(np.diff(direction)))


def read_recorded_loops(folder: Path) -> Iterator[KnownLoop]:
    """Read the recorded loops with a label.

    Parameters
    ----------
    folder : Path
        Folder with `labels.csv` and the records that it names.

    Yields
    ------
    KnownLoop
        One record after the other.
    """
    from dataclasses import replace

    import stiction as st

    with (folder / "labels.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        kind = "analyser" if row["loop_type"] == "concentration" else row["loop_type"]
        [record] = st.read(folder / row["file"], dt=float(row["dt_s"]), loop_type=kind)
        record = replace(record, integrating=row["integrating"] == "true")
        yield KnownLoop(record, row["loop"], row["label"] == "stiction", {"cause": row["label"], "storage": "recorded"})


def _draw_second(own: int, count: int) -> Iterator[KnownLoop]:
    """Loops of the second simulator that are in control."""
    from calibration.second_simulator import sample_loop

    for i in range(count):
        loop = sample_loop(own * count + i)
        truth: dict[str, str | float] = {
            "cause": loop.truth.cause, "true_S": loop.truth.S, "true_J": loop.truth.J, "storage": loop.storage,
        }  # fmt: skip
        if loop.truth.in_control:
            yield KnownLoop(loop.record, loop.record.tag, loop.truth.sticky, truth)


def _draw_kinds(own: int, count: int) -> Iterator[KnownLoop]:
    """Loops of the first simulator of the kinds that advice is about, one in four as a historian stores it."""
    from calibration.populations.kinds import kind_population

    rng = np.random.default_rng([own, 56])
    for i, case in enumerate(kind_population(count, own)):
        record, effects = _store(case, rng) if rng.random() < STORED_SHARE else (case.record, ())
        yield KnownLoop(record, f"kinds-{own}-{i}", case.sticky, _kind_truth(case, "+".join(effects) or "raw"))


def _draw_second_kinds(own: int, count: int) -> Iterator[KnownLoop]:
    """Loops of the second simulator of the kinds that advice is about."""
    from calibration.second_simulator.kinds import SECOND_KINDS, sample_kind

    for i, kind in zip(range(count), SECOND_KINDS, strict=False):
        case = sample_kind(kind, own)
        sticky = case.S >= 1.0 and 0.1 * min(case.S, 1e9) <= case.J
        yield KnownLoop(case.record, f"second_kinds-{own}-{i}", sticky, _kind_truth(case, case.storage))


def _kind_truth(case: KindCase | SecondKind, storage: str) -> dict[str, str | float]:
    """Columns of a loop of a kind; its causes joined by a plus."""
    return {
        "cause": case.kind, "causes": "+".join(case.causes), "true_S": case.S, "true_J": case.J, "storage": storage,
        "stem_turns": count_stem_turns(case.record.op, case.S, case.J) if np.isfinite(case.S) else 0,
    }  # fmt: skip


def _store(case: Case | KindCase, rng: np.random.Generator) -> tuple[LoopRecord, tuple[str, ...]]:
    """The record of a case after one effect of a historian."""
    from calibration.historian import apply_effect

    effect = str(rng.choice(STORED_EFFECTS))
    strength = MAX_EFFECT * float(rng.uniform(0.1, 1.0))
    record = apply_effect(case.record, effect, strength, int(rng.integers(2**31)))
    return (record, (effect,)) if len(record) >= 300 else (case.record, ())

"""Diagnose every loop with all parts, then once more without each part that acts in it."""

from __future__ import annotations

import csv
import gzip
import json
import os
import time
from functools import partial
from itertools import cycle
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

from calibration.ablation.parts import SEARCH_PARTS, switch_off, watch_parts
from calibration.features import diagnose_with_findings, feature_row
from calibration.loop_sets import FIRST_SIMULATOR, SETS, KnownLoop, draw_chunk, read_recorded_loops

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

__all__ = ["run_ablation", "variant_rows"]

BASE = "all parts"
"""Variant with every part."""
Chunk = tuple[str, int]


def run_ablation(asked: argparse.Namespace) -> None:
    """Run what is missing of an ablation.

    Parameters
    ----------
    asked : argparse.Namespace
        Options of the command line.
    """
    start = time.monotonic()
    asked.out.mkdir(parents=True, exist_ok=True)
    chunks = [one for one in plan_chunks(asked.loops, asked.second) if not _file(asked.out, one).exists()]
    _compile(asked.seed)
    if asked.recorded is not None and not _file(asked.out, ("recorded", 0)).exists():
        _write(_file(asked.out, ("recorded", 0)), list(read_recorded_loops(asked.recorded)), asked.parts == "all")
    work = partial(_run_chunk, out=asked.out, seed=asked.seed, parts=asked.parts == "all", stop=start + asked.seconds)
    with get_context("spawn").Pool(asked.jobs) as pool:
        for done, _ in enumerate(pool.imap_unordered(work, chunks), 1):
            if done % 10 == 0 or done == len(chunks):
                print(f"{done} of {len(chunks)} chunks, {time.monotonic() - start:.0f} s", flush=True)
    if asked.pack is not None:
        pack(asked.out, asked.pack)


def plan_chunks(loops: int, second: int) -> list[Chunk]:
    """Chunks of both simulators, mixed so that any beginning of the list is balanced.

    Parameters
    ----------
    loops, second : int
        Loops of the first simulator, and of the second [-].

    Returns
    -------
    list of tuple
        Set and number of each chunk.

    Examples
    --------
    >>> plan_chunks(20, 8)
    [('population', 0), ('second', 0), ('stored', 0), ('plant', 0)]
    """
    chunks: list[Chunk] = []
    numbers = dict.fromkeys(SETS, 0)
    first = 0
    for name in cycle(FIRST_SIMULATOR):
        if first >= loops:
            break
        chunks.append((name, numbers[name]))
        numbers[name] += 1
        first += SETS[name]
        if numbers["second"] * SETS["second"] < min(second, first * second / loops):
            chunks.append(("second", numbers["second"]))
            numbers["second"] += 1
    return chunks


def variant_rows(loop: KnownLoop, *, parts: bool = True) -> list[dict[str, Any]]:
    """Rows of features of one loop.

    Parameters
    ----------
    loop : KnownLoop
        The loop.
    parts : bool
        Whether to diagnose it again without each part that acts in it.

    Returns
    -------
    list of dict
        The row with all parts first; a part that does not act has no row, since its numbers would be the same.
    """
    from stiction.errors import StictionError

    seconds: dict[str, float] = {}
    acting: set[str] = set()
    about = {"loop": loop.loop, "sticky": int(loop.sticky), **loop.truth}
    start = time.process_time()
    with watch_parts(seconds, acting):
        diagnosis, results = diagnose_with_findings(loop.record)
    total = time.process_time() - start
    base = about | {"variant": BASE, "seconds": total} | feature_row(diagnosis, results)
    rows = [base | {f"seconds_{name}": spent for name, spent in seconds.items()}]
    for name in SEARCH_PARTS if parts else ():
        if name not in acting:
            continue
        start = time.process_time()
        try:
            with switch_off(name):
                row = feature_row(*diagnose_with_findings(loop.record))
        except (StictionError, ValueError, IndexError) as error:
            row = {"failed": type(error).__name__}
        rows.append(about | {"variant": name, "seconds": time.process_time() - start} | row)
    return rows


def pack(out: Path, file: Path) -> None:
    """Put all rows into one compressed file, a JSON object a line.

    Parameters
    ----------
    out : Path
        Folder of the results.
    file : Path
        File to write.
    """
    with gzip.open(file, "wt", encoding="utf-8") as packed:
        for chunk in sorted(out.glob("*.csv")):
            with chunk.open(newline="") as rows:
                for row in csv.DictReader(rows):
                    kept = {name: value for name, value in row.items() if value != ""}
                    packed.write(json.dumps({"set": chunk.stem.rsplit("-", 1)[0], **kept}) + "\n")


def _compile(seed: int) -> None:
    """Fill the kernel cache before the workers start, so that they do not all compile."""
    for name in SETS:
        loops = list(draw_chunk(name, 99_999, seed))
        for loop in loops if name == "population" else loops[:1]:
            variant_rows(loop)


def _run_chunk(chunk: Chunk, out: Path, seed: int, stop: float, *, parts: bool) -> None:
    """Draw and diagnose one chunk, unless it is too late to begin."""
    if time.monotonic() < stop:
        _write(_file(out, chunk), list(draw_chunk(*chunk, seed)), parts)


def _write(file: Path, loops: list[KnownLoop], parts: bool) -> None:
    """Write the rows of some loops; the file appears when it is whole."""
    rows = [row for loop in loops for row in variant_rows(loop, parts=parts)]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    unfinished = file.with_suffix(f".{os.getpid()}.part")
    with unfinished.open("w", newline="") as out:
        writer = csv.DictWriter(out, columns)
        writer.writeheader()
        for row in rows:
            writer.writerow({name: f"{x:.7g}" if isinstance(x, float) else x for name, x in row.items()})
    unfinished.replace(file)


def _file(out: Path, chunk: Chunk) -> Path:
    """Where the rows of a chunk are."""
    return out / f"{chunk[0]}-{chunk[1]:04d}.csv"

"""``stiction demo --plant``: an audit of a simulated plant whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.display.finding_words import OPEN
from stiction.display.number_format import count_noun

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.fleet import Audit
    from stiction.simulation.plant import PlantLoop, SimulatedPlant

__all__ = ["demo_plant_audit", "plant_truth", "score_text", "write_plant_files"]

FOLDER = "stiction-plant"


def demo_plant_audit(folder: Path, *, as_json: bool, seed: int = 0) -> tuple[int, Path]:
    """Simulate a plant, write its files, audit it, and print the truth beside each finding.

    Returns
    -------
    tuple of (int, Path)
        The exit code, 0 when no finding is wrong and each group has its source, and the page of the audit.
    """
    from stiction.apps.audit import print_audit, write_results
    from stiction.apps.audit_progress import AuditBar
    from stiction.apps.output import print_json, print_out, print_table
    from stiction.apps.output_files import check_folder
    from stiction.fleet import audit
    from stiction.simulation.plant import simulate_plant

    plant = simulate_plant(seed)
    check_folder(folder)
    files = write_plant_files(plant, folder)
    if not as_json:
        print_out(f"A simulated plant of {len(plant.loops)} loops, 6 hours at 5 s; its records are in {files[0]}.")
    with AuditBar(quiet=as_json) as bar:
        plant_audit = audit(files[0], folder / "audit", map=files[1], connections=files[2], progress=bar.update)
    page = Path(write_results(plant_audit, None, 0, ()))
    rows = plant_truth(plant, plant_audit)
    groups = _group_truth(plant, plant_audit)
    scores = [row["score"] for row in rows]
    if as_json:
        counts = {"right": scores.count("ok"), "open": scores.count("open")}
        print_json({"report": str(page), "records": str(files[0]), **counts, "loops": rows, "groups": groups})
    else:
        print_audit(plant_audit)
        print_out("\nTruth and finding of each loop (healthy loops are left out where no fault is found in them):")
        shown = [row for row in rows if row["truth"] != "nothing wrong" or row["score"] == "WRONG"]
        columns = ["", "Loop", "Truth", "Found"]
        print_table(columns, [[row["score"], row["tag"], row["truth"], row["found"]] for row in shown])
        for group in groups:
            print_out(f"{'ok' if group['right'] else 'WRONG'}  {group['text']}")
        print_out(f"\n{score_text(scores)}")
        print_out(f"Page:   {page}")
        print_out(f"List:   {folder / 'audit' / 'worklist' / 'index.html'}")
        print_out(f"Open:   stiction serve {folder / 'audit'}")
        print_out(f"Try:    stiction audit {files[0]} --map {files[1]} --connections {files[2]} --out my-audit")
    return int("WRONG" in scores or not all(group["right"] for group in groups)), page


def score_text(scores: Sequence[str]) -> str:
    """Say how many findings are right, open and wrong.

    Examples
    --------
    >>> score_text(["ok", "open", "ok"])
    '2 of 3 findings are right, 1 open, 0 wrong.'
    """
    return (
        f"{scores.count('ok')} of {count_noun(len(scores), 'finding')} are right, {scores.count('open')} open, "
        f"{scores.count('WRONG')} wrong."
    )


def write_plant_files(plant: SimulatedPlant, folder: Path) -> tuple[Path, Path, Path]:
    """Write records as one wide Parquet file, a map with areas and spans, and the connections."""
    from datetime import timedelta

    import polars as pl

    from stiction.atomic_write import write_atomically

    first = plant.records[0]
    start = first.start
    assert start is not None
    columns = [pl.Series("Time", [start + timedelta(seconds=k * first.dt) for k in range(len(first))])]
    rows = []
    master = {one.provenance.secondary_tag: one.tag for one in plant.records if one.provenance.secondary_tag}
    for loop in plant.loops:
        record = loop.record
        area = record.tag.split("/")[0]
        for name in ("sp", "pv", "op"):
            columns.append(pl.Series(f"{record.tag}.{name.upper()}", getattr(record, name)))
            low, high = ("", "") if name == "op" else loop.span
            unit = "%" if name == "op" else ""
            rows.append(
                [f"{record.tag}.{name.upper()}", record.tag, name, unit, low, high, area, master.get(record.tag, "")]
            )
        mode = ["AUTO" if on else "MAN" for on in (record.auto if record.auto is not None else [])]
        columns.append(pl.Series(f"{record.tag}.MODE", mode))
        rows.append([f"{record.tag}.MODE", record.tag, "mode", "", "", "", area, ""])
    data, map_file, links = folder / "plant.parquet", folder / "map.csv", folder / "connections.csv"
    pl.DataFrame(columns).write_parquet(data)
    head = ["tag", "loop", "role", "unit", "low", "high", "area", "master"]
    write_atomically(_csv_text([head, *rows]), map_file)
    write_atomically(_csv_text([["from", "to"], *plant.connections]), links)
    return data, map_file, links


RIGHT = {
    "stiction": ("sticks", "probably_sticks"),
    "tight tuning": ("tuning",),
    "external disturbance": ("follows", "external"),
    "none": ("nothing_found", "follows"),
}
"""Fault of a loop in control -> findings that are right."""


def plant_truth(plant: SimulatedPlant, plant_audit: Audit) -> list[dict[str, Any]]:
    """Truth and finding of each loop, and its `score`: "ok", "open" where the question is left open, or "WRONG"."""
    from stiction.diagnosis.verdict.finding import STATE_FINDINGS

    rows = []
    for loop in plant.loops:
        row = plant_audit.row(loop.record.tag)
        expected = RIGHT[loop.cause] if loop.state == "in_control" else (STATE_FINDINGS[loop.state],)
        right = row.finding in expected and (row.verdict == "stiction") == (loop.cause == "stiction")
        score = "ok" if right else "open" if row.finding in OPEN else "WRONG"
        rows.append({"tag": row.tag, "truth": _truth_text(loop), "found": row.finding_text, "score": score})
    return rows


def _truth_text(loop: PlantLoop) -> str:
    if loop.state != "in_control":
        return loop.state.replace("_", " ")
    if loop.cause == "stiction":
        return f"sticky valve, S = {loop.S:.1f} %"
    if loop.cause == "external disturbance":
        return f"oscillates because of {loop.root}"
    return "nothing wrong" if loop.cause == "none" else loop.cause


def _group_truth(plant: SimulatedPlant, plant_audit: Audit) -> list[dict[str, Any]]:
    """Each true group with the group found that shares most loops with it."""
    rows = []
    for root, tags in plant.groups.items():
        best = max(plant_audit.groups, key=lambda group: len(set(group["members"]) & set(tags)), default=None)
        leading = best["leading_roots"] if best else []
        shared = len(set(best["members"]) & set(tags)) if best else 0
        text = f"group of {len(tags)} loops with the source {root}: {shared} of them found, "
        text += f"source named: {' or '.join(leading) or 'none'}"
        rows.append({"root": root, "members": list(tags), "shared": shared, "leading_roots": leading, "text": text,
                     "right": root in leading})  # fmt: skip
    return rows


def _csv_text(rows: list[Any]) -> str:
    import csv
    import io

    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()

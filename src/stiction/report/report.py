"""The report: the loops that were diagnosed, as one file."""

from __future__ import annotations

from collections import Counter
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError
from stiction.report import labels
from stiction.report.blocks import Block, Collapsible, Heading
from stiction.report.loop_page import loop_blocks
from stiction.report.overview import loop_anchor, overview, sort_worst_first
from stiction.report.page import write_page

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stiction.diagnosis.result import Diagnosis

__all__ = ["write_report"]


def write_report(
    diagnoses: Sequence[Diagnosis],
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    settings: Mapping[str, Any] | None = None,
    failures: Sequence[tuple[str, str]] = (),
) -> Path:
    """Write what was found as one HTML file that opens offline.

    Parameters
    ----------
    diagnoses : sequence of Diagnosis
        One loop by itself gets its page; several get a table, worst first, with each loop's page folded below.
    path : path-like
        File to write; written whole or not at all.
    title : str, optional
        Title; by default the tag, or "Control loops".
    settings : mapping, optional
        Settings of the run, printed with each loop's origin.
    failures : sequence of (str, str)
        Name of each file or loop that could not be diagnosed, and why; they stand at the end of the table.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ParameterError
        When there is no diagnosis to show.
    RecordError
        When the file cannot be written.

    Examples
    --------
    >>> write_report([], "report.html")
    Traceback (most recent call last):
    ...
    stiction.errors.ParameterError: write_report got no diagnosis; give at least one.
    """
    if not diagnoses:
        raise ParameterError("write_report got no diagnosis; give at least one.")
    if len(diagnoses) == 1 and not failures:
        return _one(diagnoses[0], path, title, settings)
    ranked = sort_worst_first(diagnoses)
    blocks: list[Block] = [overview(ranked, failures), Heading("Loops", anchor="loops")]
    blocks += [
        Collapsible(
            f"{name} · {labels.headline(diagnosis)}",
            loop_blocks(diagnosis, settings),
            anchor=loop_anchor(k),
            mark=labels.VERDICT_ICONS[diagnosis.verdict],
        )
        for k, (name, diagnosis) in enumerate(
            zip(labels.unique_loop_names([one.record for one in ranked]), ranked, strict=True)
        )
    ]
    number = Counter(diagnosis.verdict for diagnosis in ranked)
    subtitle = ", ".join(f"{number[verdict]} {said.lower()}" for verdict, said in labels.VERDICTS.items())
    subtitle = f"{labels.count_noun(len(ranked), 'loop')}: {subtitle}"
    if failures:
        subtitle += f"; {len(failures)} not diagnosed"
    return write_page(title or "Control loops", blocks, path, subtitle=subtitle)


def _one(diagnosis: Diagnosis, path: str | os.PathLike[str], title: str | None, settings: Any) -> Path:
    record = diagnosis.record
    told = [f"{record.loop_type.capitalize()} loop" if record.loop_type != "other" else "Control loop"]
    told.append(PurePath(record.provenance.source).name or "memory")
    told.append(
        f"{record.start:%Y-%m-%d %H:%M}, {labels.format_duration(record.duration)}"
        if record.start
        else labels.format_duration(record.duration)
    )
    return write_page(title or record.tag, loop_blocks(diagnosis, settings), path, subtitle=" · ".join(told))

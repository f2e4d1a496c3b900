"""The report of diagnosed loops as one HTML file."""

from __future__ import annotations

from collections import Counter
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError
from stiction.report import labels
from stiction.report.blocks import Block, Collapsible, Heading
from stiction.report.page import write_page
from stiction.report.pages.loop import loop_blocks
from stiction.report.pages.overview import loop_anchor, overview, sort_worst_first

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = ["write_report"]


def write_report(
    diagnoses: Sequence[Diagnosis],
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    settings: Mapping[str, Any] | None = None,
    failures: Sequence[tuple[str, str]] = (),
) -> Path:
    """Write diagnoses as one HTML file that opens offline.

    Parameters
    ----------
    diagnoses : sequence of Diagnosis
        A single loop gets its page; several get a table, worst first, and below it a page for each loop that opens on a
        click.
    path : path-like
        File to write; it is written completely or not at all.
    title : str, optional
        Title; by default the tag, or "Control loops".
    settings : mapping, optional
        Settings of the run, listed with each loop's origin.
    failures : sequence of (str, str)
        Name of each file or loop that could not be diagnosed, and why; they are the last rows of the table.

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
    >>> import stiction as st
    >>> st.write_report([], "report.html")
    Traceback (most recent call last):
    ...
    stiction.errors.ParameterError: there is no diagnosis to write; give at least one.
    """
    if not diagnoses:
        raise ParameterError("there is no diagnosis to write; give at least one.")
    if len(diagnoses) == 1 and not failures:
        return _one(diagnoses[0], path, title, settings)
    ranked = sort_worst_first(diagnoses)
    names = labels.unique_loop_names([diagnosis.record for diagnosis in ranked])
    blocks: list[Block] = [overview(ranked, failures), Heading("Loops", anchor="loops")]
    blocks += [
        Collapsible(
            f"{name} · {labels.headline(diagnosis)}",
            loop_blocks(diagnosis, settings),
            anchor=loop_anchor(k),
            mark=labels.finding_icon(diagnosis),
        )
        for k, (name, diagnosis) in enumerate(zip(names, ranked, strict=True))
    ]
    number = Counter(diagnosis.verdict for diagnosis in ranked)
    counts = ", ".join(f"{number[verdict]} {label.lower()}" for verdict, label in labels.VERDICTS.items())
    subtitle = f"{labels.count_noun(len(ranked), 'loop')}: {counts}"
    if failures:
        subtitle += f"; {len(failures)} not diagnosed"
    return write_page(title or "Control loops", blocks, path, subtitle=subtitle)


def _one(diagnosis: Diagnosis, path: str | os.PathLike[str], title: str | None, settings: Any) -> Path:
    record, duration = diagnosis.record, labels.format_duration(diagnosis.record.duration)
    kind = f"{record.loop_type.capitalize()} loop" if record.loop_type != "other" else "Control loop"
    source = PurePath(record.provenance.source).name or "memory"
    when = f"{labels.format_time(record.start)}, {duration}" if record.start else duration
    return write_page(
        title or record.tag, loop_blocks(diagnosis, settings), path, subtitle=" · ".join((kind, source, when))
    )

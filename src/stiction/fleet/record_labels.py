"""Read and check ``labels.csv``, the labels of a folder of records."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from stiction.errors import RecordError

__all__ = ["LOOP_TYPE_WORDS", "Label", "read_labels"]

LOOP_TYPE_WORDS = {"concentration": "analyser", "": None, "unknown": "other"}
"""Other words for loop types -> the package's loop types."""


@dataclass(frozen=True)
class Label:
    """Label of one record."""

    path: Path
    """The record."""
    file: str
    """File name in labels.csv."""
    loop: str
    """Tag."""
    group: str
    """Name of the group: records of one valve or of one source, which count together."""
    label: str
    """`stiction` or `no_stiction`."""
    loop_type: str | None
    """Loop type; None to take it from the tag."""
    integrating: bool | None
    """Whether the process integrates; None when unknown."""
    dt: float | None
    """Sampling period [s]; None to take it from the record."""


def read_labels(folder: str) -> list[Label]:
    """Read the labels of a folder.

    Raises
    ------
    RecordError
        When labels.csv or a record is missing, or a row has an unknown label, loop type or number.
    """
    place = Path(folder) / "labels.csv"
    try:
        with place.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except FileNotFoundError:
        raise RecordError(
            "has no labels.csv; give a folder with one (columns file, label, ...).", where=folder
        ) from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"cannot be read ({error}); save it as CSV in UTF-8.", where=place) from None
    if not rows:
        raise RecordError("has no rows; give one for each record.", where=place)
    for column in ("file", "label"):
        if column not in rows[0]:
            raise RecordError(
                f"has no column {column}; it needs file and label (stiction or no_stiction).", where=place
            )
    labels = [_label(place, number, row) for number, row in enumerate(rows, start=2)]
    verdicts: dict[str, str] = {}
    for label in labels:
        if verdicts.setdefault(label.group, label.label) != label.label:
            raise RecordError(
                f"records of group {label.group} have different labels; give all of them one label.", where=place
            )
    return labels


def _label(place: Path, number: int, row: dict[str, str | None]) -> Label:
    from stiction.records import LOOP_TYPES

    def cell(name: str) -> str:
        return (row.get(name) or "").strip()

    where = f"{place} line {number}"
    path = place.parent / cell("file")
    if not path.is_file():
        raise RecordError(f"there is no file {path}; check the name.", where=where)
    if cell("label") not in ("stiction", "no_stiction"):
        raise RecordError(f'label "{cell("label")}" is unknown; use stiction or no_stiction.', where=where)
    word = cell("loop_type").lower()
    loop_type = LOOP_TYPE_WORDS.get(word, word)
    if loop_type is not None and loop_type not in LOOP_TYPES:
        raise RecordError(f'loop_type "{word}" is unknown; use one of {", ".join(LOOP_TYPES)}.', where=where)
    integrating = cell("integrating").lower()
    if integrating not in ("true", "false", ""):
        raise RecordError(f'integrating "{integrating}" is unknown; use true or false.', where=where)
    try:
        dt = float(cell("dt_s")) if cell("dt_s") else None
    except ValueError:
        raise RecordError(f'dt_s "{cell("dt_s")}" is not a number; give seconds.', where=where) from None
    loop = cell("loop") or path.stem
    known = integrating == "true" if integrating else None
    return Label(path, cell("file"), loop, cell("group") or loop, cell("label"), loop_type, known, dt)

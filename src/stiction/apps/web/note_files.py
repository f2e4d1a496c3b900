"""Notes on a loop, read and written in a worker."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

__all__ = ["read_notes", "write_note"]


def read_notes(folder: str, tag: str) -> dict[str, Any]:
    """Return the notes of a loop, the newest first; `newest_time` is the time of the newest, empty without a note."""
    from stiction.fleet.labels import LABELS, read_labels

    notes = [asdict(one) for one in reversed(read_labels(folder)) if one.tag == tag]
    newest = notes[0] if notes else {"time": "", "label": ""}
    return {"notes": notes, "labels": list(LABELS), "newest_time": newest["time"], "label": newest["label"]}


def write_note(folder: str, tag: str, texts: dict[str, str]) -> dict[str, Any]:
    """Append a note and return all; both texts and an error when there is a newer one than `newest_time` says."""
    from stiction.fleet.labels import LabelConflictError, append_label

    try:
        append_label(folder, tag, texts["label"], texts["note"], texts["author"], seen=texts["newest_time"])
    except LabelConflictError as error:
        return {
            "error": "Another note was saved after this page was loaded. Both notes are stored: choose the valid one.",
            "theirs": asdict(error.theirs),
            "yours": asdict(error.yours),
            "newest_time": error.theirs.time,
        }
    return read_notes(folder, tag)

"""`Records`: the loops of a source, by number or tag."""

from __future__ import annotations

from typing import Any

from stiction.display.number_format import count_noun
from stiction.display.tagged import TaggedList
from stiction.records.record import LoopRecord

__all__ = ["Records"]


class Records(TaggedList[LoopRecord]):
    """The records that `stiction.read` found, a list that also takes a tag as index.

    Parameters
    ----------
    iterable : iterable of LoopRecord
        The items.

    Examples
    --------
    >>> import stiction as st
    >>> records = st.Records([st.LoopRecord("FIC-101", 1.0, op=[50.0, 51.0]), st.LoopRecord("LIC-2", 1.0, op=[50.0])])
    >>> records
    <Records: 2 loops, FIC-101, LIC-2>
    >>> records["LIC-2"].duration
    1.0
    """

    _noun = "record"

    def __repr__(self) -> str:
        """The number of loops and the first tags, in one line."""
        shown = ", ".join(self.tags[:5]) + (", ..." if len(self) > 5 else "")
        return f"<Records: {count_noun(len(self), 'loop')}{', ' if shown else ''}{shown}>"

    def to_frame(self, native: str = "polars") -> Any:
        """Make one data frame of all records: columns `tag` and `time`, then the signals; see `LoopRecord.to_frame`."""
        from stiction.records.frames import to_frame

        return to_frame(self, native)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import records_html

        return records_html(self)

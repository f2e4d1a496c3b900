"""The receipt of what was read: rows, loops, sampling period, bad share, guesses."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.digits import number_of
from stiction.records.missing_values import missing

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.records.record import LoopRecord

__all__ = ["Receipt", "ReceiptLine", "receipt"]


@dataclass(frozen=True, slots=True)
class ReceiptLine:
    """What was read of one loop."""

    tag: str
    """Name of the loop."""
    source: str
    """File it was read from."""
    loop_type: str
    """One of `LOOP_TYPES`."""
    rows: int
    """Rows in the source."""
    samples: int
    """Samples of the record, gaps included."""
    dt: float
    """Sampling period [s]."""
    bad_percent: float
    """Samples in which OP or PV is missing [%]."""
    auto_percent: float | None
    """Samples in automatic [%]; None when the mode was not recorded."""
    columns: dict[str, str]
    """Signal -> column of the source."""


@dataclass(frozen=True, slots=True)
class Receipt:
    """What was read of one or more files; print `summary()`."""

    lines: tuple[ReceiptLine, ...]
    """One for each loop."""
    guesses: tuple[str, ...]
    """What was guessed, each sentence once."""

    def summary(self) -> str:
        """Write the receipt as text."""
        text = []
        for line in self.lines:
            mapping = ", ".join(f"{signal.upper()} = {column}" for signal, column in line.columns.items())
            auto = "" if line.auto_percent is None else f", {line.auto_percent:.3g} % in automatic"
            text.append(
                f"{line.tag} ({line.loop_type}) from {line.source}: {line.rows} rows, {line.samples} samples every "
                f"{line.dt:.6g} s, {line.bad_percent:.3g} % without OP or PV{auto}; {mapping}"
            )
        text.extend(f"guessed: {guess}" for guess in self.guesses)
        return "\n".join([f"{number_of(len(self.lines), 'loop')} read", *text])

    def to_dict(self) -> dict[str, Any]:
        """Give the receipt, ready for JSON."""
        return asdict(self)


def receipt(records: Iterable[LoopRecord]) -> Receipt:
    """Write the receipt of records.

    Parameters
    ----------
    records : iterable of LoopRecord
        What `read` returned.

    Returns
    -------
    Receipt
        A line for each record, and what was guessed in any of them.

    Examples
    --------
    >>> from stiction.records import LoopRecord, receipt
    >>> receipt([LoopRecord("FIC-101", 1.0, op=[50.0, 51.0], pv=[3.0, 3.1])]).lines[0].samples
    2
    """
    records = list(records)
    lines = tuple(
        ReceiptLine(
            record.tag,
            record.provenance.source,
            record.loop_type,
            record.provenance.rows,
            len(record),
            record.dt,
            100.0 * float(np.mean(missing(record))) if len(record) else 0.0,
            None if record.auto is None or not len(record) else 100.0 * float(np.mean(record.auto)),
            dict(record.provenance.columns),
        )
        for record in records
    )
    return Receipt(lines, tuple(dict.fromkeys(guess for record in records for guess in record.provenance.guesses)))

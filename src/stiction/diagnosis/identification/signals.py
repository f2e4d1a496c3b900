"""Signals as the identification takes them: block means of a record that is longer than it needs to be."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["BlockSignals", "block_signals"]


class BlockSignals(NamedTuple):
    """OP and block means of the PV."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_blocks * per_block,)."""
    pv: NDArray[np.float64]
    """Block means of the PV [engineering units], shape (n_blocks,)."""
    per_block: int
    """Values of `op` for each block [-]."""
    samples: int
    """Samples of the record in each block [-]."""
    first: int
    """First sample of the record that is used."""
    period: float | None
    """Period of the oscillation [blocks]; None where the loop does not oscillate."""
    gaps: NDArray[np.bool_] | None = None
    """Whether a block holds samples that were not recorded; None without such."""

    @property
    def time_scale(self) -> float:
        """Period, or the time scale assumed without one [blocks]."""
        return 36.0 if self.period is None else self.period


def block_signals(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    period: float | None,
    *,
    samples_per_period: float = 12.0,
    min_blocks: int = 400,
    max_blocks: int = 2000,
    max_op_per_block: int = 8,
    gaps: NDArray[np.bool_] | None = None,
) -> BlockSignals:
    """Average a long record over blocks.

    OP [% of span] and PV [engineering units] are filled where `gaps` says that nothing was recorded; the period
    [samples] keeps `samples_per_period` blocks at least. Records are not averaged to fewer than `min_blocks`; of more
    than `max_blocks` those in the middle are used. OP keeps up to `max_op_per_block` values per block, since a valve
    trips between two samples of the PV too.

    Examples
    --------
    >>> x = np.arange(9000.0)
    >>> blocks = block_signals(x, x, 600.0)
    >>> blocks.pv.size, blocks.samples, blocks.per_block, blocks.period
    (428, 21, 7, 28.571428571428573)
    """
    scale = period if period is not None else op.size / 5.0
    size = max(int(min(scale / samples_per_period, op.size / min_blocks)), 1)
    count = min(op.size // size, max_blocks)
    first = (op.size // size - count) // 2 * size
    used = slice(first, first + count * size)
    average = -(-size // max_op_per_block)
    if average > 1:
        size -= size % average
        count = min((op.size - first) // size, max_blocks)
        used = slice(first, first + count * size)
    fewer = op[used].reshape(-1, average).mean(axis=1) if average > 1 else op[used]
    lost = None if gaps is None or not gaps.any() else np.logical_or.reduce(gaps[used].reshape(count, size), axis=1)
    return BlockSignals(
        np.ascontiguousarray(fewer), pv[used].reshape(count, size).mean(axis=1), size // average, size, first,
        None if period is None else period / size, lost,
    )  # fmt: skip

"""Parts of a sequence, for calls that take only so many items."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["chunks"]

Item = TypeVar("Item")


def chunks(items: Iterable[Item], size: int) -> list[list[Item]]:
    """Give the items in lists of at most `size` [-].

    Examples
    --------
    >>> chunks("abcde", 2)
    [['a', 'b'], ['c', 'd'], ['e']]
    """
    listed = list(items)
    return [listed[first : first + size] for first in range(0, len(listed), size)]

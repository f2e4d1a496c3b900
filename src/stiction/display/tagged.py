"""A list whose items have a tag: by number, or by tag."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, ClassVar, TypeVar

from stiction.errors import ParameterError

__all__ = ["TaggedList"]


T = TypeVar("T")


class TaggedList(list[T]):
    """A list that also takes a tag as index.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> loops = TaggedList([SimpleNamespace(tag="FIC-1"), SimpleNamespace(tag="LIC-2")])
    >>> loops["LIC-2"] is loops[1], loops.tags
    (True, ['FIC-1', 'LIC-2'])
    """

    _noun: ClassVar[str] = "loop"

    @property
    def tags(self) -> list[str]:
        """Tag of each item."""
        return [self._tag(item) for item in self]

    @staticmethod
    def _tag(item: Any) -> str:
        return item.tag

    def __getitem__(self, key: Any) -> Any:
        """Item by number, items by slice, or the only item with a tag.

        Raises
        ------
        ParameterError
            When no item has the tag, or several have.
        """
        if isinstance(key, slice):
            return type(self)(super().__getitem__(key))
        if not isinstance(key, str):
            return super().__getitem__(key)
        places = [k for k, tag in enumerate(self.tags) if tag == key]
        if len(places) == 1:
            return super().__getitem__(places[0])
        if places:
            numbers = ", ".join(map(str, places))
            raise ParameterError(f"{len(places)} {self._noun}s have the tag {key!r}; give a number: {numbers}.")
        close = get_close_matches(key, self.tags, 1) or self.tags[:1]
        hint = f"; give one of the {len(self)} tags, for example {close[0]!r}" if close else ""
        raise ParameterError(f"No {self._noun} has the tag {key!r}{hint}.")

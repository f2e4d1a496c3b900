"""A loop with one of its parts exchanged."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stiction.models import Loop

__all__ = ["exchange"]


def exchange(loop: Loop, **parts: Any) -> Loop:
    """Exchange controller, valve, noise or compensator, and keep the process as it was discretised.

    `dataclasses.replace` would discretise it again, which costs more than the simulation.

    Parameters
    ----------
    loop : Loop
        The loop.
    **parts
        The new parts, by the name of their field; neither `process` nor `dt`.

    Returns
    -------
    Loop
        The other loop.
    """
    other = copy.copy(loop)
    for name, part in parts.items():
        object.__setattr__(other, name, part)
    return other

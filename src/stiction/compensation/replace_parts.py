"""Replace parts of a loop."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stiction.models import Loop

__all__ = ["replace_parts"]


def replace_parts(loop: Loop, **parts: Any) -> Loop:
    """Replace controller, valve, noise or compensator of a loop, and keep the discretised process.

    `dataclasses.replace` would discretise the process again, which takes longer than the simulation.

    `parts`: the new parts by field name; neither `process` nor `dt`.
    """
    other = copy.copy(loop)
    for name, part in parts.items():
        object.__setattr__(other, name, part)
    return other

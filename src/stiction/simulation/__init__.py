"""Let it run: a valve alone, or the whole loop."""

from stiction.simulation.closed_loop import simulate
from stiction.simulation.stroke import stroke

__all__ = ["simulate", "stroke"]

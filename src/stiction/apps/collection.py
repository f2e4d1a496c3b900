"""Cyclic garbage is not searched for while modules are imported: it takes a sixth of a short run and finds none."""

import gc
import sys

__all__ = ["pause_collection", "resume_collection"]


def pause_collection() -> None:
    """Stop the search where the modules of a diagnosis are still to be imported."""
    if "stiction.diagnosis" not in sys.modules:
        gc.disable()


def resume_collection() -> None:
    """Search again, from now on, if it was stopped; what is imported is left out."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()

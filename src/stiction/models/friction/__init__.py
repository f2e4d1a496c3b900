"""Friction laws, one page each: how the stem on its spring moves in one sub-step."""

from stiction.models.friction.karnopp import karnopp_substep
from stiction.models.friction.lugre import lugre_rest, lugre_substep

__all__ = ["karnopp_substep", "lugre_rest", "lugre_substep"]

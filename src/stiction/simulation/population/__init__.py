"""Seeded populations of simulated loops whose truth is known: sticky ones, and ones that move for other reasons."""

from stiction.simulation.population.case import CAUSES, Case
from stiction.simulation.population.draw import population

__all__ = ["CAUSES", "Case", "population"]

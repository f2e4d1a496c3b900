"""Seeded populations of simulated loops whose truth is known: sticky ones, and ones that move for other reasons."""

from stiction.simulation.population.case import CAUSES, Case
from stiction.simulation.population.draw import population
from stiction.simulation.population.plant import plant_population
from stiction.simulation.population.two_faults import two_fault_population
from stiction.simulation.population.upsets import upset_population
from stiction.simulation.population.wandering import wandering_population

__all__ = [
    "CAUSES",
    "Case",
    "plant_population",
    "population",
    "two_fault_population",
    "upset_population",
    "wandering_population",
]

"""Seeded populations of simulated loops whose truth is known: sticky ones, and ones that move for other reasons."""

from calibration.populations.case import CAUSES, Case
from calibration.populations.draw import population
from calibration.populations.plant_historian import plant_population
from calibration.populations.split_range import split_range_population
from calibration.populations.two_faults import two_fault_population
from calibration.populations.upsets import upset_population
from calibration.populations.wandering import wandering_population

__all__ = [
    "CAUSES",
    "Case",
    "plant_population",
    "population",
    "split_range_population",
    "two_fault_population",
    "upset_population",
    "wandering_population",
]

"""A simulated plant: units with about 60 loops, cascades, and oscillations that spread from one loop to others."""

from stiction.simulation.plant.layout import PlantLayout, draw_layout
from stiction.simulation.plant.simulate import PlantLoop, SimulatedPlant, simulate_plant

__all__ = ["PlantLayout", "PlantLoop", "SimulatedPlant", "draw_layout", "simulate_plant"]

"""Simulation of a valve alone, of a control loop and of a plant."""

from stiction.simulation.closed_loop import simulate
from stiction.simulation.critical_rates import critical_rate, ramp_behaviour
from stiction.simulation.input_signals import binary_sequence, ramp, random_walk, sine, staircase, triangle
from stiction.simulation.model_reduction import reduce_valve
from stiction.simulation.stroke import stroke

__all__ = [
    "binary_sequence",
    "critical_rate",
    "ramp",
    "ramp_behaviour",
    "random_walk",
    "reduce_valve",
    "simulate",
    "sine",
    "staircase",
    "stroke",
    "triangle",
]

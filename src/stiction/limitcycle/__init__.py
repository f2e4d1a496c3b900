"""Describing functions, limit cycles and their stability, basins of attraction."""

from stiction.limitcycle.basins import Attractor, BasinMap, basin_map, smallest_pulse
from stiction.limitcycle.continuation import Bifurcation, Branch, bifurcation
from stiction.limitcycle.describing import Deadband, Quantiser, Relay, Saturation, describing_function
from stiction.limitcycle.exact.search import exact_limit_cycles
from stiction.limitcycle.harmonic_balance_search import harmonic_balance
from stiction.limitcycle.predict import predict_limit_cycles
from stiction.limitcycle.result import LimitCycle
from stiction.limitcycle.sampled_cycles import sampled_limit_cycles

__all__ = [
    "Attractor",
    "BasinMap",
    "Bifurcation",
    "Branch",
    "Deadband",
    "LimitCycle",
    "Quantiser",
    "Relay",
    "Saturation",
    "basin_map",
    "bifurcation",
    "describing_function",
    "exact_limit_cycles",
    "harmonic_balance",
    "predict_limit_cycles",
    "sampled_limit_cycles",
    "smallest_pulse",
]

"""The one file that knows all valve and compensator pages: from a model's code to its step.

Data-driven models with at most three numbers are compiled into the drivers, which keep the whole state in registers.
Other models (tables, physical valve) are called, which would make a data-driven model several times slower.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.models.compensators.constant_reinforcement import constant_reinforcement_step
from stiction.models.compensators.cuadros import cuadros_step
from stiction.models.compensators.four_move import four_move_step
from stiction.models.compensators.integral_deadband import integral_deadband_step
from stiction.models.compensators.knocker import knocker_step
from stiction.models.compensators.two_move import two_move_step
from stiction.models.compensators.variable_pulses import variable_pulses_step
from stiction.models.component import TIE_TOLERANCE, ValveState, at_rest
from stiction.models.lookup_table import lookup
from stiction.models.numba_compile import inline_kernel, kernel
from stiction.models.valves.choudhury import choudhury_step
from stiction.models.valves.he import he_step
from stiction.models.valves.he_wang import he_wang_step
from stiction.models.valves.ideal import ideal_step
from stiction.models.valves.kano import kano_at_rest, kano_step
from stiction.models.valves.physical import physical_at_rest, physical_parameters, physical_step
from stiction.models.valves.srinivasan import srinivasan_printed_step, srinivasan_step
from stiction.models.valves.stenman import stenman_step

if TYPE_CHECKING:
    from stiction.models.compensators.component import CompensatorState

__all__ = [
    "CHOUDHURY",
    "CONSTANT_REINFORCEMENT",
    "CUADROS",
    "FOUR_MOVE",
    "HE",
    "HE_WANG",
    "IDEAL",
    "INTEGRAL_DEADBAND",
    "KANO",
    "KNOCKER",
    "NO_COMPENSATOR",
    "PHYSICAL",
    "SRINIVASAN",
    "STENMAN",
    "TWO_MOVE",
    "VARIABLE_PULSES",
    "compensator_step",
    "data_driven_parameters",
    "data_driven_step",
    "is_data_driven",
    "kano_at_rest",
    "kano_step",
    "physical_parameters",
    "physical_step",
    "stem_position",
    "stenman_step",
    "valve_at_rest",
    "valve_step",
]

# Codes of the valve models
IDEAL = 0
STENMAN = 1
KANO = 2
CHOUDHURY = 3
HE = 4
SRINIVASAN = 5
SRINIVASAN_PRINTED = 6
SRINIVASAN_TABLED = 7
SRINIVASAN_TABLED_PRINTED = 8
PHYSICAL = 10
HE_WANG = 11

# Codes of the compensators
NO_COMPENSATOR = 0
KNOCKER = 1
CONSTANT_REINFORCEMENT = 2
VARIABLE_PULSES = 3
INTEGRAL_DEADBAND = 4
CUADROS = 5
TWO_MOVE = 6
FOUR_MOVE = 7

_at_rest = inline_kernel(at_rest)


@inline_kernel
def valve_at_rest(model: int, op: float, position: float, p) -> ValveState:
    """State of valve `model` with packed parameters `p`, its stem resting at `position` under the input `op`."""
    if model == KANO:
        return kano_at_rest(op, position, p[4])
    if model == PHYSICAL:
        return physical_at_rest(op, position, p)
    return _at_rest(op, position)


@inline_kernel
def stem_position(s: ValveState, p) -> float:
    """Position of the stem within its travel [% of span]."""
    return min(max(s.position, p[0]), p[1])


@inline_kernel
def is_data_driven(model: int) -> bool:
    """Whether valve `model` has at most three numbers as parameters."""
    return model < SRINIVASAN_TABLED or model == HE_WANG


@inline_kernel
def data_driven_parameters(p):
    """End stops and parameters of a data-driven model: (lowest, highest, first, second, third), missing ones 0."""
    first = p[2] if p.shape[0] > 2 else 0.0
    second = p[3] if p.shape[0] > 3 else 0.0
    third = p[4] if p.shape[0] > 4 else 0.0
    return p[0], p[1], first, second, third


@inline_kernel
def data_driven_step(model: int, op: float, s: ValveState, q) -> ValveState:
    """One sample of a data-driven model with `q` from `data_driven_parameters`; the input is limited to the travel."""
    op = min(max(op, q[0]), q[1])
    if model == KANO:
        return kano_step(op, s, q[2], q[3], q[4])
    if model == STENMAN:
        return stenman_step(op, s, q[2])
    if model == CHOUDHURY:
        return choudhury_step(op, s, q[2], q[3], q[4])
    if model == HE:
        return he_step(op, s, q[2], q[3])
    if model == SRINIVASAN:
        return srinivasan_step(op, s, q[2], q[3], q[4])
    if model == SRINIVASAN_PRINTED:
        return srinivasan_printed_step(op, s, q[2], q[3], q[4])
    if model == HE_WANG:
        return he_wang_step(op, s, q[2], q[3], q[4])
    return ideal_step(op, s)


@kernel
def valve_step(model: int, op: float, s: ValveState, p) -> ValveState:
    """One sample of any valve `model` with packed parameters `p`."""
    if is_data_driven(model):
        return data_driven_step(model, op, s, data_driven_parameters(p))
    if model == PHYSICAL:
        return physical_step(op, s, physical_parameters(p))
    op = min(max(op, p[0]), p[1])
    rate = abs(op - s.op) / p[3]
    sb = lookup(p, 5, s.position, rate)
    sj = lookup(p, int(p[4]), s.position, rate)
    if model == SRINIVASAN_TABLED:
        return srinivasan_step(op, s, sb * (1.0 + TIE_TOLERANCE), sb - sj, p[2])
    return srinivasan_printed_step(op, s, sb * (1.0 + TIE_TOLERANCE), sj, p[2])


@kernel
def compensator_step(kind: int, op: float, sp: float, pv: float, s: CompensatorState, p) -> CompensatorState:
    """One sample of compensator `kind` with packed parameters `p`."""
    if kind == KNOCKER:
        return knocker_step(op, s, p[0], p[1], p[2])
    if kind == VARIABLE_PULSES:
        return variable_pulses_step(op, sp, pv, s, p[0], p[1], p[2], p[3])
    if kind == INTEGRAL_DEADBAND:
        return integral_deadband_step(op, sp, pv, p[0])
    if kind == CUADROS:
        return cuadros_step(op, sp, pv, s, p[0], p[1], p[2], p[3])
    if kind == TWO_MOVE:
        return two_move_step(op, sp, pv, s, p[0], p[1], p[2], p[3], p[4], p[5], p[6])
    if kind == FOUR_MOVE:
        return four_move_step(op, sp, pv, s, p[0], p[1], p[2], p[3], p[4], p[5])
    return constant_reinforcement_step(op, s, p[0])

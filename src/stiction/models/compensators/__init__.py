"""Compensators of stiction, which act between controller and valve: one page each."""

from stiction.models.compensators.component import Compensator
from stiction.models.compensators.constant_reinforcement import ConstantReinforcement
from stiction.models.compensators.cuadros import Cuadros
from stiction.models.compensators.four_move import FourMove
from stiction.models.compensators.integral_deadband import IntegralDeadband
from stiction.models.compensators.knocker import Knocker
from stiction.models.compensators.two_move import TwoMove
from stiction.models.compensators.variable_pulses import VariablePulses

__all__ = [
    "Compensator",
    "ConstantReinforcement",
    "Cuadros",
    "FourMove",
    "IntegralDeadband",
    "Knocker",
    "TwoMove",
    "VariablePulses",
]

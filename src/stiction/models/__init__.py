"""Models of the parts of a control loop: one page per model."""

from stiction.models.compensators import (
    Compensator,
    ConstantReinforcement,
    Cuadros,
    FourMove,
    IntegralDeadband,
    Knocker,
    TwoMove,
    VariablePulses,
)
from stiction.models.component import Valve
from stiction.models.controllers import PID
from stiction.models.lookup_table import Table
from stiction.models.loop import Loop
from stiction.models.positioner import Positioner
from stiction.models.processes import FOPDT, SOPDT, Integrating, StateSpace, TransferFunction
from stiction.models.valves import Choudhury, He, HeWang, Ideal, Kano, PhysicalValve, Srinivasan, Stenman

__all__ = [
    "FOPDT",
    "PID",
    "SOPDT",
    "Choudhury",
    "Compensator",
    "ConstantReinforcement",
    "Cuadros",
    "FourMove",
    "He",
    "HeWang",
    "Ideal",
    "IntegralDeadband",
    "Integrating",
    "Kano",
    "Knocker",
    "Loop",
    "PhysicalValve",
    "Positioner",
    "Srinivasan",
    "StateSpace",
    "Stenman",
    "Table",
    "TransferFunction",
    "TwoMove",
    "Valve",
    "VariablePulses",
]

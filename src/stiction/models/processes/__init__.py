"""Linear processes with exact dead time."""

from stiction.models.processes.discretise import Discrete, discretise
from stiction.models.processes.from_control import as_process
from stiction.models.processes.transfer_function import FOPDT, SOPDT, Integrating, StateSpace, TransferFunction

__all__ = [
    "FOPDT",
    "SOPDT",
    "Discrete",
    "Integrating",
    "StateSpace",
    "TransferFunction",
    "as_process",
    "discretise",
]

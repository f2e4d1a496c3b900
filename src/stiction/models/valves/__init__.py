"""Valve models, one page each."""

from stiction.models.valves.choudhury import Choudhury
from stiction.models.valves.he import He
from stiction.models.valves.he_wang import HeWang
from stiction.models.valves.ideal import Ideal
from stiction.models.valves.kano import Kano
from stiction.models.valves.physical import PhysicalValve
from stiction.models.valves.srinivasan import Srinivasan
from stiction.models.valves.stenman import Stenman

__all__ = ["Choudhury", "He", "HeWang", "Ideal", "Kano", "PhysicalValve", "Srinivasan", "Stenman"]

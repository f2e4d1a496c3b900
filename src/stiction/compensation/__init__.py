"""Tame it: the loop's twin, and what repairing, retuning and compensating would do to it."""

from stiction.compensation.compensate import compensate
from stiction.compensation.repair import repair
from stiction.compensation.result import Behaviour, CompensationTrial, RemedyTrial
from stiction.compensation.retune import Retuning, TradeOff, df_margin, retune
from stiction.compensation.twin import Twin, build_twin

__all__ = [
    "Behaviour",
    "CompensationTrial",
    "RemedyTrial",
    "Retuning",
    "TradeOff",
    "Twin",
    "build_twin",
    "compensate",
    "df_margin",
    "repair",
    "retune",
]

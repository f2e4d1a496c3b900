"""Tame it: the loop's twin, and what repairing, retuning and compensating would do to it."""

from stiction.compensation.compensate import compensate
from stiction.compensation.repair import repair
from stiction.compensation.result import Behaviour, CompensationTrial, RemedyTrial
from stiction.compensation.retune import Retuning, TradeOff, df_margin, retune
from stiction.compensation.structured_text import recommended_text, structured_text
from stiction.compensation.twin import Twin, build_twin
from stiction.compensation.work_order import WorkOrder, work_order

__all__ = [
    "Behaviour",
    "CompensationTrial",
    "RemedyTrial",
    "Retuning",
    "TradeOff",
    "Twin",
    "WorkOrder",
    "build_twin",
    "compensate",
    "df_margin",
    "recommended_text",
    "repair",
    "retune",
    "structured_text",
    "work_order",
]

"""Compensation: a simulated copy of the loop (its twin), and what repair, retuning and compensators do to it."""

from stiction.compensation.compensate import compensate
from stiction.compensation.repair import repair
from stiction.compensation.result import CompensationTrial, LoopPerformance, RemedyTrial
from stiction.compensation.retune import Retuning, TradeOff, describing_function_margin, retune
from stiction.compensation.structured_text import recommended_text, structured_text
from stiction.compensation.twin import Twin, build_twin
from stiction.compensation.work_order import WorkOrder, work_order

__all__ = [
    "CompensationTrial",
    "LoopPerformance",
    "RemedyTrial",
    "Retuning",
    "TradeOff",
    "Twin",
    "WorkOrder",
    "build_twin",
    "compensate",
    "describing_function_margin",
    "recommended_text",
    "repair",
    "retune",
    "structured_text",
    "work_order",
]

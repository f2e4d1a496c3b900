"""What was measured: loop records, the readers that make them, and whether they are good enough to judge a valve."""

from stiction.records.gates import Gate
from stiction.records.quality import Quality, assess
from stiction.records.read import read
from stiction.records.receipt import Receipt, receipt
from stiction.records.record import LOOP_TYPES, LoopRecord, Provenance
from stiction.records.stretches import analysis_window, usable_part

__all__ = [
    "LOOP_TYPES",
    "Gate",
    "LoopRecord",
    "Provenance",
    "Quality",
    "Receipt",
    "analysis_window",
    "assess",
    "read",
    "receipt",
    "usable_part",
]

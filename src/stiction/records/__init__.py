"""Loop records: the signals of one control loop, and their data checks."""

from stiction.records.analysis_window import analysis_window
from stiction.records.assess import Quality, assess_quality
from stiction.records.check_result import CheckResult
from stiction.records.read_summary import ReadSummary, summarise
from stiction.records.record import LOOP_TYPES, LoopRecord, Provenance
from stiction.records.record_list import Records

__all__ = [
    "LOOP_TYPES",
    "CheckResult",
    "LoopRecord",
    "Provenance",
    "Quality",
    "ReadSummary",
    "Records",
    "analysis_window",
    "assess_quality",
    "summarise",
]

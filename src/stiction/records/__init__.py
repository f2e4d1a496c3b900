"""What was measured: the loop record and where it comes from."""

from stiction.records.record import LOOP_TYPES, LoopRecord, Provenance

__all__ = ["LOOP_TYPES", "LoopRecord", "Provenance"]

"""Detection methods: one page each, all with the form `name(record, oscillation) -> Evidence`."""

from __future__ import annotations

from stiction.diagnosis.detection.facts import FACTS, MethodFacts, detect_all

__all__ = ["FACTS", "MethodFacts", "detect_all"]

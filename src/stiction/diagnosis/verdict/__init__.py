"""All evidence weighed: one verdict with its probability, reason and action."""

from stiction.diagnosis.verdict.diagnose import diagnose

__all__ = ["diagnose"]

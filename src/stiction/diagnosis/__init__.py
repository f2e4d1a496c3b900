"""Whose fault is it, and how much? From a record to a verdict."""

from stiction.diagnosis.identification import compare_models, identify
from stiction.diagnosis.identified import Identification
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Diagnosis, Evidence, Oscillation
from stiction.diagnosis.verdict import diagnose

__all__ = [
    "Diagnosis",
    "Evidence",
    "Identification",
    "Oscillation",
    "compare_models",
    "diagnose",
    "find_oscillation",
    "identify",
]

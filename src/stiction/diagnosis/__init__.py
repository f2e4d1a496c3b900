"""Whose fault is it, and how much? From a record to a verdict."""

from stiction.diagnosis.diagnose import diagnose
from stiction.diagnosis.diagnoses import Diagnoses, diagnose_all
from stiction.diagnosis.identification import Identification, ModelComparison
from stiction.diagnosis.identify import compare_models, identify
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Evidence, Oscillation
from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = [
    "Diagnoses",
    "Diagnosis",
    "Evidence",
    "Identification",
    "ModelComparison",
    "Oscillation",
    "compare_models",
    "diagnose",
    "diagnose_all",
    "find_oscillation",
    "identify",
]

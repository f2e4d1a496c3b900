"""Whose fault is it, and how much? From a record to a verdict."""

from stiction.diagnosis.identification import identify
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Diagnosis, Evidence, Identification, Oscillation
from stiction.diagnosis.verdict import diagnose

__all__ = ["Diagnosis", "Evidence", "Identification", "Oscillation", "diagnose", "find_oscillation", "identify"]

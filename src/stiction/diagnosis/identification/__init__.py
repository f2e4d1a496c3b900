"""Stiction and process together, from OP and PV."""

from stiction.diagnosis.identification.compare_models import ModelComparison, compare_models
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.result import ControllerFit, Identification

__all__ = ["ControllerFit", "Identification", "ModelComparison", "compare_models", "fit_controller"]

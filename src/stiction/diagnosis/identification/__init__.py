"""Stiction and process together, from OP and PV."""

from stiction.diagnosis.identification.compare_models import ModelComparison
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.result import ControllerFit, Identification

__all__ = ["ControllerFit", "Identification", "ModelComparison", "fit_controller"]

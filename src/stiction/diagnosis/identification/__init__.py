"""Stiction and process together, from OP and PV."""

from stiction.diagnosis.identification.compare import compare_models
from stiction.diagnosis.identification.controller import ControllerFit, fit_controller
from stiction.diagnosis.identification.identify import identify

__all__ = ["ControllerFit", "compare_models", "fit_controller", "identify"]

"""Stiction and process together, from OP and PV."""

from stiction.diagnosis.identification.compare import compare_models
from stiction.diagnosis.identification.controller import fit_controller
from stiction.diagnosis.identification.identify import identify
from stiction.diagnosis.identified import ControllerFit

__all__ = ["ControllerFit", "compare_models", "fit_controller", "identify"]

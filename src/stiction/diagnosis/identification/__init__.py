"""Stiction and process together, from OP and PV."""

from stiction.diagnosis.identification.controller import ControllerFit, fit_controller
from stiction.diagnosis.identification.identify import identify

__all__ = ["ControllerFit", "fit_controller", "identify"]

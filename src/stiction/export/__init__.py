"""Models for other simulators: C99, FMU, Modelica and MATLAB, translated from the kernels on the model pages."""

from stiction.export.export_models import ExportedModel, export_c, export_fmu, export_matlab, export_modelica

__all__ = ["ExportedModel", "export_c", "export_fmu", "export_matlab", "export_modelica"]

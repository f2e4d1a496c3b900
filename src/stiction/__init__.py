"""From friction physics to a verdict on a recorded control loop.

Names are imported when first used, so that ``import stiction`` costs next to nothing.

Examples
--------
>>> import stiction as st
>>> valve = st.Kano(S=3.0, J=1.0)
>>> st.stroke(valve, [0.0, 2.5, 3.0], dt=1.0).mv.tolist()
[0.0, 1.5, 2.0]
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_ROOMS: dict[str, tuple[str, ...]] = {
    "stiction.models": (
        "PID",
        "FOPDT",
        "SOPDT",
        "Choudhury",
        "ConstantReinforcement",
        "Cuadros",
        "FourMove",
        "He",
        "HeWang",
        "Ideal",
        "IntegralDeadband",
        "Integrating",
        "Kano",
        "Knocker",
        "Loop",
        "PhysicalValve",
        "Positioner",
        "Srinivasan",
        "Stenman",
        "Table",
        "TransferFunction",
        "TwoMove",
        "VariablePulses",
    ),
    "stiction.records": ("LoopRecord", "Records"),
    "stiction.sources": ("read",),
    "stiction.simulation": (
        "reduce_valve",
        "simulate",
        "stroke",
    ),
    "stiction.limitcycle": (
        "LimitCycle",
        "basin_map",
        "bifurcation",
        "describing_function",
        "exact_limit_cycles",
        "predict_limit_cycles",
    ),
    "stiction.diagnosis": ("Diagnoses", "Diagnosis", "compare_models", "diagnose", "diagnose_all", "identify"),
    "stiction.valvetests": (
        "ValveTest",
        "analyse_ramp",
        "analyse_steps",
        "compare_tests",
        "plan_ramp_test",
        "plan_step_test",
    ),
    "stiction.compensation": (
        "CompensationTrial",
        "compensate",
        "retune",
        "structured_text",
        "work_order",
    ),
    "stiction.export": ("ExportedModel", "export_c", "export_fmu", "export_matlab", "export_modelica"),
    "stiction.fleet": ("Audit", "audit", "group_oscillations", "open_audit", "work_list"),
    "stiction.fleet.stiction_features": ("StictionFeatures",),
    "stiction.report": ("write_report",),
    "stiction.errors": ("ConvergenceError", "MissingExtraError", "ParameterError", "RecordError", "StictionError"),
}
_HOME = {name: room for room, names in _ROOMS.items() for name in names}
_MODULES = {"quality": "stiction.records.quality"}

__all__ = sorted([*_HOME, *_MODULES, "__version__"])  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name from its room on first use."""
    if name in _MODULES:
        value = importlib.import_module(_MODULES[name])
    elif name in _HOME:
        value = getattr(importlib.import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module 'stiction' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names."""
    return __all__

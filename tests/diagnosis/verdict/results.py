"""Results of the stages before the verdict, as constants: what a test does not name is that of a sticky flow loop."""

from __future__ import annotations

import numpy as np

import stiction as st
from stiction.diagnosis.identification.dead_zone import DeadZone
from stiction.diagnosis.identification.result import ControllerFit, Identification, ProcessFit, Segment
from stiction.diagnosis.loop_state import LoopState
from stiction.diagnosis.result import Oscillation
from stiction.diagnosis.segment import JudgedSegment
from stiction.diagnosis.verdict.causes import OscillationCause
from stiction.diagnosis.verdict.decision import Costs, decide
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.records.assess import Quality
from stiction.records.conditioned import condition

RATIOS = {
    "good": 300.0, "dead_zone": 250.0, "relay_load": 80.0,
    "periodic_load": 120.0, "beside_periodic_load": 60.0, "deadband": 40.0,
}  # fmt: skip


def make_identification(**changes):
    none = np.empty(0)
    process = ProcessFit(2.0, 10.0, 3.0, False)
    values = {
        "model": "kano", "S": 4.0, "J": 1.0, "S_low": 3.8, "S_high": 4.4, "J_low": 0.6, "J_high": 1.5,
        "process": process, "linear": process, "fit": 90.0, "fit_linear": 60.0, "mv": none, "pv": none,
        "pv_linear": none, "likelihood_ratios": RATIOS,
        "process_gains": {"stem": 9.0, "stem_beside_op": 4.0},
        "segments": (Segment(0, 500, 4.1, 1.0, 90.0), Segment(500, 1000, 3.9, 1.0, 160.0)),
    }  # fmt: skip
    return Identification(**{**values, **changes})


def make_zone(**changes):
    values = {"low": 47.0, "high": 53.0, "op_low": 44.0, "op_high": 56.0, "likelihood_ratio": 50.0,
              "stem_reversals": 20, "op_reversals": 20}  # fmt: skip
    return DeadZone(**{**values, **changes})


def make_controller(Kc=0.3, Ti=12.0, **changes):
    values = {"explained": 1.0, "action": 1.0, "form": "PI", "Ki": Kc / Ti}
    return ControllerFit(Kc, Ti, **{**values, **changes})


def make_oscillation(*, oscillating=True, period=60.0):
    return Oscillation(oscillating, period, 8.0, 1.0, 2.0, 30.0, 40, 10)


def make_segment(state="in_control", *, oscillating=True, **changes):
    op = 50.0 + np.sin(np.arange(1000.0))
    record = st.LoopRecord("FIC-101", 1.0, op=op, pv=op)
    values = {
        "record": record, "signals": condition(record), "loop_state": LoopState(state, 0.0, 1000.0),
        "oscillation": make_oscillation(oscillating=oscillating),
        "quality": Quality((), True, 1000, 1000.0, 0.0, 0, 1000),
    }  # fmt: skip
    return JudgedSegment(**{**values, **changes})


def make_diagnosis(probability=0.95, state="in_control", *, causes=None, oscillating=True, costs=None, **changes):
    values = {
        "segment": make_segment(state, oscillating=oscillating), "verdict": decide(probability, costs or Costs()),
        "probability": probability, "oscillation_cause": OscillationCause(**(causes or {})),
        "identification": make_identification(), "controller": make_controller(), "costs": costs or Costs(),
    }  # fmt: skip
    return Diagnosis(**{**values, **changes})

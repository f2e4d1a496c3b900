"""Diagnoses for the report's tests: simulated records, hand-made findings."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import numpy as np

import stiction as st
from stiction.diagnosis.identification.result import Identification, LikelihoodSurface, ProcessFit, Segment
from stiction.diagnosis.loop_state import LoopState
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Evidence
from stiction.diagnosis.segment import JudgedSegment
from stiction.diagnosis.verdict.causes import OscillationCause
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.diagnosis.verdict.model import Contribution
from stiction.records.assess import assess_quality
from stiction.records.conditioned import condition
from stiction.records.record import Provenance


def record(n=2000, tag="FIC-101", S=3.0, J=1.0, measured=False, seed=1):
    """A sticky flow loop in engineering units."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S, J), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    run = st.simulate(loop, sp=150.0, duration=float(n), op_start=50.0, pv_start=148.0, tag=tag, loop_type="flow")
    noise = np.random.default_rng(seed).normal(0.0, 0.08, n)
    origin = Provenance("plant.csv", 64 * "a", {"op": "FIC101.OUT", "pv": "FIC101.PV"}, ("OP column guessed.",), n, 3)
    return replace(
        run, pv=run.pv + noise, mv=run.mv if measured else None, start=datetime(2026, 3, 2, 6, 30), provenance=origin
    )


def surface(S, J):
    """A likelihood ratio with its maximum near (S, J)."""
    s, ratio = np.geomspace(0.1 * S, 2.0 * S, 24), np.linspace(0.0, 1.0, 5)
    distance = ((s[:, None] - S) / S) ** 2 + 0.15 * (ratio[None, :] - J / S) ** 2
    return LikelihoodSurface(s, ratio, 400.0 - 900.0 * distance)


def segments(n, *ratios, S=3.0, J=1.0):
    """Parts of equal length with the given likelihood ratios."""
    ends = np.linspace(0, n, len(ratios) + 1).astype(int)
    return tuple(Segment(int(a), int(b), S, J, x) for a, b, x in zip(ends[:-1], ends[1:], ratios, strict=True))


def identification(run, S=3.0, J=1.0, **more):
    """The valve stroked over the recorded OP, and a smooth PV."""
    mv = st.stroke(st.Kano(S, J), np.nan_to_num(run.op, nan=50.0), dt=run.dt, mv_start=50.0).mv
    pv = np.convolve(run.pv, np.ones(3) / 3.0, mode="same")
    pv[[0, -1]] = run.pv[[0, -1]]
    values = {
        "model": "kano",
        "S": S, "J": J, "S_low": 0.9 * S, "S_high": 1.1 * S, "J_low": 0.7 * J, "J_high": 1.4 * J,
        "process": ProcessFit(3.0, 10.0, 10.0, False),
        "linear": ProcessFit(1.2, 5.0, 2.0, False),
        "fit": 93.0,
        "fit_linear": 41.0,
        "mv": mv,
        "pv": pv,
        "pv_linear": pv - 0.5,
        "likelihood_ratios": {"good": 310.0, "deadband": 12.5, "relay_load": 45.0, "periodic_load": -7.0},
        "surface": surface(S, J),
        "segments": segments(len(run), 90.0, 120.0, 80.0, 75.0),
    }  # fmt: skip
    return Identification(**{**values, **more})


CONTRIBUTIONS = (
    Contribution("over_closest", 3.1, 2.4),
    Contribution("tuning", 0.9, -1.2),
    Contribution("position", float("nan"), 0.0),
)
EVIDENCE = (
    Evidence("Horch correlation", 0.71, 0.5, "stiction", True, "OP and PV correlate oddly at lag 0.", "horch1999"),
    Evidence(
        "Rossi and Scali relay fit", 0.42, 0.21, "stiction", True, "A relay fits better than a sine.", "rossi2005"
    ),
    Evidence(
        "Yamashita patterns", float("nan"), 0.25, "undecided", False, "Too few samples per cycle.", "yamashita2006"
    ),
    Evidence("He curve fit", 0.38, 0.4, "no_stiction", True, "A sine fits better than a triangle.", "he2007"),
)


def diagnosis(n=2000, verdict="stiction", found=True, probability=None, run=None, **more):
    """A diagnosis of a sticky flow loop."""
    run = record(n) if run is None else run
    default = {"stiction": 0.94, "no_stiction": 0.06, "undecided": 0.5}[verdict]
    cause = {"stiction": (0.9, 0.1), "no_stiction": (0.05, 0.8), "undecided": (0.4, 0.4)}[verdict]
    values = {
        "verdict": verdict,
        "probability": default if probability is None else probability,
        "oscillation_cause": OscillationCause(*cause, external=0.1, sensor=0.02, dead_zone=0.01),
        "evidence": EVIDENCE,
        "identification": identification(run) if found else None,
        "contributions": CONTRIBUTIONS if found else (),
        "settings": {"model": "Kano"},
    }
    segment = {
        "record": run,
        "signals": condition(run),
        "loop_state": LoopState("in_control", 0.0, run.duration),
        "oscillation": find_oscillation(run),
        "quality": assess_quality(run, period=180.0),
    }
    segment |= {name: more.pop(name) for name in list(more) if name in segment}
    return Diagnosis(JudgedSegment(**segment), **{**values, **more})

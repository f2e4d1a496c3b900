"""Diagnoses for the report's tests: simulated records, hand-made findings."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import numpy as np
from stiction.diagnosis.identified import ErrorSurface, Identification, ProcessFit

import stiction as st
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Diagnosis, Evidence
from stiction.records.assess import assess_quality
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
    """A valley about (S, J)."""
    s, ratio = np.linspace(0.0, 2.0 * S, 24), np.linspace(0.0, 1.2, 16)
    far = ((s[:, None] - S) / S) ** 2 + 0.15 * (ratio[None, :] - J / S) ** 2
    late = np.arange(8.0)
    valley = ((s[:, None] + 0.4 * late[None, :] - S) / S) ** 2
    return ErrorSurface(s, ratio, 0.03 + far, 0.05, 2.0 * late, 0.03 + valley)


def identification(run, S=3.0, J=1.0):
    """The valve stroked over the recorded OP, and a smooth PV."""
    mv = st.stroke(st.Kano(S, J), np.nan_to_num(run.op, nan=50.0), dt=run.dt, mv_start=50.0).mv
    pv = np.convolve(run.pv, np.ones(3) / 3.0, mode="same")
    pv[[0, -1]] = run.pv[[0, -1]]
    process = ProcessFit(3.0, 10.0, 10.0, False)
    return Identification(
        "Kano", S, J, 0.9 * S, 1.1 * S, 0.7 * J, 1.4 * J, process, 93.0, 41.0, surface(S, J), mv=mv, pv=pv
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
    cause = {"stiction": "stiction", "no_stiction": "tight tuning", "undecided": "unknown"}[verdict]
    told = default if probability is None else probability
    values = {
        "record": run,
        "verdict": verdict,
        "probability": told,
        "probability_before_doubts": told,
        "cause": cause,
        "reason": "Six methods of seven see the valve stick, and a sticky valve explains the PV far better.",
        "action": "Check packing friction and positioner at the next chance; retuning will not cure it.",
        "oscillation": find_oscillation(run),
        "evidence": EVIDENCE,
        "quality": assess_quality(run, period=180.0),
        "identification": identification(run) if found else None,
        "settings": {"model": "Kano"},
    }
    return Diagnosis(**{**values, **more})

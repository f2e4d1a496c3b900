"""Records that cannot be diagnosed, or only in part, still have a page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.diagnosis.identification.dead_zone import DeadZone
from stiction.diagnosis.loop_state import HEADLINES
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.causes import OscillationCause
from stiction.report import labels


def sticky(n=1500):
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    run = st.simulate(loop, 70.0, float(n), seed=1, pv_start=60.0, op_start=50.0, loop_type="flow", tag="FC1")
    return replace(run, mv=None)


CHANGES = {
    "op rests": lambda run: {"op": np.full(len(run), 50.0)},
    "pv rests": lambda run: {"pv": np.full(len(run), 60.0)},
    "nothing but gaps": lambda run: {"pv": np.full(len(run), np.nan)},
    "all in manual": lambda run: {"auto": np.zeros(len(run), dtype=bool)},
}


@pytest.mark.parametrize("change", CHANGES)
def test_an_undecided_record_has_a_page_with_its_state(change, tmp_path):
    run = sticky()
    found = st.diagnose(replace(run, **CHANGES[change](run)))
    assert found.verdict == "undecided"
    assert len(found.record) == len(run)
    page = st.write_report([found], tmp_path / "page.html").read_text()
    assert f"{HEADLINES[found.loop_state.state]}: cannot tell whether the valve sticks" in page
    assert "No action" not in page.split("<body", 1)[1]


def test_the_identification_covers_the_analysed_part(tmp_path):
    run = sticky()
    auto = np.ones(len(run), dtype=bool)
    auto[:400] = False
    found = st.diagnose(replace(run, auto=auto))
    assert found.verdict == "stiction"
    assert (found.quality.first, found.quality.last) == (400, len(run))
    assert found.identification is not None
    assert found.identification.pv.shape == (len(run) - 400,)
    assert st.write_report([found], tmp_path / "page.html").stat().st_size > 1000


@pytest.mark.parametrize(("op_reversals", "confidence"), [(1, "Low confidence, as"), (20, "High confidence")])
def test_a_dead_zone_without_an_oscillation(op_reversals, confidence):
    zone = DeadZone(47.0, 53.0, 44.0, 56.0, 50.0, 20, op_reversals)
    run = record()
    found = diagnosis(
        verdict="no_stiction",
        run=run,
        identification=identification(run, dead_zone=zone),
        oscillation_cause=OscillationCause(dead_zone=0.9),
        oscillation=replace(find_oscillation(run), oscillating=False),
    )
    assert labels.headline(found).startswith("Dead zone at a fixed OP")
    assert labels.confidence_text(found).startswith(confidence)

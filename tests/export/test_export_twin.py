"""The twin of a recorded loop as an FMU: it oscillates like the record, and says what the record did not show."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from tests.services import require

import stiction as st
from stiction.simulation.demo import demo_plant

fmpy = pytest.importorskip("fmpy")


@pytest.fixture(scope="module")
def plant():
    return {one.record.tag: one.record for one in demo_plant()}


def wave(x, dt):
    """Period [s] and half peak to peak, from the main line of the spectrum and from percentiles."""
    x = x - x.mean()
    power = np.abs(np.fft.rfft(x * np.hanning(x.size), 8 * x.size)) ** 2
    return 8 * x.size * dt / np.argmax(power), np.ptp(np.percentile(x, [3.0, 97.0])) / 2.0


def test_twin_of_the_demo_oscillates_like_its_record(plant, tmp_path):
    require(shutil.which("cc"), "no C compiler on this machine")
    record = plant["FIC-101"]
    written = st.export_fmu(st.diagnose(record), tmp_path / "twin.fmu")
    known = fmpy.read_model_description(str(tmp_path / "twin.fmu"))
    experiment = known.defaultExperiment
    assert float(experiment.stopTime) == record.op.size * record.dt
    assert float(experiment.stepSize) == written.dt
    run = fmpy.simulate_fmu(
        str(tmp_path / "twin.fmu"), stop_time=float(experiment.stopTime), output_interval=written.dt
    )
    for name in ("op", "pv"):
        found, truth = wave(run[name], written.dt), wave(getattr(record, name), record.dt)
        assert found == pytest.approx(truth, rel=0.2)
    assert abs(np.mean(run["op"]) - np.mean(record.op)) < 1.0
    text = "Without disturbances it oscillates with a period of"
    assert text in known.description
    assert text in written.summary()


def test_twin_of_an_undecided_loop_says_so(plant, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))  # the binary is not needed
    found = st.diagnose(plant["TIC-105"])
    assert found.verdict == "undecided"
    written = st.export_fmu(found, tmp_path / "twin.fmu")
    text = "The record does not decide whether the valve sticks, so S and J are only those of the best fit."
    assert text in written.summary()
    assert text in fmpy.read_model_description(str(tmp_path / "twin.fmu")).description

"""FMUs: valid by fmpy, and stepped by fmpy equal to `stroke`; reset, saved states, refusals, source-only FMUs."""

from __future__ import annotations

import shutil
import zipfile

import numpy as np
import pytest
from tests.export.compiled import FLAGS, models, physical, random_op, sampling_period
from tests.services import require

import stiction as st

fmpy = pytest.importorskip("fmpy")

from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

MODELS = models()
STEPPED = {name: MODELS[name] for name in ("kano", "srinivasan_never", "kano_stops")} | {"physical": physical()}


class Importer:
    """One instance of an FMU, driven by fmpy in steps of its own sampling period."""

    def __init__(self, path, folder):
        self.description = fmpy.read_model_description(str(path))
        self.references = {one.name: one.valueReference for one in self.description.modelVariables}
        self.two = self.description.fmiVersion == "2.0"
        self.log = []
        self.fmu = (FMU2Slave if self.two else FMU3Slave)(
            guid=self.description.guid, unzipDirectory=fmpy.extract(str(path), str(folder)), instanceName="valve",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate()
        self.time = 0.0

    def start(self, **values):
        if self.two:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode(**({} if self.two else {"startTime": 0.0}))
        self.set(**values)
        self.fmu.exitInitializationMode()
        self.time = 0.0

    def set(self, **values):
        put = self.fmu.setReal if self.two else self.fmu.setFloat64
        put([self.references[name] for name in values], list(values.values()))

    def get(self, name):
        return (self.fmu.getReal if self.two else self.fmu.getFloat64)([self.references[name]])[0]

    def step(self, size, **values):
        self.set(**values)
        self.fmu.doStep(self.time, size)
        self.time += size

    def positions(self, op, dt):
        found = np.empty(len(op))
        reference = [self.references["op"]], [self.references["position"]]
        put, get = (self.fmu.setReal, self.fmu.getReal) if self.two else (self.fmu.setFloat64, self.fmu.getFloat64)
        for k, value in enumerate(op):
            put(reference[0], [value])
            self.fmu.doStep(k * dt, dt)
            found[k] = get(reference[1])[0]
        return found


@pytest.fixture
def importer(tmp_path):
    require(shutil.which("cc"), "no C compiler on this machine")
    made = []

    def build(model, dt, fmi):
        path = tmp_path / f"valve{len(made)}.fmu"
        st.export_fmu(model, path, dt=dt, fmi=fmi)
        made.append(Importer(path, tmp_path / f"unpacked{len(made)}"))
        return made[-1]

    yield build
    for one in made:
        one.fmu.terminate()
        one.fmu.freeInstance()


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize("name", [*MODELS, "loop"])
def test_fmu_is_valid(name, fmi, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))  # valid without a compiler, and quick
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), 1.0)
    model = loop if name == "loop" else MODELS[name]
    written = st.export_fmu(model, tmp_path / "x.fmu", dt=sampling_period(model), fmi=fmi)
    assert validate_fmu(str(tmp_path / "x.fmu")) == []
    assert "C source only" in written.note
    assert not [file for file in zipfile.ZipFile(tmp_path / "x.fmu").namelist() if file.startswith("binaries")]


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize("name", STEPPED)
def test_fmu_is_stroke(name, fmi, importer):
    model, dt, n = STEPPED[name], sampling_period(STEPPED[name]), 100_000 if name == "kano" else 10_000
    op = random_op(n)
    fmu = importer(model, dt, fmi)
    fmu.start(op=op[0])
    expected = st.stroke(model, op, dt).mv
    assert np.ptp(expected) > 5.0
    assert np.abs(fmu.positions(op, dt) - expected).max() <= 1e-12


def test_parameters_are_set_before_the_start(importer):
    fmu = importer(st.Kano(5.0, 2.0), 1.0, "2.0")
    op = random_op(500)
    fmu.start(S=3.0, J=1.0, position_offset=-1.0, op=op[0])
    expected = st.stroke(st.Kano(3.0, 1.0), op, 1.0, mv_start=op[0] - 1.0).mv
    assert fmu.positions(op, 1.0).tolist() == expected.tolist()


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_state_is_saved_restored_serialised_and_reset(fmi, importer):
    fmu, op = importer(st.Kano(3.0, 1.0), 1.0, fmi), random_op(400)
    fmu.start(op=op[0])
    first = [fmu.step(1.0, op=u) or fmu.get("position") for u in op[:200]]
    get, put = (
        (fmu.fmu.getFMUstate, fmu.fmu.setFMUstate) if fmi == "2.0" else (fmu.fmu.getFMUState, fmu.fmu.setFMUState)
    )
    saved = get()
    rest = [fmu.step(1.0, op=u) or fmu.get("position") for u in op[200:]]
    if fmi == "2.0":
        saved = fmu.fmu.deSerializeFMUstate(fmu.fmu.serializeFMUstate(saved))
    put(saved)
    fmu.time = 200.0
    assert [fmu.step(1.0, op=u) or fmu.get("position") for u in op[200:]] == rest
    fmu.fmu.reset()
    fmu.start(op=op[0])
    assert [fmu.step(1.0, op=u) or fmu.get("position") for u in op] == first + rest


def test_importer_may_step_otherwise_than_the_model(importer):
    """Each sample is taken once, at the start of the step in which it lies."""
    op = random_op(60)
    expected = st.stroke(st.Kano(3.0, 1.0), op, 1.0).mv
    fine = importer(st.Kano(3.0, 1.0), 1.0, "2.0")
    fine.start(op=op[0])
    seen = [fine.step(0.25, op=op[k // 4]) or fine.get("position") for k in range(4 * len(op))]
    assert seen[::4] == seen[3::4] == expected.tolist()
    coarse = importer(st.Kano(3.0, 1.0), 1.0, "2.0")
    coarse.start(op=op[0])
    seen = [coarse.step(3.0, op=u) or coarse.get("position") for u in op[:20]]
    assert seen == st.stroke(st.Kano(3.0, 1.0), np.repeat(op[:20], 3), 1.0).mv[2::3].tolist()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"S": -1.0}, "S is out of its range: at least 0. Given: S = -1."),
        ({"J": float("nan")}, "J is out of its range"),
    ],
)
def test_parameter_out_of_range_is_refused(values, text, importer, capfd):
    fmu = importer(st.Kano(5.0, 2.0), 1.0, "2.0")
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmu.start(op=1.0, **values)
    assert text in capfd.readouterr().out
    fmu.fmu.reset()
    fmu.start(op=1.0)


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize(
    ("model", "values", "text"),
    [
        (st.He(2.0, 1.0), {"fd": 2.5}, "fd is above fs. Given: fs = 2, fd = 2.5."),
        (st.Srinivasan(2.0, 1.0, 0.1), {"sj": 9.0}, "sj is above 2 sb. Given: sb = 2, sj = 9."),
        (st.Knocker(1.5, 2.0, 5.0), {"width": 6.0}, "width is not below interval. Given: width = 6, interval = 5."),
    ],
)
def test_parameters_that_do_not_fit_together_are_refused(model, values, text, fmi, importer, capfd):
    fmu = importer(model, 1.0, fmi)
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmu.start(op=1.0, **values)
    assert text in capfd.readouterr().out


def test_a_repeated_communication_point_is_refused(importer, capfd):
    fmu = importer(st.Kano(5.0, 2.0), 1.0, "2.0")
    fmu.start(op=1.0)
    fmu.step(1.0, op=1.0)
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmu.fmu.doStep(0.0, 1.0)
    assert "begin where the last one ended" in capfd.readouterr().out


def test_ranges_units_and_texts_come_from_the_page(tmp_path):
    st.export_fmu(st.HeWang(2.0, 1.0, 1.5), tmp_path / "x.fmu", dt=0.5)
    description = fmpy.read_model_description(str(tmp_path / "x.fmu"))
    known = {one.name: one for one in description.modelVariables}
    assert (known["K"].min, known["K"].max, known["K"].start) == ("1.0", "2.0", "1.5")
    assert (known["fs"].min, known["fs"].max, known["fs"].unit) == ("0.0", None, "% of span")
    assert known["fs"].description == "Static friction band. [% of span]"
    assert known["dt"].start == "0.5"


@pytest.mark.parametrize(("compiler", "fmi"), [("gcc", "2.0"), ("clang", "3.0")])
def test_source_compiles_without_a_warning(compiler, fmi, tmp_path, monkeypatch):
    import subprocess

    require(shutil.which(compiler), f"no {compiler} on this machine")
    st.export_fmu(st.TwoMove(3.0, 1.0, 1.0), tmp_path / "x.fmu", dt=1.0, fmi=fmi)
    zipfile.ZipFile(tmp_path / "x.fmu").extractall(tmp_path)
    command = [shutil.which(compiler), "-O2", *FLAGS, "-fPIC", "-c", "-o", str(tmp_path / "fmu.o"), "fmu.c"]
    done = subprocess.run(command, cwd=tmp_path / "sources", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr

"""``stiction export`` and ``stiction diagnose --export-twin``."""

from __future__ import annotations

import json
import re
import zipfile

import numpy as np
import pytest

import stiction as st
from stiction.apps.cli import main


def test_nothing_is_written_where_one_path_exists(tmp_path, capsys):
    (tmp_path / "kano.mo").write_text("")
    paths = ["--fmu", f"{tmp_path}/kano.fmu", "--modelica", f"{tmp_path}/kano.mo"]
    assert main(["export", "kano:S=5,J=2", "--dt", "1", *paths]) == 3
    assert "kano.mo: exists and is not replaced" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["kano.mo"]


def test_all_forms_in_one_run(tmp_path, capsys):
    arguments = ["--fmu", f"{tmp_path}/kano.fmu", "--c", f"{tmp_path}/c", "--modelica", f"{tmp_path}/Kano.mo"]
    arguments += ["--matlab", f"{tmp_path}/kano.m", "--fmi", "3.0", "--json"]
    assert main(["export", "kano", "--parameter", "S=5", "--parameter", "J=2", "--dt", "0.5", *arguments]) == 0
    written = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in written] == ["kano", "kano", "Kano", "kano"]
    assert {one["dt_s"] for one in written} == {0.5}
    assert 'fmiVersion="3.0"' in zipfile.ZipFile(tmp_path / "kano.fmu").read("modelDescription.xml").decode()
    assert re.search(r"parameters.S = 5.0;\n.*parameters.J = 2.0;", (tmp_path / "c" / "kano.c").read_text())


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["kano:S=5,J=2"], "give --fmu FILE, --c FOLDER, --modelica FILE or --matlab FILE"),
        (["kano", "--parameter", "S=-5", "--parameter", "J=2", "--fmu", "x.fmu"], "S = -5 % of span is negative"),
        (["kanu:S=5,J=2", "--fmu", "x.fmu"], "kano"),
        (["two-move:S=3,J=1", "--fmu", "x.fmu"], "band"),
        (["kano:S=5,J=2", "--fmu", "x.fmu", "--fmi", "1.0"], "use '2.0' or '3.0'"),
        (["kano:S=5,J=2", "--matlab", "for.m"], "is reserved"),
        (["kano:S=5,J=2", "--matlab", "same", "--modelica", "./same"], "two options name the same path"),
    ],
)
def test_wrong_use(arguments, text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *arguments, "--dt", "1"]) == 2
    assert text in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def sticky_file(tmp_path):
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    record = st.simulate(loop, 10.0, 2_000.0, seed=1)
    path = tmp_path / "FIC-101.csv"
    rows = np.stack([record.time, record.sp, record.pv, record.op], axis=1)
    np.savetxt(path, rows, delimiter=",", header="time,sp,pv,op", comments="", fmt="%.6g")
    return path


def test_twin_of_a_recorded_loop(sticky_file, tmp_path, capsys):
    fmpy = pytest.importorskip("fmpy")
    twin = tmp_path / "twin.fmu"
    assert main(["diagnose", str(sticky_file), "--no-report", "--export-twin", str(twin)]) == 1
    assert re.search(r"twin\.fmu: twin, every [\d.]+ s", capsys.readouterr().out)
    known = {one.name: one for one in fmpy.read_model_description(str(twin)).modelVariables}
    S, J = known["valve_S"], known["valve_J"]
    assert float(S.min) <= float(S.start) <= float(S.max)
    assert float(S.start) == pytest.approx(3.0, abs=0.3)
    assert float(J.start) == pytest.approx(1.0, abs=0.3)
    assert float(S.max) - float(S.min) < 2.0
    assert float(known["controller_Kc"].start) == pytest.approx(0.2, rel=0.1)
    # An existing file is refused before the work.
    assert main(["diagnose", str(sticky_file), "--no-report", "--export-twin", str(twin)]) == 3
    assert "exists and is not replaced" in capsys.readouterr().err


def test_twin_of_several_loops_is_refused_before_the_diagnosis(sticky_file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("stiction.diagnose", lambda *_, **__: pytest.fail("diagnosed"))
    folder = tmp_path / "two"
    folder.mkdir()
    text = sticky_file.read_text()
    for tag in ("FIC-101", "FIC-102"):
        (folder / f"{tag}.csv").write_text(text.replace("FIC-101", tag))
    assert main(["diagnose", str(folder), "--no-report", "--export-twin", str(tmp_path / "x.fmu")]) == 2
    assert "--tag" in capsys.readouterr().err

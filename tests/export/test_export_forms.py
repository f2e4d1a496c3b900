"""MATLAB and Modelica files, refusals, and every model in all forms."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from typing import NamedTuple

import numpy as np
import pytest
from tests.export.compiled import FLAGS, is_valve, models, random_op, sampling_period
from tests.services import require

import stiction as st
from stiction.export.syntax import Syntax
from stiction.export.translate import Translator
from stiction.export.values import TranslationError, Value

MODELS = models()
WRITERS = {"fmu": st.export_fmu, "modelica": st.export_modelica, "matlab": st.export_matlab}


@pytest.mark.parametrize("name", MODELS)
def test_all_numbers_of_a_model_can_be_changed_after_its_export(name, tmp_path):
    """A new model is translated as the others are: its settings are parameters, not constants."""
    model = MODELS[name]
    numbers = [one for one in vars(model) if type(getattr(model, one)) is float]
    if name == "srinivasan_table":
        numbers = ["r"]  # a table is fixed when the model is exported
    written = st.export_c(model, tmp_path, dt=sampling_period(model), name="x")
    assert set(written.parameters) - {"position_offset"} == set(numbers)
    assert not re.search(r"\b(malloc|static \w+ \w+ =|static \w+ \w+;)", (tmp_path / "x.c").read_text())
    assert re.findall(r"#include (\S+)", (tmp_path / "x.c").read_text()) == ['"x.h"', "<math.h>"]


def octave(folder, script: str) -> str:
    require(shutil.which("octave"), "no octave on this machine")
    command = ["octave", "--no-gui", "--norc", "--quiet", "--eval", script]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_matlab_functions_are_the_kernels(tmp_path):
    """All valves by Octave, which runs MATLAB functions."""
    n, script = 200, ["load op.txt;"]
    op = random_op(n)
    np.savetxt(tmp_path / "op.txt", op, fmt="%.17g")
    valves = {name: model for name, model in MODELS.items() if is_valve(model)}
    for name, valve in valves.items():
        st.export_matlab(valve, tmp_path / f"{name}.m", dt=sampling_period(valve))
        script.append(f"m = []; for k = 1:{n}, [x, m] = {name}(op(k), m); printf('%.17g ', x); end; printf('\\n');")
    st.export_matlab(st.Knocker(1.5, 2.0, 5.0), tmp_path / "knocker.m", dt=1.0)
    script.append("m = []; for k = 1:20, [x, h, t, m] = knocker(op(k), 1, 2, m); printf('%.17g ', x); end;")
    rows = octave(tmp_path, "\n".join(script)).strip().splitlines()
    for (name, valve), row in zip(valves.items(), rows, strict=False):
        expected = st.stroke(valve, op, sampling_period(valve)).mv
        assert np.abs(np.array(row.split(), dtype=float) - expected).max() <= 1e-9, name
    pulses = np.array(rows[-1].split(), dtype=float) - op[:20]
    assert set(np.round(np.abs(pulses), 9)) == {0.0, 1.5}


def test_matlab_function_refuses_parameters(tmp_path):
    st.export_matlab(st.Kano(5.0, 2.0), tmp_path / "valve.m", dt=1.0)
    script = "try, valve(1, [], struct('S', -1, 'J', 1, 'position_offset', 0)); catch e, disp(e.message); end"
    assert "S is out of its range: at least 0." in octave(tmp_path, script)


@pytest.mark.parametrize(("file", "fitting"), [("my-valve.m", "my_valve.m"), ("3valve.m", "valve_3valve.m")])
@pytest.mark.parametrize("name", [None, "kano"])
def test_a_file_name_that_matlab_cannot_call_is_refused(file, fitting, name, tmp_path):
    with pytest.raises(st.ParameterError, match=f"name the file {fitting}"):
        st.export_matlab(st.Kano(5.0, 2.0), tmp_path / file, dt=1.0, name=name)
    assert list(tmp_path.iterdir()) == []


def test_c_start_takes_the_position_as_an_argument(tmp_path):
    written = st.export_c(st.Kano(5.0, 2.0), tmp_path, dt=1.0)
    assert written.parameters == ("S", "J")
    assert "kano_start takes op, position." in written.summary()
    assert "kano_start(kano_model *m, double op, double position)" in written.files[0].read_text()


def test_modelica_block_calls_the_kernel(tmp_path):
    """The C in the annotation, called as Modelica calls it: the state of the model in an array of the caller."""
    require(shutil.which("gcc"), "no gcc on this machine")
    st.export_modelica(st.Kano(5.0, 2.0), tmp_path / "Valve.mo", dt=1.0)
    text = (tmp_path / "Valve.mo").read_text()
    assert text.splitlines()[2].startswith("block Valve ")
    assert text.rstrip().endswith("end Valve;")
    (tmp_path / "valve.c").write_text(re.search(r'Include = "(.*?[^\\])"\)', text, re.S)[1].replace('\\"', '"'))
    command = ["gcc", "-O2", *FLAGS, "-shared", "-fPIC", "-o", "valve.so", "valve.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    sample = ctypes.CDLL(str(tmp_path / "valve.so")).Valve_sample
    n = int(re.search(r"memory\[(\d+)\]\(each", text)[1])
    series = [np.ctypeslib.ndpointer(np.float64)] * 5
    sample.argtypes = [ctypes.c_int, ctypes.c_double, *series]
    before, memory, y, found, op = np.zeros(n), np.zeros(n), np.zeros(1), [], random_op(300)
    for k, u in enumerate(op):
        assert sample(k == 0, 1.0, np.array([3.0, 1.0, 0.0]), np.array([u]), before, memory, y) == 0
        before, memory = memory, before
        found.append(y[0])
    assert found == st.stroke(st.Kano(3.0, 1.0), op, 1.0).mv.tolist()
    assert sample(1, 1.0, np.array([-3.0, 1.0, 0.0]), np.array([1.0]), before, memory, y) == 1


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("path", [None, 3, b"x", "a" * 300, "x\0y", "\ud800"], ids=repr)
def test_what_is_no_path_is_refused(form, path):
    with pytest.raises(st.StictionError, match=r"is no path to write to|is not a name"):
        WRITERS[form](st.Kano(5.0, 2.0), path, dt=1.0)


@pytest.mark.parametrize("form", WRITERS)
def test_a_path_that_exists_is_left_alone(form, tmp_path):
    target = tmp_path / "kept"
    target.write_text("mine")
    with pytest.raises(st.RecordError, match="exists and is not replaced"):
        WRITERS[form](st.Kano(5.0, 2.0), target, dt=1.0)
    assert target.read_text() == "mine"


def test_c_files_that_exist_are_left_alone(tmp_path):
    (tmp_path / "kano.c").write_text("mine")
    with pytest.raises(st.RecordError, match="exists"):
        st.export_c(st.Kano(5.0, 2.0), tmp_path, dt=1.0)
    assert [file.name for file in tmp_path.iterdir()] == ["kano.c"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"dt": 0.0}, "dt = 0 s is not positive"),
        ({}, "dt is missing"),
        ({"dt": 1.0, "name": "while"}, "is reserved"),
        ({"dt": 1.0, "name": "math"}, "is reserved"),
        ({"dt": 1.0, "name": "Real"}, "is reserved"),
        ({"dt": 1.0, "name": 3}, "is not a name"),
        ({"dt": 1.0, "name": "1kano"}, "is not a name"),
        ({"dt": 1.0, "fmi": "1.0"}, "use '2.0' or '3.0'"),
    ],
)
def test_wrong_arguments(arguments, text, tmp_path):
    with pytest.raises(st.ParameterError, match=text):
        st.export_fmu(st.Kano(5.0, 2.0), tmp_path / "x.fmu", **arguments)
    assert list(tmp_path.iterdir()) == []


def test_step_that_a_model_cannot_take(tmp_path):
    with pytest.raises(st.ParameterError, match="shorter than one sample"):
        st.export_c(st.Knocker(1.5, 2.0, 5.0), tmp_path, dt=10.0)
    with pytest.raises(st.ParameterError, match="differs from the sampling period of the loop"):
        st.export_c(st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0), 1.0), tmp_path, dt=2.0)


def test_other_objects_are_refused(tmp_path):
    with pytest.raises(st.ParameterError, match="give a valve such as"):
        st.export_fmu("kano", tmp_path / "x.fmu", dt=1.0)  # pyright: ignore[reportArgumentType]


def test_no_folder(tmp_path):
    with pytest.raises(st.RecordError, match="there is no folder"):
        st.export_fmu(st.Kano(5.0, 2.0), tmp_path / "no" / "x.fmu", dt=1.0)


class Pair(NamedTuple):
    a: float
    b: float


def loops_over_a_list(x):
    for y in [1.0, 2.0]:
        x = x + y
    return x


def uses_a_dictionary(x):
    table = {"x": x}
    return table["x"]


def raises_to_a_power(x):
    return x**2.5


def has_two_types(x):
    return Pair(x, x) if x > 0.0 else x


def uses_text(x):
    return x + "1"


def keeps_numbers_that_change(x):
    pair = (x, 2.0 * x)
    x = x + 1.0
    return pair[0] + x


def takes_a_record_apart_after_elif(x):
    if x > 1.0:
        x = 0.0
    elif Pair(x, x).a > 0.0:
        x = 1.0
    return x


@pytest.mark.parametrize(
    ("kernel", "line"),
    [
        (loops_over_a_list, 1), (uses_a_dictionary, 1), (raises_to_a_power, 1), (has_two_types, 1), (uses_text, 1),
        (keeps_numbers_that_change, 1), (takes_a_record_apart_after_elif, 3),
    ],
)  # fmt: skip
def test_translator_names_the_line_that_it_does_not_know(kernel, line):
    first = kernel.__code__.co_firstlineno
    with pytest.raises(TranslationError, match=rf"test_export_forms\.py, line {first + line}: .*translated to C"):
        Translator(Syntax("C", "x")).call(kernel, [Value("double", "x")])

"""Whatever is wrong with a parameter, the answer is a sentence that names it, never another error."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as hs

import stiction as st
from stiction.models import StateSpace
from stiction.models.positioner import Positioner

WRONG = hs.one_of(
    hs.sampled_from([math.nan, -math.inf, math.inf, -1.0, "wide", None, [1.0, 2.0]]), hs.floats(max_value=-1e-300)
)
VALVES = [
    (st.Stenman, {"d": 1.0}),
    (st.Kano, {"S": 3.0, "J": 1.0}),
    (st.Choudhury, {"S": 3.0, "J": 1.0}),
    (st.He, {"fs": 2.0, "fd": 1.0}),
    (st.HeWang, {"fs": 2.0, "fd": 1.0, "K": 1.0}),
    (st.Srinivasan, {"sb": 2.0, "sj": 1.0}),
]


@pytest.mark.parametrize(("valve", "good"), VALVES, ids=lambda v: getattr(v, "__name__", ""))
@given(data=hs.data(), wrong=WRONG)
def test_valve(valve, good, data, wrong):
    name = data.draw(hs.sampled_from(sorted(good)))
    rest = {"r": 0.0} if valve is st.Srinivasan else {}
    with pytest.raises(st.ParameterError, match=rf"\b{name}\b.*\.$"):
        valve(**(good | {name: wrong} | rest))


@pytest.mark.parametrize("rate", [-1.0, math.nan, "fast", None])
def test_rate(rate):
    with pytest.raises(st.ParameterError, match=r"^r "):
        st.Srinivasan(2.0, 1.0, rate)
    assert st.Srinivasan(2.0, 1.0, math.inf).r == math.inf


def test_bands_that_contradict_each_other():
    with pytest.raises(st.ParameterError, match="fd = 3 % exceeds fs = 2 %"):
        st.He(2.0, 3.0)
    with pytest.raises(st.ParameterError, match="give sj <= 2 sb"):
        st.Srinivasan(1.0, 2.5, 0.0)
    with pytest.raises(st.ParameterError, match="give sj <= 2 sb"):
        st.Srinivasan(st.Table([0.0, 100.0], [2.0, 1.0]), 3.0, 0.0)
    with pytest.raises(st.ParameterError, match=r"K = 2\.5 is outside 1 to 2"):
        st.HeWang(2.0, 1.0, 2.5)


@pytest.mark.parametrize("travel", [(5.0, 5.0), (1.0, 0.0), (0.0,), "all", None, (0.0, math.nan), (0.0, "x")])
def test_travel(travel):
    with pytest.raises(st.ParameterError, match=r"^travel = .*give \(?lowest"):
        st.Kano(3.0, 1.0, travel=travel)


@pytest.mark.parametrize("time", [0.0, -1.0, math.nan, "long", None])
def test_integral_time_of_a_positioner(time):
    with pytest.raises(st.ParameterError, match=r"^integral_time .*"):
        Positioner(5.0, integral_time=time)
    assert Positioner(5.0).integral_time == math.inf


TABLES = [
    (([0.0, 0.0], [1.0, 1.0]), "position must be a series of finite, increasing numbers"),
    (([0.0, 1.0], [1.0]), "give one value per position"),
    (([0.0, 1.0], [1.0, -1.0]), "negative or non-finite"),
    (("here", [1.0]), "position must be a series of numbers"),
    (([0.0], ["much"]), "value must be a series of numbers"),
    (([0.0], [[1.0, 2.0]], [1.0, 0.5]), "rate must be a series of finite, increasing numbers"),
]


@pytest.mark.parametrize(("arguments", "message"), TABLES)
def test_table(arguments, message):
    with pytest.raises(st.ParameterError, match=message):
        st.Table(*arguments)


PROCESSES = [
    (lambda: st.TransferFunction([1.0, 1.0, 1.0], [1.0, 1.0]), "improper.*add the missing lags"),
    (lambda: st.TransferFunction([0.0], [1.0, 1.0]), "num is zero"),
    (lambda: st.TransferFunction([1.0], [0.0, 0.0]), "den is zero"),
    (lambda: st.TransferFunction([1.0], [math.nan, 1.0]), "den must be a series of finite numbers"),
    (lambda: st.TransferFunction("one", [1.0]), "num must be a series of numbers"),
    (lambda: st.FOPDT(1.0, -1.0), "tau = -1 s is negative"),
    (lambda: st.FOPDT(1.0, 1.0, -1.0), "dead_time = -1 s is negative"),
    (lambda: st.FOPDT(math.inf, 1.0), "K must be a finite number"),
    (lambda: st.SOPDT(1.0, 1.0, -1.0), "tau2 = -1 s is negative"),
    (lambda: st.Integrating("K"), "K must be a number"),
    (lambda: StateSpace([[1.0, 2.0]], [1.0], [1.0]), "do not fit"),
    (lambda: StateSpace([["a"]], [1.0], [1.0]), "not an array of numbers"),
    (lambda: StateSpace([[math.nan]], [1.0], [1.0]), "not finite"),
]


@pytest.mark.parametrize(("make", "message"), PROCESSES)
def test_process(make, message):
    with pytest.raises(st.ParameterError, match=message):
        make()


PID, VALVE, PLANT = st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0)
LOOPS = [
    ({"dt": 0.0}, "dt = 0 s is not positive"),
    ({"noise": -1.0}, "noise = -1 PV units is negative"),
    ({"valve": 3.0}, "valve is a float; give a valve model"),
    ({"controller": None}, "controller is a NoneType; give a controller model"),
    ({"process": "tank"}, "process is a str; give a TransferFunction"),
    ({"process": st.TransferFunction([2.0, 1.0], [8.0, 1.0])}, "direct path.*Add a lag or a dead time"),
]


@pytest.mark.parametrize(("options", "message"), LOOPS)
def test_loop(options, message):
    with pytest.raises(st.ParameterError, match=message):
        st.Loop(**({"controller": PID, "valve": VALVE, "process": PLANT, "dt": 1.0} | options))


def test_systems_that_are_no_process():
    import control

    with pytest.raises(st.ParameterError, match="process is sampled"):
        st.Loop(PID, VALVE, control.tf([1.0], [1.0, -0.5], 1.0), 1.0)
    with pytest.raises(st.ParameterError, match="give one"):
        st.Loop(PID, VALVE, control.ss([[-1.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]]), 1.0)


@pytest.mark.parametrize("dt", [1e-320, 1e-7])
def test_a_dead_time_of_too_many_samples_is_refused_before_memory_is_taken(dt):
    with pytest.raises(st.ParameterError, match=r"dead_time = 10 s is .* samples .* longer dt"):
        st.FOPDT(1.0, 5.0, 10.0).discretise(dt)

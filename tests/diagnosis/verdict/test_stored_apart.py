"""OP and PV that were not stored in step, or not at one rate, and a loop that was shut down."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import floats, integers, sampled_from

import stiction as st
from stiction.diagnosis.identification import fit_controller
from stiction.diagnosis.identification.in_step import MOST_LATE, with_pv_earlier
from stiction.display import describe_check
from stiction.records import LoopRecord, analysis_window, assess_quality
from stiction.records.quality import find_shutdown


@cache
def run(name):
    valve = {"sticky": st.Kano(5.0, 3.0), "resting": st.He(3.5, 1.5), "good": st.Ideal()}[name]
    k = np.arange(3000)
    load = 3.0 * np.sin(2.0 * np.pi * k / 60.0) if name == "good" else np.where(k < 20, 6.0, 0.0)
    loop = st.Loop(st.PID(0.4, 8.0), valve, st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 70.0, 3000.0, load, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return replace(record, mv=None)


@cache
def as_stored(name):
    return st.diagnose(run(name))


def held_back(x, samples):
    return np.concatenate([np.repeat(x[:1], samples), x[: x.size - samples]])


def late(record, samples):
    return replace(record, pv=held_back(record.pv, samples))


@pytest.mark.parametrize("samples", range(1, MOST_LATE + 1))
@pytest.mark.parametrize("name", ["sticky", "resting"])
def test_a_pv_that_is_late_hides_no_valve(name, samples):
    right, found = as_stored(name), st.diagnose(late(run(name), samples))
    assert right.probability > 0.99
    assert (found.verdict, found.probability) == ("stiction", 0.9)
    assert pytest.approx(right.identification.S, rel=0.02) == found.identification.S
    assert found.controller.samples_late == found.to_dict()["controller"]["samples_late"] == samples
    how_much = "a sample" if samples == 1 else f"{samples} samples"
    assert f"PV was stored {how_much} late, and is taken as much earlier." in found.reason
    assert right.controller.samples_late == 0
    assert "PV was stored" not in right.reason


@pytest.mark.parametrize("samples", range(1, MOST_LATE + 1))
def test_a_good_valve_stays_good(samples):
    found = st.diagnose(late(run("good"), samples))
    assert found.verdict == "no_stiction"
    assert found.probability == 0.1
    assert found.controller.samples_late == samples


@pytest.mark.parametrize("samples", range(1, MOST_LATE + 1))
def test_what_is_taken_earlier_is_the_pv_alone(samples):
    record = run("sticky")
    mended = with_pv_earlier(late(record, samples), samples)
    assert len(mended) == len(record) - samples
    np.testing.assert_array_equal(mended.pv, record.pv[:-samples])
    np.testing.assert_array_equal(mended.op, record.op[:-samples])
    assert fit_controller(mended).samples_late == 0


@pytest.mark.parametrize("name", ["sticky", "resting", "good"])
def test_a_pv_in_step_or_early_is_not_late(name):
    record = run(name)
    ops = [held_back(record.op, samples) for samples in (0, 1, 2, 4)]
    assert [fit_controller(replace(record, op=op)).samples_late for op in ops] == [0, 0, 0, 0]


def test_a_pv_later_than_is_looked_for_is_not_taken_for_one_less_late():
    assert fit_controller(late(run("sticky"), MOST_LATE + 1)).samples_late == 0


def by_law(rng, Kc, Ki, moving):
    """A PV that wanders, and the OP that a PI controller makes of it."""
    pv = 50.0 + np.cumsum(rng.normal(size=400))
    sp = 50.0 + moving * np.repeat(rng.normal(size=20), 20)
    op = 50.0 + Kc * (sp - pv) + Ki * np.cumsum(sp - pv) + 0.01 * rng.normal(size=400)
    return LoopRecord("FIC-101", 1.0, op=op, pv=pv, sp=sp)


@settings(max_examples=50, deadline=None)
@given(
    samples=integers(0, MOST_LATE), Kc=floats(0.1, 3.0), reset=floats(0.01, 0.5), sign=sampled_from([-1.0, 1.0]),
    moving=sampled_from([0.0, 2.0]), seed=integers(0, 2**32 - 1), gap=integers(0, 350),
)  # fmt: skip
def test_the_count_is_that_of_the_law(samples, Kc, reset, sign, moving, seed, gap):
    record = late(by_law(np.random.default_rng(seed), sign * Kc, sign * Kc * reset, moving), samples)
    assert fit_controller(record).samples_late == samples
    op = record.op.copy()
    op[gap : gap + 20] = np.nan
    assert fit_controller(replace(record, op=op)).samples_late == samples
    in_other_units = replace(record, op=100.0 - 0.3 * record.op, pv=7.0 * record.pv + 3.0, sp=7.0 * record.sp + 3.0)
    assert fit_controller(in_other_units).samples_late == samples


def test_a_pv_that_op_makes_is_not_late():
    rng = np.random.default_rng(0)
    op = 50.0 + np.cumsum(rng.normal(size=1000))
    record = LoopRecord("FIC-101", 1.0, op=op, pv=2.0 * held_back(op, 1) + 0.1 * rng.normal(size=1000))
    assert fit_controller(record).samples_late == 0


def test_a_derivative_part_is_no_late_pv():
    loop = st.Loop(st.PID(0.6, 8.0, Td=3.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.02)
    record = st.simulate(loop, 70.0, 2000.0, seed=1, pv_start=60.0, op_start=50.0)
    assert fit_controller(record).samples_late == 0


def held(record, name, every):
    x = getattr(record, name)
    return replace(record, **{name: np.repeat(x[::every], every)[: x.size]})


def read_back(record):
    """OP as a noisy signal gives it back: no law tells what was between."""
    return replace(record, op=record.op + 0.1 * np.random.default_rng(0).normal(size=len(record)))


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("every", [2, 10])
def test_two_rates_are_seen(name, every):
    record = run("resting")
    slower = held(record, name, every)
    [gate] = [gate for gate in assess_quality(slower).checks if gate.name == "storage rate"]
    assert (gate.severity, gate.value) == ("warn", every)
    assert describe_check(gate).startswith(f"{name.upper()} is updated every {every} samples only")
    assert all(gate.severity == "ok" for gate in assess_quality(record).checks if gate.name == "storage rate")


@pytest.mark.parametrize("name", ["op", "pv"])
@pytest.mark.parametrize("every", [2, 5, 10])
@pytest.mark.parametrize("valve", ["sticky", "resting", "good"])
def test_what_the_law_tells_between_is_as_good_as_recorded(name, every, valve):
    right, found = as_stored(valve), st.diagnose(held(run(valve), name, every))
    share = f"{100.0 / every:.0f} %"
    said = (
        f"{name.upper()} is stored at {share} of the samples; the others were reconstructed with the "
        f"controller equation."
    )
    assert said in found.reason
    [gate] = [gate for gate in found.quality.checks if gate.name == "storage rate"]
    assert (gate.severity, describe_check(gate)) == ("ok", said)
    assert gate.value == pytest.approx(every)
    assert found.record.dt == run(valve).dt
    stored, other = (found.stored.op, found.stored.pv) if name == "op" else (found.stored.pv, found.stored.op)
    late = found.controller.samples_late if name == "pv" else 0
    assert (np.flatnonzero(stored) + late).tolist()[:50] == list(range(0, 50 * every, every))
    assert other.mean() >= 0.98
    assert pytest.approx(right.probability, abs=0.01) == found.probability
    if valve != "good":
        assert pytest.approx(right.identification.S, rel=0.01) == found.identification.S


@pytest.mark.parametrize("name", ["op", "pv"])
def test_a_value_held_for_the_export_is_no_transmitter_that_hangs(name):
    record = read_back(run("sticky"))
    found = st.diagnose(held(record, name, 5))
    assert found.verdict == "stiction"
    assert found.record.dt == 5.0 * record.dt
    assert f"{name.upper()} is updated every 5 s" in found.reason
    assert [gate.value for gate in found.quality.warnings if gate.name == "storage rate"] == [5.0]
    assert 0.1 <= found.probability <= 0.9
    good = st.diagnose(held(read_back(run("good")), name, 5))
    assert (good.verdict, good.cause == "sensor") == ("no_stiction", False)
    assert 0.1 <= good.probability <= 0.9


def test_a_position_keeps_every_sample_of_op():
    record = run("sticky")
    slower = replace(record, pv=np.repeat(record.pv[::5], 5)[: len(record)], mv=record.op)
    assert st.diagnose(slower).record.dt == record.dt


def test_an_op_of_another_loop_tells_nothing_surely():
    rng = np.random.default_rng(0)
    other = 50.0 + np.cumsum(rng.normal(size=3000)) * 0.3
    found = st.diagnose(replace(run("good"), op=other, sp=None))
    assert found.controller.left > 0.3
    assert 0.1 <= found.probability <= 0.9


def test_a_shut_down_is_left_out():
    record, down = run("sticky"), np.arange(3000) >= 2500
    rng = np.random.default_rng(0)
    op = np.where(down, 0.0, record.op)
    pv = np.where(down, 2.0 + 0.1 * rng.normal(size=3000), record.pv)
    found = st.diagnose(replace(record, op=op, pv=pv))
    assert analysis_window(replace(record, op=op, pv=pv)) == (0, 2500)
    assert found.verdict == "stiction"
    assert pytest.approx(5.0, rel=0.03) == found.identification.S


def test_a_loop_that_comes_to_its_limit_again_and_again_is_not_shut_down():
    op = np.clip(50.0 + 80.0 * np.sin(2.0 * np.pi * np.arange(3000) / 300.0), 0.0, 100.0)
    assert not find_shutdown(op).any()


def test_the_shares_of_missing_values_that_differ_say_what_each_counts():
    record = run("sticky")
    gone = np.random.default_rng(3).random(len(record)) < 0.25
    found = st.diagnose(replace(record, op=np.where(gone, np.nan, record.op), pv=np.where(gone, np.nan, record.pv)))
    [gate] = [gate for gate in found.quality.checks if gate.name == "missing values"]
    assert gate.value < 100.0 * gone.mean() - 5.0
    assert describe_check(gate).startswith(f"{gate.value:.3g} % of the samples are without OP or PV")
    assert f"; {100.0 * gone.mean():.3g} % were before the reconstruction" in describe_check(gate)
    [whole] = [gate for gate in st.diagnose(record).quality.checks if gate.name == "missing values"]
    assert "reconstruction" not in describe_check(whole)

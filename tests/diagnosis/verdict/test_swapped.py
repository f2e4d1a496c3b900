"""OP and PV in each other's columns are told where that is certain, and nothing is told of the valve then."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.loop_state import are_signals_swapped
from calibration.populations import CAUSES, population

FOPDT = st.FOPDT(1.2, 8.0, 3.0)


@cache
def run(controller, valve=None, process=FOPDT, noise=0.1, moves=False):
    k = np.arange(2000)
    sp = 70.0 + (np.random.default_rng(2).uniform(-5.0, 5.0, 20)[k // 100] if moves else np.zeros(k.size))
    loop = st.Loop(controller, valve or st.Kano(5.0, 3.0), process, dt=1.0, noise=noise)
    record = st.simulate(loop, sp, 2000.0, np.where(k < 20, 6.0, 0.0), seed=1, pv_start=70.0, op_start=50.0)
    return replace(record, mv=None, loop_type="flow")


def swapped(record):
    return replace(record, op=record.pv, pv=record.op)


def seen(record):
    return are_signals_swapped(record.op, record.pv, record.sp) is not None


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("sp_known", [False, True])
@pytest.mark.parametrize("controller", [st.PID(0.4, 8.0), st.PID(0.4, 8.0, 1.0)], ids=["PI", "PID"])
def test_columns_named_wrongly_are_seen(controller, sp_known, moves):
    record = run(controller, moves=moves)
    record = record if sp_known else replace(record, sp=None)
    assert not seen(record)
    # A set point that moves and was not recorded moves OP by no law of what is left.
    assert seen(swapped(record)) == (sp_known or not moves)


def test_the_verdict_names_them_and_tells_nothing_of_the_valve():
    record = run(st.PID(0.4, 8.0))
    assert st.diagnose(record).verdict == "stiction"
    told = st.diagnose(swapped(record))
    assert (told.verdict, told.cause, told.identification) == ("undecided", "unknown", None)
    assert "OP and PV columns look swapped" in told.reason
    assert "--column" in told.action


def test_a_proportional_controller_holds_both_ways():
    record = run(st.PID(0.4, np.inf))
    assert not seen(record)
    assert not seen(swapped(record))


@pytest.mark.parametrize("every", [1, 3])
def test_a_process_that_only_integrates_is_no_controller(every):
    """Without noise PV moves by OP of the sample before, exactly: a law with an integral time of minus one sample."""
    rng = np.random.default_rng(3)
    op = 50.0 + np.cumsum(rng.normal(size=1500))
    pv = 70.0 + 0.02 * np.concatenate([[0.0], np.cumsum(op - 50.0)[:-1]])
    record = st.LoopRecord("LC1", float(every), op=op[::every], pv=pv[::every], loop_type="level")
    assert not seen(record)


def test_a_record_slower_than_its_controller_is_left_alone_either_way():
    record = run(st.PID(0.4, 8.0))
    means = {name: getattr(record, name).reshape(-1, 10).mean(axis=1) for name in ("op", "pv", "sp")}
    slower = replace(record, dt=10.0, **means)
    assert not seen(slower)
    assert not seen(swapped(slower))


@pytest.mark.slow
def test_no_loop_named_rightly_is_called_swapped():
    loops = list(population(20 * len(CAUSES), seed=501))
    said = [seen(case.record) for case in loops]
    assert not any(said)
    hits = [seen(swapped(case.record)) for case in loops]
    assert np.mean(hits) > 0.15

"""A master whose OP is the set point of its slave: told in one file, by any scale and rounding, not by likeness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.records import LoopRecord
from stiction.records.cascade import with_slaves

N = 600


@pytest.fixture(scope="module")
def loops():
    """A slow master, whose OP moves over less than 5 %, and what could be its slave."""
    loop = st.Loop(st.PID(0.5, 60.0), st.Stenman(0.0), st.FOPDT(1.0, 60.0, 5.0), dt=1.0, noise=0.02)
    load = np.convolve(np.random.default_rng(2).normal(0.0, 3.0, N), np.ones(30) / 5.0, mode="same")
    run = st.simulate(loop, 50.0, float(N), disturbance=load, seed=1, op_start=50.0, pv_start=50.0, tag="TIC-1")
    master = replace(run, op=np.round(run.op, 3), mv=None)
    return master, LoopRecord("FIC-2", 1.0, op=np.cos(np.arange(N) / 9.0), pv=master.op, sp=master.op)


def slaves(*records):
    return [record.provenance.secondary_tag for record in with_slaves(list(records))]


@pytest.mark.parametrize("scale", [lambda op: op, lambda op: np.round(4.0 + 0.16 * op, 2), lambda op: 250.0 - 2.5 * op])
def test_an_op_that_is_a_set_point_is_told_by_any_scale(loops, scale):
    master, slave = loops
    assert slaves(master, replace(slave, sp=scale(master.op))) == ["FIC-2", ""]


def test_what_is_alike_by_chance_or_not_recorded_together_is_no_cascade(loops):
    master, slave = loops
    near = master.op + np.random.default_rng(1).normal(0.0, 0.05, N)
    assert slaves(master, replace(slave, sp=near)) == ["", ""]
    assert slaves(master, replace(slave, sp=np.full(N, 50.0))) == ["", ""]
    assert slaves(master, replace(slave, sp=None)) == ["", ""]
    assert slaves(master, replace(slave, sp=np.round(master.op / np.ptp(master.op) * 8.0))) == ["", ""]
    assert slaves(master, slave.window(0, N - 1)) == ["", ""]
    two = np.where(np.arange(N) < 300, 40.0, 60.0)
    assert slaves(replace(master, op=two), replace(slave, sp=2.0 * two)) == ["", ""]
    assert slaves(replace(master, sp=master.op)) == [""]


def test_a_file_with_a_cascade_is_read_as_one(loops, table, read_text):
    master, slave = loops
    header = "Time,TIC-1.PV,TIC-1.OP,FIC-2.PV,FIC-2.SP,FIC-2.OP"
    read = read_text(table(header, master.time, master.pv, master.op, slave.pv, slave.sp, slave.op))
    assert [(record.tag, record.provenance.secondary_tag) for record in read] == [("TIC-1", "FIC-2"), ("FIC-2", "")]


def test_a_master_is_told_whose_the_valve_is_and_of_no_band(loops):
    master, slave = loops
    alone, beside = st.diagnose(master), st.diagnose(with_slaves([master, slave])[0])
    assert "A band wider than OP's swing" in alone.action
    assert "A band" not in beside.action
    assert "OP is the set point of FIC-2; the valve is that loop's." in beside.reason
    assert (alone.verdict, alone.probability, alone.cause) == (beside.verdict, beside.probability, beside.cause)


@pytest.mark.parametrize(("unknown", "slave_of"), [(60, "FIC-2"), (61, "")])
def test_nine_in_ten_samples_must_be_known_of_both(loops, unknown, slave_of):
    master, slave = loops
    sp = np.where(np.arange(N) < unknown, np.nan, master.op)
    assert slaves(master, replace(slave, sp=sp)) == [slave_of, ""]

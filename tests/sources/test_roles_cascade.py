"""A master whose OP is the set point of another loop: found at any scale and rounding, not by likeness alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.records import LoopRecord
from stiction.sources.roles.cascade import find_secondary_tags

N = 600


@pytest.fixture(scope="module")
def loops():
    """A slow master, whose OP moves over less than 5 %, and what could be its secondary loop."""
    loop = st.Loop(st.PID(0.5, 60.0), st.Stenman(0.0), st.FOPDT(1.0, 60.0, 5.0), dt=1.0, noise=0.02)
    load = np.convolve(np.random.default_rng(2).normal(0.0, 3.0, N), np.ones(30) / 5.0, mode="same")
    run = st.simulate(loop, 50.0, float(N), disturbance=load, seed=1, op_start=50.0, pv_start=50.0, tag="TIC-1")
    master = replace(run, op=np.round(run.op, 3), mv=None)
    return master, LoopRecord("FIC-2", 1.0, op=np.cos(np.arange(N) / 9.0), pv=master.op, sp=master.op)


def secondary_tags(*records):
    return find_secondary_tags(list(records))


@pytest.mark.parametrize("scale", [lambda op: op, lambda op: np.round(4.0 + 0.16 * op, 2), lambda op: 250.0 - 2.5 * op])
def test_an_op_that_is_a_set_point_is_found_at_any_scale(loops, scale):
    master, slave = loops
    assert secondary_tags(master, replace(slave, sp=scale(master.op))) == ["FIC-2", ""]


def test_what_is_alike_by_chance_or_not_recorded_together_is_no_cascade(loops):
    master, slave = loops
    near = master.op + np.random.default_rng(1).normal(0.0, 0.05, N)
    assert secondary_tags(master, replace(slave, sp=near)) == ["", ""]
    assert secondary_tags(master, replace(slave, sp=np.full(N, 50.0))) == ["", ""]
    assert secondary_tags(master, replace(slave, sp=None)) == ["", ""]
    assert secondary_tags(master, replace(slave, sp=np.round(master.op / np.ptp(master.op) * 8.0))) == ["", ""]
    assert secondary_tags(master, slave.window(0, N - 1)) == ["", ""]
    two = np.where(np.arange(N) < 300, 40.0, 60.0)
    assert secondary_tags(replace(master, op=two), replace(slave, sp=2.0 * two)) == ["", ""]
    assert secondary_tags(replace(master, sp=master.op)) == [""]


@pytest.mark.parametrize(("unknown", "expected"), [(60, "FIC-2"), (61, "")])
def test_nine_in_ten_samples_must_be_known_of_both(loops, unknown, expected):
    master, slave = loops
    sp = np.where(np.arange(N) < unknown, np.nan, master.op)
    assert secondary_tags(master, replace(slave, sp=sp)) == [expected, ""]

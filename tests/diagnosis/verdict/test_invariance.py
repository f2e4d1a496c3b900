"""A record says the same in whatever order of columns and in whatever units it was written."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from stiction.simulation.historian import exception_reported, quantised, sampled

N = 480
OP = {"%": (1.0, 0.0), "0-1": (0.01, 0.0), "fraction": (0.01, 0.0), "mA": (0.16, 4.0)}
"""Unit of OP in the header -> factor and offset from % of span."""
TIME = {"s": 1.0, "ms": 1e3, "min": 1.0 / 60.0, "h": 1.0 / 3600.0}
"""Unit of time in the header -> its number in a second."""
SIGNALS = ("time", "op", "pv", "sp")


@cache
def loops():
    """Name -> record: a sticky valve, a load that swings, a loop that rings, and what a historian made of the first."""
    sticky = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=2.0, noise=0.1)
    good = st.Loop(st.PID(0.35, 6.0), st.Ideal(), st.FOPDT(1.5, 4.0, 2.0), dt=2.0, noise=0.1)
    tight = st.Loop(st.PID(1.05, 6.0), st.Ideal(), st.FOPDT(1.5, 8.0, 4.0), dt=2.0, noise=0.1)
    swing = 3.0 * np.sin(2.0 * np.pi * np.arange(N) / 30.0)
    white = np.random.default_rng(4).normal(size=N)
    out = {
        "sticky": _run(sticky, np.full(N, 6.0)),
        "disturbed": _run(good, swing),
        "tight": _run(tight, white),
    }
    out["coarse"] = quantised(out["sticky"], op=0.4, pv=0.5)
    out["slow"] = sampled(out["sticky"], 6.0)
    out["by exception"] = exception_reported(out["sticky"], 0.2)
    return out


def _run(loop, load):
    run = st.simulate(loop, 70.0, N * loop.dt, load, seed=1, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow")
    return replace(run, mv=None)


@cache
def told(name):
    return st.diagnose(loops()[name])


def written(record, order, op, time, pv):
    """The record as a CSV export: columns in `order`, OP and time in the units named, PV and SP times and plus `pv`."""
    factor, offset = OP[op]
    columns = {
        "time": (f"Time [{time}]", record.time * TIME[time]),
        "op": (f"OP [{op}]", factor * record.op + offset),
        "pv": ("PV", pv[0] * record.pv + pv[1]),
        "sp": ("SP", pv[0] * record.sp + pv[1]),
    }
    lines = [",".join(columns[signal][0] for signal in order)]
    lines += [",".join(repr(float(columns[signal][1][k])) for signal in order) for k in range(len(record))]
    return "\n".join(lines) + "\n"


def same(found, truth):
    """Verdict, cause, probability, S and J in % of span: all that an engineer acts on."""
    assert (found.verdict, found.cause) == (truth.verdict, truth.cause)
    assert found.probability == pytest.approx(truth.probability, abs=1e-6)
    assert found.probability_before_doubts == pytest.approx(truth.probability_before_doubts, abs=1e-6)
    assert [(g.name, g.severity) for g in found.quality.checks] == [(g.name, g.severity) for g in truth.quality.checks]
    if truth.identification is None:
        assert found.identification is None
        return
    assert pytest.approx(truth.identification.S, rel=1e-6) == found.identification.S
    assert pytest.approx(truth.identification.J, rel=1e-6, abs=1e-9) == found.identification.J


def test_the_loops_differ():
    # Else what follows would compare one verdict with itself.
    assert {told(name).verdict for name in ("sticky", "disturbed")} == {"stiction", "no_stiction"}
    assert len({told(name).probability_before_doubts for name in loops()}) == len(loops())


@settings(max_examples=12)
@given(
    name=some.sampled_from(["sticky", "disturbed", "tight", "coarse", "slow", "by exception"]),
    order=some.permutations(SIGNALS),
    op=some.sampled_from(list(OP)),
    time=some.sampled_from(list(TIME)),
    exponent=some.floats(-4.0, 4.0),
    flipped=some.booleans(),
    offset=some.floats(-300.0, 300.0),
)
def test_columns_and_units_of_a_file_do_not_matter(name, order, op, time, exponent, flipped, offset):
    scale = (-1.0 if flipped else 1.0) * 10.0**exponent
    text = written(loops()[name], order, op, time, (scale, scale * offset))
    (record,) = st.read(io.BytesIO(text.encode()), loop_type="flow")
    assert record.dt == pytest.approx(loops()[name].dt)
    same(st.diagnose(record), told(name))


@pytest.mark.parametrize("op", ["0-1", "mA"])
def test_a_range_given_by_hand_is_as_good_as_a_unit_in_the_header(op):
    text = written(loops()["sticky"], SIGNALS, op, "s", (1.0, 0.0)).replace(f"OP [{op}]", "OP")
    (record,) = st.read(io.BytesIO(text.encode()), loop_type="flow", op_range={"0-1": (0, 1), "mA": (4, 20)}[op])
    same(st.diagnose(record), told("sticky"))


@settings(max_examples=8)
@given(
    name=some.sampled_from(["sticky", "disturbed", "tight", "coarse"]),
    slower=some.floats(-4.0, 4.0).map(lambda x: 10.0**x),
)
def test_time_has_no_unit_of_its_own(name, slower):
    found, truth = st.diagnose(replace(loops()[name], dt=slower * loops()[name].dt)), told(name)
    same(found, truth)
    assert found.oscillation.period == pytest.approx(slower * truth.oscillation.period, rel=1e-6, nan_ok=True)


@pytest.mark.parametrize("name", ["sticky", "coarse"])
def test_a_measurement_at_a_limit_is_judged_alike_in_every_unit(name):
    # Three levels of PV are the fewest that are not refused: rounding of the unit must not decide.
    record = loops()[name]
    step = float(np.subtract(*np.percentile(record.pv, (99, 1)))) / 2.0
    low = float(np.percentile(record.pv, 1))
    coarse = replace(record, pv=low + step * np.round((record.pv - low) / step))
    severities = set()
    for scale, offset in ((1.0, 0.0), (-0.37, 300.0), (1e-3, 7.0), (1.8, 32.0), (-31.7, 0.1)):
        other = replace(coarse, pv=scale * coarse.pv + offset, sp=scale * coarse.sp + offset)
        gates = st.records.assess_quality(other).checks
        severities.add(next(gate.severity for gate in gates if gate.name == "pv resolution"))
    assert len(severities) == 1

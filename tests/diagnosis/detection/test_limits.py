"""The limits by which methods vote, the conditions they share, the rates they average to, against published values."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from itertools import product
from math import inf, sqrt

import numpy as np
import pytest

from stiction import FOPDT, PID, Kano, Loop, simulate
from stiction.diagnosis.detection import FACTS
from stiction.diagnosis.detection.evidence import action, blocks, coarse, objections, swing
from stiction.diagnosis.detection.yamashita import still_shares
from stiction.diagnosis.oscillation import find_oscillation
from stiction.records.record import LoopRecord

PERIOD, N = 50.0, 1500
CHANCE = 0.1257
"""Share of windows in which one of two independent Gaussian slopes is five times the other: 2 arctan(1/5) / pi."""
WINDOWS = N // 6
"""Windows of six samples that `damarla_regression` has of `fast`, whose 50 samples to a period it does not average."""
LIMITS = {
    "he_curve_fit": (0.6, 0.4),
    "haegglund_shape": (0.0, 0.0),
    "yamashita": (0.25, 0.25),
    "rossi_scali": (0.21, -0.21),
    "kano_patterns": (0.5, 0.41),
    "damarla_regression": (CHANCE + 3.0 * sqrt(CHANCE * (1.0 - CHANCE) / WINDOWS), CHANCE),
    "horch_histogram": (0.55, 0.45),
    "nonlinearity": (1.0, -inf),
}
"""Index from which a method speaks for stiction, and to which against it, as its source or its page derives it."""


def fast() -> LoopRecord:
    """A sticky valve in a fast loop: OP a triangle, PV a square."""
    rng = np.random.default_rng(0)
    phase = (np.arange(N) / PERIOD) % 1.0
    op = 50.0 + 2.0 * (4.0 * np.abs(phase - 0.5) - 1.0) + 0.02 * rng.standard_normal(N)
    pv = 100.0 + 3.0 * np.where(phase < 0.5, 1.0, -1.0) + 0.05 * rng.standard_normal(N)
    return LoopRecord("FC1", 1.0, op=op, pv=pv, loop_type="flow")


def limits_of(method: str, record: LoopRecord, monkeypatch) -> tuple[float, float]:
    """The two limits that a method hands on to its judge."""
    page, seen = import_module(f"stiction.diagnosis.detection.{method}"), []
    judge = page.judge

    def watched(name, index, stiction, no_stiction, *rest, **known):
        seen.append((stiction, no_stiction))
        return judge(name, index, stiction, no_stiction, *rest, **known)

    monkeypatch.setattr(page, "judge", watched)
    getattr(page, method)(record, find_oscillation(record))
    return seen[0]


@pytest.mark.parametrize("method", LIMITS)
def test_a_method_votes_by_its_limits(method, monkeypatch):
    assert limits_of(method, fast(), monkeypatch) == pytest.approx(LIMITS[method], abs=2e-3)


def test_limits_of_all_methods_are_known():
    assert set(FACTS) == set(LIMITS) | {"horch_correlation", "singhal_salsbury"}


@pytest.mark.parametrize(("degrees", "vote"), [(0, "no_stiction"), (45, "undecided"), (85, "stiction")])
def test_horch_takes_even_odd_and_what_is_between(degrees, vote):
    at = 2.0 * np.pi * np.arange(N) / PERIOD
    record = LoopRecord("F", 1.0, op=np.sin(at), pv=-np.sin(at + np.radians(degrees)), loop_type="flow")
    found = replace(find_oscillation(record), period=PERIOD)
    assert import_module("stiction.diagnosis.detection.horch_correlation").horch_correlation(record, found).vote == vote


@pytest.mark.parametrize(
    ("offsets", "vote"), [((0.02, 0.2), "no_stiction"), ((0.02, 0.5), "undecided"), ((0.5, 0.9), "stiction")]
)
def test_horch_clears_a_valve_only_where_both_offsets_are_small(offsets, vote, monkeypatch):
    """d_rho of 0.02 is an angle of 16 degrees and d_tau of 0.2 one of 18; d_tau of 0.5 is 45."""
    page = import_module("stiction.diagnosis.detection.horch_correlation")
    monkeypatch.setattr(page, "correlation_offsets", lambda _: offsets)
    record = fast()
    assert page.horch_correlation(record, find_oscillation(record)).vote == vote


@pytest.mark.parametrize(("windows", "valid"), [(29, False), (30, True)])
def test_damarla_needs_thirty_windows(windows, valid):
    record = fast().window(0, 6 * windows + 5)
    row = FACTS["damarla_regression"].function(record, replace(find_oscillation(record), period=PERIOD))
    assert row.valid is valid
    assert (f"it has {windows} windows" in row.why) is not valid


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_singhals_delta_is_two_standard_errors_of_the_median(noise, monkeypatch):
    rng = np.random.default_rng(1)
    pv = np.sin(2.0 * np.pi * np.arange(N) / PERIOD) + noise * rng.standard_normal(N)
    record = LoopRecord("F", 1.0, op=np.roll(pv, 5), pv=pv, loop_type="flow")
    stiction, no_stiction = limits_of("singhal_salsbury", record, monkeypatch)
    assert stiction - 1.0 == pytest.approx(2.0 * (no_stiction - 1.0))
    page = import_module("stiction.diagnosis.detection.singhal_salsbury")
    error, cuts = page.half_periods(record, find_oscillation(record), "error")
    R = page.area_ratios(error, cuts)
    # Efficiency of a median 2 / pi, of Gaussian values whose deviation is 1.4826 of their median absolute one.
    error = sqrt(np.pi / 2.0) * 1.4826 * np.median(np.abs(np.log(R) - np.median(np.log(R)))) / sqrt(R.size)
    assert stiction - 1.0 == pytest.approx(max(0.05, np.expm1(2.0 * error)), rel=2e-3)


@pytest.mark.parametrize("dt", [1.0, 2.5])
@pytest.mark.parametrize(("samples", "width"), [(20.0, 1), (39.9, 1), (40.0, 2), (59.9, 2), (60.0, 3), (400.0, 20)])
def test_blocks_to_a_period_are_as_many_as_asked_for_or_up_to_twice_that(samples, width, dt):
    x = np.arange(120.0)
    record = LoopRecord("X", dt, op=x, pv=x)
    found = replace(find_oscillation(record), period=samples * dt)
    made = coarse(record, found, x, 20)
    np.testing.assert_allclose(made, x[: 120 // width * width].reshape(-1, width).mean(axis=1))
    np.testing.assert_array_equal(made, blocks(x, width))


@pytest.mark.parametrize("period", [19.4, 19.6, 19.8, 20.0, 29.8, 30.0])
def test_nonlinearity_takes_any_period(period):
    nonlinearity = import_module("stiction.diagnosis.detection.nonlinearity").nonlinearity
    wave = np.where((np.arange(4000) / period) % 1.0 < 0.5, 1.0, -1.0)
    pv = wave + 0.2 * np.random.default_rng(0).standard_normal(4000)
    record = LoopRecord("T", 1.0, op=wave, pv=pv)
    assert nonlinearity(record, replace(find_oscillation(record), period=period)).valid


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("Kc", "Ti", "Td"), [(1.2, 4.0, 1.0), (1.4, 6.0, 1.5)])
def test_a_derivative_part_does_not_turn_the_loop_round(Kc, Ti, Td, way):
    rng = np.random.default_rng(1)
    loop = Loop(PID(Kc * way, Ti, Td, 10.0), Kano(3.0, 1.0), FOPDT(way, 4.0, 2.0), dt=1.0, noise=0.05)
    load = np.cumsum(0.05 * rng.standard_normal(1500))
    record = replace(simulate(loop, 50.0 * way, 1500.0, load, seed=1, pv_start=50.0 * way, op_start=50.0), mv=None)
    found = find_oscillation(record)
    op, error = swing(record, found, "op"), swing(record, found, "error")
    assert op is not None
    assert error is not None
    assert action(op, error) == way


@pytest.mark.parametrize(("period", "against"), [(8.0, 0), (7.9, 1), (30.0, 0), (31.0, 1)])
def test_four_periods_of_eight_samples_are_needed(period, against):
    record = LoopRecord("X", 1.0, op=np.zeros(120), pv=np.zeros(120))
    found = replace(find_oscillation(record), period=period, cycles=120.0 / period, oscillating=True)
    assert len(objections(record, found)) == against


IMPOSSIBLE = {"DD", "DI", "SD", "ID", "DS"}
"""Pairs, OP first, that cannot follow I S where the valve slips the way OP went; after D S their mirror images."""
SYMBOLS = {"I": 1, "S": 0, "D": -1}


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("pair", [op + moved for op, moved in product("ISD", repeat=2) if op + moved != "SS"])
def test_yamashita_leaves_out_what_a_slip_cannot_make(pair, way):
    op, moved = (way * SYMBOLS[symbol] for symbol in pair)
    rho_1, rho_3 = still_shares(np.array([way, op]), np.array([0, moved]))
    assert (rho_3 < rho_1) == (pair in IMPOSSIBLE)

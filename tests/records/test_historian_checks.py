"""Historian effects on simulated loops: found under their own name, and good loops left in peace."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from calibration.historian import (
    add_gaps,
    average_intervals,
    clip_op,
    compress_by_swinging_door,
    drop_samples,
    freeze_signals,
    interpolate_samples,
    quantise_signals,
    replay_segment,
    report_by_exception,
    sample_slower,
)
from stiction.diagnosis.oscillation import find_oscillation
from stiction.models import FOPDT, PID, Ideal, Integrating, Kano, Loop
from stiction.records import LoopRecord, assess_quality
from stiction.records.conditioned import condition
from stiction.records.quality.moving_average import detect_averaging_window
from stiction.simulation import simulate


def _loop(valve, process, controller, seed, noise, n=1600, load=0.0):
    kick = np.zeros(n + 300)
    kick[: n // 80] = 4.0
    k = np.arange(n + 300)
    kick += load * np.sin(2 * np.pi * k / 47.0)
    record = simulate(
        Loop(controller, valve, process, dt=1.0, noise=noise),
        50.0,
        float(n + 300),
        kick,
        seed,
        pv_start=50.0,
        op_start=50.0,
        loop_type="flow",
    ).window(300, n + 300)
    return replace(record, mv=None)


@pytest.fixture(scope="module")
def noisy():
    """Sixteen loops that swing with a little noise, half of them for a sticky valve."""
    out = []
    for seed in range(8):
        tau, delay = 5.0 + 2 * seed, 2.0 + seed
        pi = PID(tau / (2 * delay + 1.0), 0.7 * tau)
        out.append(_loop(Kano(6.0 - 0.3 * seed, 3.0), FOPDT(1.0, tau, delay), pi, seed, 0.05))
        out.append(_loop(Ideal(), FOPDT(1.0, tau, delay), pi, seed, 0.05, load=4.0))
    assert all(find_oscillation(record).oscillating for record in out)
    return out


@pytest.fixture(scope="module")
def silent():
    """Loops without any noise, whose signals are straight, flat and periodic by themselves."""
    pi = PID(2.6, 20.0)
    loops = {
        "integral time equals lag": _loop(Kano(5.0, 2.0), FOPDT(1.0, 20.0, 5.0), pi, 0, 0.0),
        "slow": _loop(Kano(5.0, 2.0), FOPDT(1.0, 400.0, 100.0), PID(2.6, 400.0), 0, 0.0, 12000),
        "fast": _loop(Kano(5.0, 4.0), FOPDT(1.0, 0.5, 1.0), PID(0.3, 1.0), 0, 0.0),
        "level": _loop(Kano(5.0, 0.0), Integrating(0.02, 3.0), PID(2.0, 60.0), 0, 0.0),
        "level, proportional": _loop(Kano(5.0, 2.0), Integrating(0.02, 3.0), PID(12.0, 1e9), 0, 0.0),
        "load": _loop(Ideal(), FOPDT(1.0, 20.0, 5.0), PID(1.0, 20.0), 0, 0.0, load=5.0),
    }
    assert all(np.ptp(record.op[-400:]) > 1.0 for record in loops.values())  # none has come to rest
    return loops


def judged(record):
    found = find_oscillation(condition(record).part)
    return assess_quality(record, found.period if found.oscillating else None)


def test_good_loops_with_noise_are_not_even_lowered(noisy):
    assert [judged(record).warnings for record in noisy] == [()] * len(noisy)
    assert all(judged(record).usable for record in noisy)


@pytest.mark.parametrize("decimals", [None, 3, 2])
def test_loops_without_noise_are_never_refused_for_their_history(silent, decimals):
    for name, record in silent.items():
        if decimals is not None:
            record = replace(record, op=np.round(record.op, decimals), pv=np.round(record.pv, decimals))
        at_fault = {g.name for g in judged(record).checks if g.severity != "ok"}
        assert not at_fault & {
            "compression",
            "exception reporting",
            "moving average",
            "copied data",
            "frozen pv",
            "manual",
        }, name


DESTROYED = {
    "sampling": (lambda r, p: sample_slower(r, float(round(p / 2.3))), {"sampling", "length"}),
    "averaging": (lambda r, p: average_intervals(r, float(round(p / 2.5))), {"sampling", "length"}),
    "interpolation": (lambda r, p: interpolate_samples(r, p / 4.0), {"compression"}),
    "exception": (lambda r, _: report_by_exception(r, 1.0), {"exception reporting"}),
    "exception 2": (lambda r, _: report_by_exception(r, 2.0), {"exception reporting", "held values", "op movement"}),
    "swinging door": (lambda r, _: compress_by_swinging_door(r, 1.0), {"compression"}),
    "swinging door 2": (lambda r, _: compress_by_swinging_door(r, 2.0), {"compression"}),
    "saturation": (lambda r, _: clip_op(r, 0.3), {"saturation"}),
}


@pytest.mark.parametrize("effect", DESTROYED)
def test_what_destroys_the_record_is_refused_for_that_reason(noisy, effect):
    spoil, reasons = DESTROYED[effect]
    right = [
        bool(reasons & {g.name for g in judged(spoil(record, find_oscillation(record).period)).rejections})
        for record in noisy
    ]
    assert np.mean(right) >= 0.9


LOWERED = {
    "exception": (lambda r, _: report_by_exception(r, 0.2), "exception reporting"),
    "swinging door": (lambda r, _: compress_by_swinging_door(r, 0.15), "compression"),
    "sampled": (lambda r, _: sample_slower(r, 15.0), "sampling"),
    "gaps": (lambda r, seed: add_gaps(r, 0.3, seed), "missing values"),
    "frozen": (lambda r, seed: freeze_signals(r, 0.2, seed), "frozen pv"),
    "replayed": (lambda r, seed: replay_segment(r, 0.1, seed), "copied data"),
    "saturated": (lambda r, _: clip_op(r, 0.4), "saturation"),
}


@pytest.mark.parametrize("effect", LOWERED)
def test_milder_effects_are_named(noisy, effect):
    spoil, name = LOWERED[effect]
    named = [
        name in {g.name for g in judged(spoil(record, seed)).checks if g.severity != "ok"}
        for seed, record in enumerate(noisy)
    ]
    assert np.mean(named) >= 0.9


def sticking_transmitter(seed, n=1600):
    """A loop that random loads move; its transmitter has a dead band, and the controller sees what it reports."""
    rng, pi, process = np.random.default_rng(seed), (0.6, 8.0), np.exp(-1.0 / 10.0)
    load = np.convolve(rng.normal(size=n + 40), np.ones(40), "valid")[:n]
    op, pv = np.zeros((2, n))
    true = seen = integral = 0.0
    for k in range(n):
        true = process * true + (1.0 - process) * ((op[k - 3] if k > 2 else 0.0) + load[k])
        measured = true + 0.02 * rng.normal()
        seen = measured if abs(measured - seen) > 2.0 else seen
        integral -= pi[0] / pi[1] * seen
        op[k], pv[k] = integral - pi[0] * seen, seen
    return LoopRecord("FIC-2", 1.0, op=50.0 + op, pv=50.0 + pv, loop_type="flow")


@pytest.mark.parametrize("seed", range(4))
def test_a_sticking_transmitter_is_no_exception_storage_though_samples_are_lost_or_op_is_clipped(seed):
    record = sticking_transmitter(seed)
    for other in (record, drop_samples(record, 0.15, seed), clip_op(record, 0.2)):
        assert next(g for g in judged(other).checks if g.name == "exception reporting").severity == "ok"
    stored = report_by_exception(record, 1.0)  # of both: this is storage
    assert next(g for g in judged(stored).checks if g.name == "exception reporting").severity != "ok"


def test_rounding_is_called_by_its_name(noisy):
    for record in noisy:
        coarse = {g.name: g.severity for g in judged(quantise_signals(record, op=3.0, pv=2.0)).checks}
        assert coarse["exception reporting"] == "ok"
        assert coarse["held values"] != "reject"
        assert coarse["pv resolution"] != "ok"


@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_op_at_its_own_limit_is_seen_in_short_cycles_and_though_samples_are_lost(noisy, lost):
    for seed, record in enumerate(noisy):
        fast = sample_slower(record, max(find_oscillation(record).period / 15.0, 1.0))
        checks = {g.name: g for g in judged(drop_samples(clip_op(fast, 0.35), lost, seed)).checks}
        assert checks["saturation"].value > 15.0


@pytest.mark.parametrize("share", [0.03, 0.06, 0.15])
def test_clipped_op_is_found_with_held_values(noisy, share):
    for seed, record in enumerate(noisy):
        fast = sample_slower(record, max(find_oscillation(record).period / 15.0, 1.0))
        checks = {g.name: g for g in judged(clip_op(freeze_signals(fast, share, seed), 0.35)).checks}
        assert checks["saturation"].value > 15.0
        unclipped = {g.name: g for g in judged(freeze_signals(fast, share, seed)).checks}
        assert unclipped["saturation"].value < 5.0


@pytest.mark.parametrize("every", [2, 3, 4])
def test_lines_between_few_samples_are_seen_where_both_signals_lie_on_them(noisy, every):
    for record in noisy:
        check = next(g for g in judged(interpolate_samples(record, float(every))).checks if g.name == "compression")
        assert check.severity != "ok"
        assert check.severity == "reject" or check.value == pytest.approx(100.0 * (1.0 - 1.0 / every), abs=2.0)


def severities(record, period):
    return {g.name: g.severity for g in assess_quality(record, period).checks if g.name != "op scale"}


SPOILED = (
    lambda r: r,
    lambda r: report_by_exception(r, 0.4),
    lambda r: compress_by_swinging_door(r, 0.4),
    lambda r: interpolate_samples(r, 7.0),
    lambda r: clip_op(r, 0.2),
    lambda r: freeze_signals(r, 0.2, 3),
    lambda r: replay_segment(r, 0.2, 3),
    lambda r: replace(r, op=np.clip(8.0 * (r.op - 50.0) + 50.0, 0.0, 100.0)),
    lambda r: replace(r, pv=np.round(r.pv, 1), op=np.round(r.op, 1)),
)


@settings(deadline=None, max_examples=60)
@given(
    which=some.integers(0, 15),
    spoil=some.sampled_from(SPOILED),
    op=some.sampled_from([(1.0, 0.0), (0.01, 0.0), (0.16, 4.0)]),
    gain=some.floats(1e-4, 1e4),
    shift=some.floats(-100.0, 100.0),
    second=some.floats(1e-3, 1e3),
)
def test_no_check_depends_on_units(noisy, which, spoil, op, gain, shift, second):
    record = spoil(noisy[which])
    other = replace(record, dt=second * record.dt, op=op[0] * record.op + op[1], pv=gain * (record.pv + shift), sp=None)
    assert severities(other, 50.0 * second) == severities(replace(record, sp=None), 50.0)


def test_the_order_of_columns_and_the_unit_of_time_do_not_matter(noisy, table, read_text):
    record = noisy[0]
    t = record.time
    [a] = read_text(table("time_s,PV,OP", t, record.pv, record.op))
    [b] = read_text(table("OP,PV,time_ms", record.op, record.pv, 1e3 * t))
    assert a.dt == b.dt
    assert assess_quality(a, 50.0) == assess_quality(b, 50.0)


def test_checks_are_fast():
    # The aim is 2 ms and 20 ms; the limits allow for a busy machine.
    rng = np.random.default_rng(0)
    for n, limit in ((2000, 0.02), (30_000, 0.2)):
        wave = 2 * np.pi * np.arange(n) / 57.0
        record = LoopRecord(
            "FIC-1", 1.0, op=50 + np.sin(wave) + rng.normal(0, 0.1, n), pv=np.cos(wave) + rng.normal(0, 0.1, n)
        )
        taken = []
        for _ in range(5):
            start = time.process_time()
            assess_quality(record, 57.0)
            taken.append(time.process_time() - start)
        assert min(taken) < limit


@pytest.mark.parametrize("n", range(570, 582))
def test_the_longest_window_that_a_record_can_show(n):
    noise = np.random.default_rng(3).normal(size=(2, n + 70))
    assert detect_averaging_window(*(np.convolve(x, np.ones(71) / 71, "valid") for x in noise)) in (0, 71)


@pytest.mark.parametrize(("drawn", "severity"), [(100, "ok"), (101, "warn")])
def test_a_tenth_of_the_samples_may_lie_on_straight_lines(drawn, severity):
    """One line between two samples of noise, with so many of 1 000 samples strictly inside."""
    op, pv = np.random.default_rng(5).normal(size=(2, 1000))
    op[300 : 302 + drawn] = np.linspace(op[300], op[301 + drawn], drawn + 2)
    check = next(
        g for g in assess_quality(LoopRecord("FIC-1", 1.0, op=op, pv=pv), 100.0).checks if g.name == "compression"
    )
    assert (check.value, check.severity) == (pytest.approx(drawn / 10.0), severity)


@pytest.mark.parametrize(("repeated", "severity"), [(200, "ok"), (201, "warn")])
def test_a_fifth_of_the_samples_may_repeat_op_and_pv(repeated, severity):
    """Of 1 001 samples of noise so many are those before, two fresh ones at least between them."""
    signals = np.random.default_rng(6).normal(size=(2, 1001))
    for k in range(4, 4 + 4 * repeated, 4):
        signals[:, k] = signals[:, k - 1]
    check = next(g for g in assess_quality(LoopRecord("FIC-1", 1.0, *signals)).checks if g.name == "held values")
    assert (check.value, check.severity) == (pytest.approx(repeated / 10.0), severity)

"""Compensators: the signals they send, what they do to a loop, and that both are what their pages say."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from tests.reference.compensators import FOUR_MOVES, NOISY, SIGNALS, SP, TABLE, TWO_MOVES
from tests.strategies import dyadic, inputs

import stiction as st
from stiction.models import compensators as room
from stiction.models import dispatch
from stiction.models.compensators.compensator_properties import COMPENSATOR_PROPERTIES
from stiction.models.compensators.component import compensator_at_rest

CONTROLLER, PROCESS, GAIN = st.PID(0.2, 10.0), st.FOPDT(3.0, 10.0, 10.0), 3.0
CLASSES = {name: getattr(room, name) for name in COMPENSATOR_PROPERTIES}
SET_POINTS = np.linspace(1.0, 12.0, 12)


def run(valve, compensator, sp=SP, duration=4000.0, controller=CONTROLLER, noise=0.0, **options):
    loop = st.Loop(controller, valve, PROCESS, 1.0, noise=noise, compensator=compensator)
    return st.simulate(loop, sp, duration, **options)


def numbers(record, first=2000):
    """PV standard deviation, stem travel and reversals after the sample `first`."""
    moves = np.diff(record.mv[first:])
    turns = np.diff(np.sign(moves[moves != 0.0]))
    return np.std(record.pv[first:]), np.abs(moves).sum(), np.count_nonzero(turns)


def rms(record, first=2000):
    return math.sqrt(np.mean((record.pv[first:] - record.sp[first:]) ** 2))


def at_rest(record, last=2000):
    return np.ptp(record.mv[-last:]) == 0.0


def drive(compensator, op, sp, pv, start=None):
    """What is sent and asked for, by the compiled step: rows of valve signal, hold, track; `start` is the OP before."""
    state = compensator_at_rest(float(op[0] if start is None else start), float(sp[0]))
    p, rows = compensator.pack(1.0), []
    for values in zip(op, sp, pv, strict=True):
        state = dispatch.compensator_step(compensator.code, *map(float, values), state, p)
        rows.append((state.valve_signal, state.hold, state.track))
    return np.array(rows).T


@pytest.mark.parametrize("row", TABLE, ids=str)
def test_table(row):
    assert numbers(run(**row.given)) == pytest.approx(row.expected, rel=row.tolerance)


@pytest.mark.parametrize("row", NOISY, ids=str)
def test_table_with_noise(row):
    """Other seeds than the table's: their mean is compared."""
    seeds = [numbers(run(**row.given, noise=0.2, seed=seed))[1:] for seed in range(8)]
    assert np.mean(seeds, axis=0) == pytest.approx(row.expected, rel=row.tolerance)


@pytest.mark.parametrize(("S", "J"), [(5.0, 2.0), (3.0, 1.0)])
def test_pulses_too_high_are_worse_than_none(S, J):
    none, half, full = (numbers(run(st.Kano(S, J), c)) for c in (None, st.Knocker(S / 2, 2, 5), st.Knocker(S, 2, 5)))
    assert half[0] < 0.5 * none[0] < none[0] < full[0]
    assert none[1] < half[1] < full[1]


@pytest.mark.parametrize("row", SIGNALS, ids=str)
def test_signal_by_hand(row):
    sent = drive(row.given["compensator"], row.given["op"], row.given["error"], np.zeros(6))[0]
    assert tuple(sent) == row.expected


def test_times_are_rounded_to_whole_samples():
    near, whole = st.Knocker(1.0, 1.6, 4.6), st.Knocker(1.0, 2.0, 5.0)
    assert near.pack(1.0).tolist() == whole.pack(1.0).tolist() == [1.0, 2.0, 5.0]


@settings(max_examples=60)
@given(op=inputs(), amplitude=dyadic(0.0, 5.0), width=some.integers(1, 3), pause=some.integers(1, 4))
def test_knocker_is_its_equation(op, amplitude, width, pause):
    """Onsets counted from the start, not from state to state; before the first there is no pulse."""
    interval = width + pause
    onsets = [-1, *range(interval - 1, len(op), interval)]
    at = [op[0], *(op[k] for k in onsets[1:])]
    expected = list(map(float, op))
    for n, onset in enumerate(onsets[1:], 1):
        for k in range(onset, min(onset + width, len(op))):
            expected[k] = op[k] + amplitude * float(np.sign(op[k] - at[n - 1]))
    zero = np.zeros(len(op))
    assert drive(st.Knocker(amplitude, width, interval), op, zero, zero)[0].tolist() == expected
    assert expected[: interval - 1] == list(op[: interval - 1])


@settings(max_examples=60)
@given(op=inputs(), amplitude=dyadic(0.0, 5.0))
def test_constant_reinforcement_is_its_equation(op, amplitude):
    zero = np.zeros(len(op))
    expected = np.array(op) + amplitude * np.sign(np.diff(op, prepend=op[0]))
    assert np.array_equal(drive(st.ConstantReinforcement(amplitude), op, zero, zero)[0], expected)


PULSES = {
    "Knocker": st.Knocker(1.5, 2.0, 5.0),
    "ConstantReinforcement": st.ConstantReinforcement(1.5),
    "VariablePulses": st.VariablePulses(1.5, 2.0, 5.0, 4.0),
    "Cuadros": st.Cuadros(1.5, 2.0, 5.0, 1.0),
    "IntegralDeadband": st.IntegralDeadband(1.0),
}


@pytest.mark.parametrize("name", PULSES)
@settings(max_examples=25)
@given(op=inputs(), pv=inputs(), by=dyadic(-20.0, 20.0))
def test_shift_and_odd_symmetry(name, op, pv, by):
    n = min(len(op), len(pv))
    op, pv, sp = np.array(op[:n]), np.array(pv[:n]), np.zeros(n)
    sent, hold, track = drive(PULSES[name], op, sp, pv)
    shifted = drive(PULSES[name], op + by, sp + by, pv + by)
    assert np.array_equal(shifted, [sent + by, hold, track])
    assert np.array_equal(drive(PULSES[name], -op, sp, -pv), [-sent, hold, track])


@pytest.mark.parametrize("name", COMPENSATOR_PROPERTIES)
def test_what_the_row_says_is_what_the_steps_ask(name):
    facts = COMPENSATOR_PROPERTIES[name]
    compensator = CLASSES[name].for_stiction(5.0, 2.0, 1.0, gain=GAIN)
    record = run(st.Kano(5.0, 2.0), compensator, sp=10.0)
    sent, hold, track = drive(compensator, record.op, record.sp, record.pv, start=0.0)
    assert np.array_equal(sent, record.valve_signal)
    assert np.any(sent[track == 0.0] != record.op[track == 0.0]) == facts.pulses
    assert np.any(hold != 0.0) == facts.holds
    assert np.any(track != 0.0) == facts.tracks
    assert at_rest(record) == facts.rests
    assert np.array_equal(st.stroke(st.Kano(5.0, 2.0), np.r_[0.0, sent], 1.0).mv[1:], record.mv)


def digest():
    """Bits of every compensator in a loop with noise, a load, a change of set point and a stretch in manual."""
    total = hashlib.sha256()
    n = 900
    hand = np.full(n, np.nan)
    hand[700:720] = 3.0
    options = {"manual": hand, "disturbance": np.where(np.arange(n) < 800, 0.0, 1.0), "seed": 4}
    sp = np.where(np.arange(n) < 600, 10.0, 8.0)
    for name in COMPENSATOR_PROPERTIES:
        compensator = CLASSES[name].for_stiction(5.0, 2.0, 1.0, gain=GAIN)
        record = run(st.Kano(5.0, 2.0), compensator, sp, float(n), noise=0.05, **options)
        for series in (record.op, record.pv, record.mv, record.valve_signal):
            total.update(series.tobytes())
    return total.hexdigest()


def test_plain_python_gives_the_same_bits():
    code = "from tests.models.test_compensators import digest; print(digest())"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.strip() == digest()


def test_compensator_without_pulses_changes_no_bit():
    """The quick way of a bare loop and the general way of a compensated one."""
    bare = run(st.Kano(3.0, 1.0), None)
    idle = run(st.Kano(3.0, 1.0), st.Knocker(0.0, 2.0, 5.0))
    assert bare.valve_signal is None
    assert np.array_equal(idle.valve_signal, idle.op)
    for name in ("op", "pv", "mv"):
        assert np.array_equal(getattr(bare, name), getattr(idle, name))


@pytest.mark.parametrize(("S", "J"), [(3.0, 3.0), (5.0, 2.0), (3.0, 1.0)])
def test_integral_deadband_leaves_an_offset_and_no_cycle(S, J):
    made = st.IntegralDeadband.for_stiction(S, J, 1.0, gain=GAIN)
    for sp in SET_POINTS:
        record = run(st.Kano(S, J), made, sp, 8000.0)
        assert at_rest(record)
        assert abs(record.pv[-1] - sp) < made.band
        assert np.array_equal(record.valve_signal, record.op)
    offsets = [abs(run(st.Kano(S, J), made, sp).pv[-1] - sp) for sp in SET_POINTS]
    assert max(offsets) > 0.2 * made.band


def test_integral_deadband_too_narrow_cycles_on():
    record = run(st.Kano(3.0, 1.0), st.IntegralDeadband(0.3), 10.0)
    assert numbers(record)[0] > 0.9 * numbers(run(st.Kano(3.0, 1.0), None, 10.0))[0]


def test_integral_is_held_from_the_next_sample_on():
    record = run(st.Ideal(), st.IntegralDeadband(2.0), 5.0, 200.0)
    error = record.sp - record.pv
    inside = np.flatnonzero(np.abs(error[:-1]) < 2.0) + 1
    assert inside.size > 50
    np.testing.assert_allclose(np.diff(record.op)[inside - 1], 0.2 * np.diff(error)[inside - 1], atol=1e-12)


@pytest.mark.parametrize("row", TWO_MOVES, ids=lambda row: str(row.given))
def test_two_moves_do_what_the_page_says(row):
    S, J, factor = row.given["S"], row.given["J"], row.given["factor"]
    made = st.TwoMove.for_stiction(S * factor, J * factor, 1.0, gain=GAIN)
    records = [run(st.Kano(S, J), made, sp, 8000.0) for sp in SET_POINTS]
    bare = np.mean([rms(run(st.Kano(S, J), None, sp, 8000.0)) for sp in SET_POINTS])
    rest, ratio = row.expected
    assert sum(at_rest(record) for record in records) == rest
    assert np.mean([rms(record) for record in records]) / bare == pytest.approx(ratio, rel=row.tolerance)
    for record in records:
        if at_rest(record):
            assert abs(record.pv[-1] - record.sp[-1]) <= made.band
        else:
            assert rms(record, 6000) < 1.05 * bare
    line = next(line for line in (st.TwoMove.__doc__ or "").split("\n") if line.strip().startswith(f"{S:g}, {J:g} "))
    assert re.findall(r"\d+ of 12, [\d.]+", line)[[0.7, 1.0, 1.3].index(factor)] == f"{rest} of 12, {ratio}"


@pytest.mark.parametrize("row", FOUR_MOVES, ids=lambda row: str(row.given))
def test_four_moves_do_what_the_page_says(row):
    valve = st.Kano(**row.given)
    made = st.FourMove.for_stiction(**row.given, dt=1.0, gain=GAIN)
    records = [run(valve, made, sp, 8000.0) for sp in SET_POINTS]
    assert all(at_rest(record) for record in records)
    bare = [rms(run(valve, None, sp, 8000.0)) for sp in SET_POINTS]
    assert np.mean(np.array([rms(record) for record in records]) / bare) == pytest.approx(
        row.expected, rel=row.tolerance
    )


@settings(max_examples=30)
@given(S=dyadic(1.0, 6.0), share=some.floats(0.2, 1.0), sp=some.floats(1.0, 20.0))
def test_four_moves_leave_the_stem_near_the_middle(S, share, sp):
    """A quarter of the swing is the bound that the page derives; the last signal is the middle itself."""
    valve = st.Kano(S, share * S)
    record = run(valve, st.FourMove(band=GAIN * share * S / 4.0, tries=1), sp, 6000.0)
    moved = np.flatnonzero(record.valve_signal != record.op)
    if moved.size == 0:
        return
    opened = moved[0]
    up, down, third, middle = record.valve_signal[opened : opened + 4]
    swing = (up - down) / 2.0
    assert up - middle == pytest.approx(swing)
    assert third - middle == pytest.approx(swing / 4.0)
    assert S <= swing <= np.ptp(record.op[:opened]) + 1e-9
    assert abs(record.mv[opened + 3] - middle) <= swing / 4.0 + 1e-9


@pytest.mark.parametrize("name", ["TwoMove", "FourMove"])
def test_controller_takes_over_without_a_bump(name):
    """When the set point steps, at once; when a load comes, as soon as the error leaves the band."""
    made = CLASSES[name].for_stiction(5.0, 2.0, 1.0, gain=GAIN)
    n = 12_000
    sp, load = np.where(np.arange(n) < 3000, 10.0, 16.0), np.where(np.arange(n) < 7000, 0.0, 3.0)
    record = run(st.Kano(5.0, 2.0), made, sp, float(n), disturbance=load)
    bare = run(st.Kano(5.0, 2.0), None, sp, float(n), disturbance=load)
    track = drive(made, record.op, sp, record.pv, start=0.0)[2]
    assert track[2999] == track[6999] == track[-1] == 1.0
    assert track[3000] == 0.0
    left = np.flatnonzero(np.abs(sp - record.pv)[7000:] > made.band)[0] + 7000
    assert track[left - 1] == 1.0
    assert track[left] == 0.0
    for back in (3000, left):
        assert record.op[back] == record.valve_signal[back] == record.valve_signal[back - 1]
        assert abs(record.op[back + 1] - record.op[back]) < 0.2 * 1.1 * abs(np.ptp(sp[back - 1 : back + 1])) + 1.0
    for settled in (slice(2500, 3000), slice(6500, 7000), slice(11_500, n)):
        assert np.ptp(record.mv[settled]) == 0.0
        assert abs(record.pv[settled] - sp[settled]).max() <= made.band
    assert rms(record) < 0.6 * rms(bare)


def test_two_moves_stop_trying_and_leave_the_cycle_as_it_was():
    """S and J identified 30 % too small where J is a tenth of S: the moves end outside the band."""
    made = st.TwoMove(3.5, 0.35, 0.35, tries=2)
    record = run(st.Kano(5.0, 0.5), made, 10.0, 20_000.0)
    bare = run(st.Kano(5.0, 0.5), None, 10.0, 20_000.0)
    tracked = drive(made, record.op, record.sp, record.pv, start=0.0)[2]
    assert np.count_nonzero(np.diff(tracked) > 0.0) == 2
    assert not tracked[-10_000:].any()
    assert rms(record, 12_000) == pytest.approx(rms(bare, 12_000), rel=0.05)


def test_noise_does_not_end_the_rest():
    made = st.TwoMove.for_stiction(5.0, 2.0, 1.0, gain=GAIN, noise=0.3)
    records = [run(st.Kano(5.0, 2.0), made, 10.0, 8000.0, noise=0.3, seed=seed) for seed in range(5)]
    assert sum(at_rest(record) for record in records) >= 4


def test_the_signal_stays_within_the_limits_of_the_output():
    controller = dataclasses.replace(CONTROLLER, op_limits=(-1.0, 9.0))
    for name, made in CLASSES.items():
        record = run(st.Kano(5.0, 2.0), made.for_stiction(5.0, 2.0, 1.0, gain=GAIN), 24.0, 1000.0, controller)
        assert record.valve_signal is not None
        assert record.valve_signal.min() >= -1.0, name
        assert record.valve_signal.max() <= 9.0, name
    knocked = run(st.Kano(5.0, 2.0), st.Knocker(2.5, 2.0, 5.0), 24.0, 1000.0, controller)
    assert knocked.valve_signal.max() == 9.0


def test_in_manual_the_output_passes():
    hand = np.full(600, np.nan)
    hand[200:300] = np.linspace(3.0, 6.0, 100)
    record = run(st.Kano(3.0, 1.0), st.Knocker(1.5, 2.0, 5.0), 10.0, 600.0, manual=hand)
    assert np.array_equal(record.valve_signal[200:300], hand[200:300])
    assert np.array_equal(record.valve_signal[300:304], record.op[300:304])
    assert record.valve_signal[304] != record.op[304]


def test_record_carries_the_signal():
    record = run(st.Kano(3.0, 1.0), st.Knocker(1.5, 2.0, 5.0), 10.0, 50.0)
    assert np.array_equal(record.window(10, 20).valve_signal, record.valve_signal[10:20])
    with pytest.raises(st.RecordError, match="valve_signal has 3 samples but op has 2"):
        st.LoopRecord("A", 1.0, op=[1.0, 2.0], valve_signal=[1.0, 2.0, 3.0])


@pytest.mark.parametrize("name", COMPENSATOR_PROPERTIES)
def test_settings_scale_with_the_stiction(name):
    """Twice S, J and noise: twice what is in % of span and in PV units, the same times and numbers."""
    one, two = (CLASSES[name].for_stiction(3.0 * k, 1.0 * k, 2.0, gain=-GAIN, noise=0.1 * k) for k in (1.0, 2.0))
    for key, unit in COMPENSATOR_PROPERTIES[name].parameters.items():
        factor = 2.0 if unit in ("% of span", "PV units") else 1.0
        if getattr(one, key) is not None:
            assert getattr(two, key) == pytest.approx(factor * getattr(one, key))
    data = json.loads(json.dumps(one.to_dict()))
    assert data.pop("compensator") == name
    assert CLASSES[name](**data) == one


@pytest.mark.parametrize("name", COMPENSATOR_PROPERTIES)
@given(data=some.data(), wrong=some.sampled_from([math.nan, math.inf, -1.0, "wide", [1.0, 2.0]]))
def test_bad_settings_get_a_sentence(name, data, wrong):
    good = CLASSES[name].for_stiction(3.0, 1.0, 1.0)
    key = data.draw(some.sampled_from(sorted(COMPENSATOR_PROPERTIES[name].parameters)))
    with pytest.raises(st.ParameterError, match=rf"\b{key}\b.*\.$"):
        dataclasses.replace(good, **{key: wrong})


def test_settings_that_contradict_each_other():
    with pytest.raises(st.ParameterError, match="give width < interval"):
        st.Knocker(1.0, 5.0, 5.0)
    with pytest.raises(st.ParameterError, match="J = 4 % exceeds S = 3 %"):
        st.TwoMove(3.0, 4.0, 1.0)
    with pytest.raises(st.ParameterError, match=r"cycles = 1\.5 is not allowed; give a whole number of 1 or more"):
        st.FourMove(1.0, cycles=1.5)  # type: ignore[arg-type]
    with pytest.raises(st.ParameterError, match=r"share = 0\.6 is above 1/2"):
        st.FourMove(1.0, share=0.6)
    with pytest.raises(st.ParameterError, match=r"width = 0\.2 s is shorter than one sample of 1 s"):
        run(st.Kano(3.0, 1.0), st.Knocker(1.0, 0.2, 5.0))
    with pytest.raises(st.ParameterError, match="compensator is a str; give a compensator such as Knocker"):
        run(st.Kano(3.0, 1.0), "knocker")
    with pytest.raises(st.ParameterError, match="gain = 0 PV units per % of span is not positive"):
        st.Knocker.for_stiction(3.0, 1.0, 1.0, gain=0.0)

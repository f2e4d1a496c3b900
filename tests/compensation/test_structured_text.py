"""Structured text does what the compensator's step does: both run beside each other, scan by scan."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from tests.compensation.iec_interpreter import FunctionBlock

import stiction as st
from stiction.compensation.iec_format import format_lreal
from stiction.compensation.structured_text import recommended_text, structured_text
from stiction.errors import ParameterError
from stiction.models import compensators
from stiction.models.compensators.component import compensator_at_rest
from stiction.models.dispatch import compensator_step
from stiction.models.numba_compile import kernel

KINDS = [getattr(compensators, name) for name in compensators.__all__ if name != "Compensator"]
SIGNALS, SETTINGS = 1000, 40
DAY = date(2026, 3, 2)
OUTPUTS = {"VALVE_SIGNAL": 0, "HOLD_INTEGRAL": 1, "TRACK": 2}


@kernel
def stepped(kind, p, low, high, op, sp, pv, enable, out):
    """The compensator's own step over a signal; off, and in the first scan, it rests and lets the OP pass."""
    s = compensator_at_rest(op[0], sp[0])
    for k in range(op.shape[0]):
        if k == 0 or not enable[k]:
            s = compensator_at_rest(op[k], sp[k])
            out[k, 0] = op[k]
        else:
            s = compensator_step(kind, op[k], sp[k], pv[k], s, p)
            out[k, 0] = min(max(s.valve_signal, low), high)
        out[k, 1] = s.hold
        out[k, 2] = s.track


read = cache(FunctionBlock)


def by_step(compensator, dt, limits, signal):
    out = np.empty((signal[0].size, 3))
    stepped(compensator.code, compensator.pack(dt), *limits, *signal, out)
    return out


def by_text(text, signal):
    """What the text gives, scan by scan, in the columns of `by_step`."""
    block = read(text)
    run = block.instance()
    op, sp, pv, enable = (series.tolist() for series in signal)
    out = np.zeros((len(op), 3))
    out[:, [OUTPUTS[name] for name in block.names("VAR_OUTPUT")]] = [
        run(on, u, r, y) for on, u, r, y in zip(enable, op, sp, pv, strict=True)
    ]
    return out


def random_settings(kind, rng):
    """A compensator for random stiction, with settings off those proposed."""
    S = float(rng.uniform(0.5, 8.0))
    made = kind.for_stiction(S, float(rng.uniform(0.0, S)), 0.5, gain=float(rng.uniform(0.3, 3.0)))
    values = made.to_dict()
    del values["compensator"]
    for name in {"amplitude", "band", "full"} & values.keys():
        values[name] *= float(rng.uniform(0.4, 1.6))
        if rng.random() < 0.3:
            values[name] = math.ceil(2.0 * values[name]) / 2.0
    if "interval" in values:
        width, pause = rng.integers(1, 4), rng.integers(1, 6)
        values |= {"width": 0.5 * float(width), "interval": 0.5 * float(width + pause)}
    if "move" in values:
        values |= {
            "move": 0.5 * float(rng.integers(1, 5)),
            "cycles": int(rng.integers(2, 4)),
            "tries": int(rng.integers(1, 4)),
        }
    return kind(**values)


def wave(rng, n):
    """A random walk, steps, noise, or an oscillation that starts and stops; now and then on a grid, for ties."""
    t = np.arange(n)
    shape = rng.integers(5)
    if shape == 0:
        x = np.cumsum(rng.normal(0.0, 0.7, n))
    elif shape == 1:
        x = np.repeat(rng.normal(0.0, 4.0, n), rng.integers(1, 15))[:n]
    elif shape == 2:
        x = rng.normal(0.0, 2.0, n)
    else:
        x = rng.uniform(1.0, 9.0) * np.sin(2.0 * math.pi * t / rng.uniform(6.0, 18.0) + rng.uniform(0.0, 6.0))
        x[: rng.integers(1, 20)] *= 0.1
        x[rng.integers(60, 150) :] *= rng.choice([1.0, 0.05, 0.0])
    return np.round(2.0 * x) / 2.0 if rng.random() < 0.3 else x


def stubborn_signal(rng):
    """A cycle that goes on whatever is sent, and a change of set point in it: moves fail, and are tried again."""
    n = 250
    turn = 2.0 * math.pi * np.arange(n) / rng.uniform(6.0, 9.0)
    sp = np.where(np.arange(n) < rng.integers(130, 170), 20.0, 21.0)
    return 50.0 + 5.0 * np.cos(turn), sp, sp - 9.0 * np.sin(turn), np.ones(n, dtype=bool)


def random_signal(rng):
    """Controller output, set point, PV and the off switch."""
    if rng.random() < 0.1:
        return stubborn_signal(rng)
    n = int(rng.integers(40, 130))
    op = wave(rng, n) + rng.choice([50.0, 50.0, 50.0, 2.0, 97.0])
    sp = np.full(n, float(np.round(rng.normal(20.0, 5.0))))
    enable = np.ones(n, dtype=bool)
    if rng.random() < 0.5:
        for k in rng.integers(0, n, rng.integers(1, 5)):
            sp[k:] += rng.normal(0.0, 3.0)
        for k in rng.integers(0, n, rng.integers(1, 7)):
            enable[k:] = ~enable[k:]
    return op, sp, sp - wave(rng, n), enable


def trials(kind, count, seed):
    """Random settings and limits, each with its share of `count` random signals."""
    rng = np.random.default_rng([seed, kind.code])
    for _ in range(SETTINGS):
        limits = tuple(sorted(rng.choice([0.0, 5.0, 30.0, 60.0, 95.0, 100.0], 2, replace=False).tolist()))
        yield random_settings(kind, rng), limits, [random_signal(rng) for _ in range(count // SETTINGS)]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_text_equals_the_step_on_a_thousand_signals(kind):
    asked, changed, limited = set(), 0, 0
    for compensator, limits, signals in trials(kind, SIGNALS, seed=1):
        text = structured_text(compensator, 0.5, limits, date=DAY)
        for signal in signals:
            want = by_step(compensator, 0.5, limits, signal)
            np.testing.assert_array_equal(by_text(text, signal), want)
            changed += np.count_nonzero(want[:, 0] != signal[0])
            limited += np.count_nonzero((want[:, 0] == limits[0]) | (want[:, 0] == limits[1]))
            asked |= {(bool(hold), bool(track)) for _, hold, track in want}
    assert limited > 1000
    assert changed > 1000
    holds, tracks = kind.__name__ in ("Cuadros", "IntegralDeadband"), kind.__name__ in ("TwoMove", "FourMove")
    assert asked == {(False, False), (holds, tracks)}


MUTANTS = {
    "Knocker": ("ELAPSED >= PULSE_INTERVAL", "ELAPSED > PULSE_INTERVAL"),
    "ConstantReinforcement": ("OP < LAST_OP", "OP <= LAST_OP"),
    "VariablePulses": ("MIN(AMPLITUDE,", "MAX(AMPLITUDE,"),
    "Cuadros": ("AND NOT HOLD_INTEGRAL", "AND TRUE"),
    "IntegralDeadband": ("ABS(SP - PV) < BAND", "SP - PV < BAND"),
    "TwoMove": ("POSITION := OP - FD", "POSITION := OP"),
    "FourMove": ("3: SIGNAL := CENTRE + SHARE", "3: SIGNAL := CENTRE + REACH"),
}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("change", ["rule", "limit", "off switch"])
def test_a_wrong_text_is_found_out(kind, change):
    right, wrong = {
        "rule": MUTANTS[kind.__name__],
        "limit": ("LIMIT(OP_LOW, SIGNAL, OP_HIGH)", "MAX(OP_LOW, SIGNAL)"),
        "off switch": ("NOT (ENABLE AND STARTED)", "NOT STARTED"),
    }[change]
    differ = False
    for compensator, limits, signals in trials(kind, 160, seed=2):
        text = structured_text(compensator, 0.5, limits, date=DAY)
        assert text.count(right) == 1
        wrongly = text.replace(right, wrong)
        differ = differ or any(
            not np.array_equal(by_text(wrongly, signal), by_step(compensator, 0.5, limits, signal))
            for signal in signals
        )
    assert differ


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_text_sends_what_the_simulated_loop_sends(kind):
    """A whole sticky loop: the block, given OP, SP and PV of the run, sends the same to the valve."""
    compensator = kind.for_stiction(5.0, 2.0, 1.0, gain=3.0, noise=0.1)
    loop = st.Loop(
        st.PID(0.2, 10.0, op_limits=(0.0, 100.0)), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), 1.0, 0.1, compensator
    )
    sp = np.where(np.arange(2000) < 1400, 150.0, 156.0)
    run = st.simulate(loop, sp, 2000.0, seed=3, op_start=50.0, pv_start=148.0)
    before = (50.0, sp[0], 148.0)
    signal = [np.concatenate([[rest], series]) for rest, series in zip(before, (run.op, run.sp, run.pv), strict=True)]
    sent = by_text(structured_text(compensator, 1.0), [*signal, np.ones(2001, dtype=bool)])[1:, 0]
    np.testing.assert_array_equal(sent, run.valve_signal)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_off_passes_any_op(kind):
    text = structured_text(kind.for_stiction(3.0, 1.0, 1.0), 1.0, (20.0, 80.0))
    op = np.array([-5.0, 0.0, 150.0, 33.3])
    out = by_text(text, (op, op, 0.0 * op, np.zeros(4, dtype=bool)))
    np.testing.assert_array_equal(out[:, 0], op)
    assert not out[:, 1:].any()


def test_header_says_for_what_it_was_made():
    text = structured_text(
        st.Knocker(1.5, 2.0, 5.0), 0.5, (10.0, 90.0), tag="FIC-101", S=3.0, J=1.0, date=DAY, notes=("Predicted: less.",)
    )
    head = text[: text.index("*)")]
    for said in ("Knocker", "FIC-101", "S = 3.00 %", "J = 1.00 %", "scan time 0.5 s", "2026-03-02", "Predicted: less."):
        assert said in head
    assert "ENABLE FALSE" in head
    assert "OP_LOW : LREAL := 10.0;" in text
    assert "PULSE_INTERVAL : DINT := 10;" in text


def test_header_names_the_wires_the_block_has():
    assert "force TRACK" in structured_text(st.TwoMove(3.0, 1.0, 1.5), 1.0)
    assert "force HOLD_INTEGRAL" in structured_text(st.IntegralDeadband(1.0), 1.0)
    assert "force" not in structured_text(st.Knocker(1.5, 2.0, 5.0), 1.0)


@pytest.mark.parametrize(
    ("tag", "name"),
    [
        ("FIC-101", "FIC_101_KNOCKER"),
        ("101__FIC-", "LOOP_101_FIC_KNOCKER"),
        ("Füllstand *) (* \n; x", "F_LLSTAND_X_KNOCKER"),
        ("", "KNOCKER"),
        ("液位", "KNOCKER"),
    ],
)
def test_any_tag_makes_a_text_that_compiles(tag, name):
    text = structured_text(st.Knocker(1.5, 2.0, 5.0), 1.0, tag=tag)
    assert FunctionBlock(text).name == name
    assert text.isascii()


@pytest.fixture(scope="module")
def trial():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.compensate(loop, seeds=2)


def test_a_recommended_compensator_goes_out_with_its_prediction(trial):
    trial = replace(trial, recommended="knocker", tag="FIC-101")
    text = recommended_text(trial, (5.0, 95.0), date=DAY)
    compensator = trial["knocker"].remedy.compensator
    assert text[text.index("FUNCTION_BLOCK") :] in structured_text(compensator, 1.0, (5.0, 95.0), tag="FIC-101")
    ratio = trial["knocker"].behaviour.pv_std / trial["do nothing"].behaviour.pv_std
    assert f"PV deviation x {ratio:.2f}" in text
    assert "may be wrong" not in text
    assert "a scan time of 1 s instead of 0.5 s" in recommended_text(trial, dt=0.5)


@pytest.mark.parametrize("recommended", ["retune", "do nothing", None])
def test_what_is_no_compensator_has_no_text(trial, recommended):
    with pytest.raises(ParameterError, match="no structured text"):
        recommended_text(replace(trial, recommended=recommended))


@given(some.floats(allow_nan=False, allow_infinity=False))
def test_a_number_reads_back_as_the_same_double(value):
    body = f"FUNCTION_BLOCK F VAR_OUTPUT X : LREAL := {format_lreal(value)}; END_VAR END_FUNCTION_BLOCK"
    assert FunctionBlock(body).instance()() == [value]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"dt": 0.0}, "dt"),
        ({"dt": 60.0}, "shorter than one sample"),
        ({"dt": 1e-10}, "scans"),
        ({"op_limits": (100.0, 0.0)}, "op_limits"),
        ({"op_limits": (-math.inf, math.inf)}, "op_limits"),
        ({"op_limits": 5.0}, "op_limits"),
        ({"compensator": st.Kano(3.0, 1.0)}, "Kano"),
    ],
)
def test_bad_input_is_named(given, says):
    with pytest.raises(ParameterError, match=says):
        structured_text(**{"compensator": st.Knocker(1.5, 2.0, 5.0), "dt": 1.0, **given})


@pytest.mark.parametrize(
    ("sized", "says"),
    [
        ({"S": float("nan")}, "S must be a finite number"),
        ({"J": float("inf")}, "J must be a finite"),
        ({"S": -1.0}, "S = -1"),
    ],
)
def test_a_header_tells_no_impossible_stiction(sized, says):
    with pytest.raises(ParameterError, match=says):
        structured_text(st.Knocker(1.0, 2.0, 5.0), 1.0, **sized)

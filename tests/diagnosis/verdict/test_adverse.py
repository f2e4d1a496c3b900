"""The loops drawn to be hard: their simulator against closed forms and another one, and what is counted of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from adverse import KINDS, Told, can_be_seen, counted, drawn, likelier_by_stem, table, tell
from adverse_draws import WAVES, Adverse, by_historian, recorded
from adverse_plant import Controller, Process, Signals, Transmitter, Valve, run
from scipy import signal

import stiction as st

PI = Controller(0.6, 12.0)


def moved(rng):
    """A set point in steps and a load, both nothing in the first sample."""
    sp, load = np.repeat(rng.uniform(-8.0, 8.0, 12), 50), np.repeat(rng.uniform(-4.0, 4.0, 60), 10)
    sp[0] = load[0] = 0.0
    return sp, load


@pytest.mark.parametrize(
    ("valve", "ours"),
    [
        (Valve(), st.Ideal()),
        (Valve(3.0, 1.0), st.Kano(3.0, 1.0)),
        (Valve(4.0), st.Kano(4.0, 0.0)),
        (Valve(3.0, 1.0, rests=True), st.He(2.0, 1.0)),
        (Valve(2.0, 2.0, rests=True), st.Stenman(2.0)),
    ],
    ids=["good", "sticky", "plays", "He", "Stenman"],
)
@pytest.mark.parametrize(
    ("process", "our_process"),
    [
        (Process(14.0, 3.4, K=1.3), st.FOPDT(1.3, 14.0, 3.4)),
        (Process(0.0, 2.0, K=0.02, integrating=True), st.Integrating(0.02, 2.0)),
    ],
    ids=["first order", "level"],
)
def test_a_loop_runs_as_in_the_simulator_of_the_package(valve, ours, process, our_process):
    sp, load = moved(np.random.default_rng(1))
    found = run(600, PI, process, valve, sp=sp, load=load)
    loop = st.Loop(st.PID(PI.Kc, PI.Ti), ours, our_process, dt=1.0)
    record = st.simulate(loop, sp, 600.0, load, op_start=50.0)
    assert np.ptp(found.mv) > 5.0
    for name in ("op", "pv", "mv"):
        np.testing.assert_allclose(getattr(found, name), getattr(record, name), atol=1e-6)


@pytest.mark.parametrize("inverse", [0.0, 0.8])
def test_two_lags_and_the_wrong_way_first(inverse):
    process = Process(20.0, 4.0, 12.0, 1.5, inverse=inverse)
    load = np.where(np.arange(150) >= 10, 1.0, 0.0)
    pv = run(150, Controller(0.0, 1.0), process, load=load).pv
    den = np.polymul([20.0, 1.0], [12.0, 1.0])
    num = np.trim_zeros([-1.5 * 12.0 * inverse, 1.5], "f")
    _, step = signal.step((num, den), T=np.arange(136.0))
    np.testing.assert_allclose(pv[14:], step, atol=0.02)
    assert (pv[:15] == 0.0).all()


def answered(controller, sp, **more):
    """OP over 50 of a controller whose OP moves nothing."""
    return run(len(sp), controller, Process(1.0, 0.0, K=0.0), sp=np.array(sp), **more).op - 50.0


def test_a_gap_a_square_and_a_step_of_the_controller():
    p = Controller(2.0, math.inf)
    sp = [0.0, 1.0, -3.0, 5.0]
    assert answered(p, sp) == pytest.approx([0.0, 2.0, -6.0, 10.0])
    assert answered(replace(p, gap=2.0), sp) == pytest.approx([0.0, 0.0, -2.0, 6.0])
    assert answered(replace(p, square=4.0), sp) == pytest.approx([0.0, 0.5, -4.5, 12.5])
    assert answered(replace(p, step=4.0), [0.0, 0.9, -1.1, 5.0]) == pytest.approx([-2.0, 2.0, -2.0, 10.0])
    assert answered(Controller(2.0, 4.0), [0.0, 1.0, 1.0]) == pytest.approx([0.0, 2.5, 3.0])


def test_a_filter_is_not_in_the_recorded_pv():
    load = np.where(np.arange(5) > 0, 1.0, 0.0)
    pi = Controller(1.0, math.inf, lag=3.0)
    assert answered(pi, np.zeros(5), noise=load) == pytest.approx(np.exp(-np.arange(5) / 3.0) - 1.0)
    assert (run(5, pi, Process(1.0, 0.0, K=0.0), noise=load).pv == load).all()


@pytest.mark.parametrize(("guarded", "after"), [(True, 2.878), (False, 5.0)])
def test_windup(guarded, after):
    # The integral gains 0.102 a sample, to 3.978 where it is guarded and to 10.2 where not; then the error turns.
    pi = Controller(1.0, 10.0, low=45.0, high=55.0, anti_windup=guarded)
    op = answered(pi, [0.0] + [1.02] * 100 + [-1.0])
    assert op[100] == 5.0
    assert op[101] == pytest.approx(after)


def stroked(valve, op, friction=1.0):
    """Stem and flow at OPs one after the other, by a controller that all but does not see the PV; it starts at 50 %."""
    process, sp = Process(0.0, 0.0, K=1e-9), np.array([*op, op[-1]]) - 50.0
    found = run(sp.size, Controller(1.0, math.inf), process, valve, friction=friction, sp=sp)
    return found.mv[:-1], found.pv[1:] / 1e-9


@pytest.mark.parametrize(
    ("valve", "op", "flow"),
    [
        (Valve(trim="split range", number=3.0), [50.0, 48.0, 52.0], [0.0, -2.0, 6.0]),
        (Valve(trim="split gap", number=2.0), [50.0, 51.0, 55.0, 44.0], [0.0, 0.0, 3.0, -4.0]),
        (Valve(trim="equal percentage", number=50.0), [50.0, 50.01, 100.0], [0.0, 0.01, (50.0**0.5 - 1.0) * 25.5622]),
        (Valve(seat=49.0), [50.0, 45.0, 52.0], [0.0, -1.0, 2.0]),
    ],
    ids=["split range", "split gap", "equal percentage", "seat"],
)
def test_the_flow_through_a_trim(valve, op, flow):
    stem, found = stroked(valve, op)
    assert stem == pytest.approx(op)
    assert found == pytest.approx(flow, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("valve", "op", "stem"),
    [
        (Valve(step=0.5), [50.0, 50.3, 50.7, 50.3], [50.0, 50.5, 50.5, 50.5]),
        (Valve(rate=0.4), [50.0, 51.0, 51.0, 51.0], [50.0, 50.4, 50.8, 51.0]),
        (Valve(4.0, 2.0, down=0.5), [50.0, 52.9, 53.1, 50.7, 50.5], [50.0, 50.0, 52.1, 52.1, 51.0]),
        (Valve(4.0, 4.0, slope=1.0), [50.0, 54.1, 50.0, 49.7, 53.69], [50.0, 54.1, 54.1, 49.7, 53.69]),
    ],
    ids=["steps", "rate", "less down", "more above"],
)
def test_where_the_stem_goes(valve, op, stem):
    # Down at half: 1.5 breaks it away, 0.5 is left. More above: at 54.1 it takes 4 * 1.082, at 49.7 only 4 * 0.994.
    assert stroked(valve, op)[0] == pytest.approx(stem)


def test_friction_is_another_one_in_each_rest():
    # At first 3 breaks the stem away and 1 is left; at half of that 1.5 and 0.5; at a quarter 0.75 and 0.25.
    op = [50.0, 53.1, 50.5, 51.8, 50.8]
    stem = [50.0, 52.1, 51.0, 51.55, 51.55]
    assert stroked(Valve(4.0, 2.0), op, [1.0, 0.5, 0.25, *3 * [9.0]])[0] == pytest.approx(stem)


def test_what_a_transmitter_shows():
    y = np.array([0.0, 4.2, -3.3, 1.4])

    def shown(transmitter):
        # The load reaches a process without lag or dead time within its own sample, and the PV in the next.
        return run(5, Controller(0.0, 1.0), Process(0.0, 0.0), None, transmitter, load=np.append(y, 0.0)).pv[1:]

    assert shown(Transmitter()) == pytest.approx(y)
    assert shown(Transmitter("head", 20.0)) == pytest.approx(40.0 * (np.sqrt(1.0 + y / 20.0) - 1.0))
    assert shown(Transmitter("titration", 2.0)) == pytest.approx(2.0 * np.tanh(y / 2.0) + 0.08 * y)
    assert shown(Transmitter(step=0.5)) == pytest.approx([0.0, 4.0, -3.5, 1.5])
    assert shown(Transmitter(hold=2)) == pytest.approx([0.0, 4.2, 4.2, 1.4])


@pytest.mark.parametrize(("shape", "mean_square"), [("sine", 1 / 2), ("tri", 1 / 3), ("square", 1.0), ("saw", 1 / 3)])
def test_waves(shape, mean_square):
    wave = WAVES[shape](np.arange(1000) / 1000.0)
    assert np.abs(wave).max() == pytest.approx(1.0, abs=1e-3)
    assert np.mean(wave) == pytest.approx(0.0, abs=2e-3)
    assert np.mean(wave**2) == pytest.approx(mean_square, rel=1e-2)


def test_a_historian_keeps_means_or_samples():
    x = np.arange(7.0)
    kept = {tuple(by_historian(np.random.default_rng(k), Signals(x, x, x, x), 3).pv) for k in range(20)}
    assert kept == {(1.0, 4.0), (0.0, 3.0)}


RESTS = {"valve_res", "play_integ", "play_load"}
"""Kinds of good valves whose stem stands still at times while the OP moves."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_draws_what_it_says(kind):
    loop, again, other = drawn(kind, 3, 1), drawn(kind, 3, 1), drawn(kind, 3, 2)
    record = loop.record
    assert record == again.record
    assert len(record) != len(other.record) or (record.op != other.record.op).any()
    assert np.isfinite([record.op, record.pv, record.sp, loop.mv]).all()
    assert record.mv is None
    assert np.ptp(record.op) > 0.1
    assert loop.sticky == kind.startswith("st_")
    assert (loop.J > 0.0) == loop.sticky
    assert (loop.S > 0.0) == (loop.sticky or kind.startswith("play_"))
    still = (np.abs(np.diff(loop.mv)) < 1e-9) & (np.abs(np.diff(record.op)) > 1e-6)
    assert still.any() == (loop.sticky or kind in RESTS)


@pytest.mark.parametrize(
    ("kind", "i", "samples", "op_mean", "op_std", "pv_mean", "pv_std"),
    [
        ("eqpct_ext", 0, 1877, 50.9099411, 4.01107314, 0.0134834017, 3.57011185),
        ("avg_level", 0, 2400, 50.1480339, 4.70419021, -0.0354383661, 4.30671388),
        ("slave_cyc", 0, 873, 40.484468, 3.17080156, -0.0316191827, 2.60311588),
        ("ponly_ext", 2, 932, 49.9071905, 1.66276756, 0.181658005, 3.25456886),
        ("posit_hunt", 1, 1986, 50.0075816, 1.53282489, -0.00602196122, 0.553755246),
        ("posit_hunt", 2, 1442, 50.1165873, 1.69488633, -0.000471622397, 0.787362121),
        ("batch", 0, 985, 60.4863648, 12.1407831, -0.234835359, 11.7780837),
        ("drift", 0, 2213, 51.1490212, 1.358606, -0.0159902808, 1.25923066),
        ("units_ext", 0, 1171, 50.0349911, 1.11105724, -190.062852, 3.60692229),
        ("hist_good", 0, 1062, 51.2260802, 3.75232576, -0.00142255015, 0.277660397),
        ("inverse", 0, 945, 50.0747515, 0.48552567, -0.0328252304, 1.87427315),
        ("analyser", 0, 1187, 50.0942041, 1.35250399, -0.0279637742, 0.726780533),
    ],
)
def test_loops_are_those_of_the_first_counts(kind, i, samples, op_mean, op_std, pv_mean, pv_std):
    """Numbers of loops as they were when the kinds were first written, by other code."""
    op, pv = drawn(kind, 1, i).record.op, drawn(kind, 1, i).record.pv
    assert op.size == samples
    assert (op.mean(), op.std(), pv.mean(), pv.std()) == pytest.approx((op_mean, op_std, pv_mean, pv_std), rel=1e-7)


@pytest.mark.parametrize(
    ("kind", "samples", "S", "J"),
    [
        ("st_noisy", 1687, 2.29961892, 1.87936105),
        ("st_asym", 1862, 2.10097462, 1.40189051),
        ("st_smallJ", 1460, 6.98696084, 0.994359144),
        ("st_long", 12000, 1.71774772, 1.19390880),
    ],
)
def test_sticky_loops_are_those_of_the_first_counts(kind, samples, S, J):
    """As above; when such a stem slips depends on the last digits, so that its signals are not the same everywhere."""
    loop = drawn(kind, 1, 0)
    assert (len(loop.record), loop.S, loop.J) == pytest.approx((samples, S, J), rel=1e-7)


def loop_of(valve):
    """A loop that cycles where its valve sticks, and little noise on the PV."""
    rng = np.random.default_rng(5)
    load = np.where(np.arange(1500) < 30, 5.0, 0.0) + 0.1 * np.cumsum(rng.normal(0.0, 1.0, 1500))
    return recorded(run(1500, PI, Process(10.0, 4.0), valve, load=load, noise=0.02 * rng.normal(size=1500)), valve)


def test_stiction_is_seen_where_the_stem_jumps_and_predicts_the_pv():
    loop = loop_of(Valve(4.0, 3.0))
    assert can_be_seen(loop)
    assert not can_be_seen(loop._replace(J=100.0))  # the same stem has no jump that large
    assert not can_be_seen(loop._replace(mv=loop.record.op + np.where(np.arange(1500) % 200 < 100, 0.0, 3.0)))
    assert not can_be_seen(loop._replace(J=0.0))  # it would only play
    assert likelier_by_stem(loop_of(Valve())) == 0.0


def test_a_stem_is_likelier_by_that_of_the_noise_which_the_op_leaves():
    """Where the PV is the stem three samples before, and noise: with white noise for an OP that says nothing of it."""
    rng = np.random.default_rng(2)
    op, mv, error = rng.normal(size=(3, 4000))
    pv = 0.5 * np.roll(mv, 3) + 0.5 * error
    loop = Adverse(st.LoopRecord("X", 1.0, op=op, pv=pv), mv, 1.0, 1.0)
    assert likelier_by_stem(loop) == pytest.approx(4000.0 * math.log(2.0), rel=0.05)


@pytest.mark.parametrize("kind", ["slave_good", "batch", "sawload_level", "st_slave", "st_batch", "st_eqpct"])
def test_the_plainest_are_told(kind):
    row = tell((kind, 7, 0))
    assert row.right, row
    assert not row.sure
    assert row.seen == row.sticky


def told(kind, verdict, probability, *, seen=False):
    sticky = kind.startswith("st_")
    return Told(kind, 0, sticky, seen, 4.0 * sticky, 2.0 * sticky, verdict, "", probability)


def test_rows_are_counted_and_sticky_ones_twice():
    rows = [
        *(told("batch", "no_stiction", 0.1), told("batch", "undecided", 0.5), told("seat", "stiction", 0.91)),
        *(told("st_gap", "stiction", 0.9, seen=True), told("st_gap", "no_stiction", 0.09, seen=True)),
        *(told("st_gap", "no_stiction", 0.3), told("st_gap", "undecided", 0.5)),
    ]
    assert counted(rows) == {"loops": 7, "right": 2, "undecided": 2, "wrong": 3, "sure": 2}
    assert [line.split() for line in table(rows).splitlines()[1:]] == [
        ["batch", "2", "1", "1", "0", "0"],
        ["seat", "1", "0", "0", "1", "1"],
        ["st_gap", "4", "1", "1", "2", "1", "2", "1", "0", "1", "1"],
        ["all", "good", "3", "1", "1", "1", "1"],
        ["all", "sticky", "4", "1", "1", "2", "1", "2", "1", "0", "1", "1"],
    ]

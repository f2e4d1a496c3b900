"""Data checks: each fault is put into a good record, and its check must find it, its size, and nothing else."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import ParameterError
from stiction.records import LoopRecord, analysis_window, assess_quality
from stiction.records.conditioned import condition

N = 1200
PERIOD = 60.0


@pytest.fixture
def good():
    k = np.arange(N)
    rng = np.random.default_rng(11)
    op = 50 + 6 * np.sin(2 * np.pi * k / PERIOD) + rng.normal(0, 0.2, N)
    pv = 200 + 9 * np.cos(2 * np.pi * k / PERIOD) + rng.normal(0, 0.5, N)
    return LoopRecord("FIC-1", 1.0, op=op, pv=pv, loop_type="flow")


def find_check(record, name, period=None):
    return next(g for g in assess_quality(record, period).checks if g.name == name)


def faults(record, period=None):
    """Name -> severity of the checks that are not passed; each that rejects must name a remedy."""
    quality = assess_quality(record, period)
    for one in quality.rejections:
        assert re.search("[.:] (Put|[Rr]ecord|Repair|[Ee]xport|Check|Set|Name|What) ", one.why), one
    return {g.name: g.severity for g in quality.checks if g.severity != "ok"}


def test_good_record_passes_every_check(good):
    quality = assess_quality(good, PERIOD)
    assert quality.usable
    assert faults(good, PERIOD) == {}
    assert (quality.first, quality.last, quality.rows, quality.duration, quality.bad_percent) == (0, N, N, N, 0.0)
    assert not {"cycles", "sampling"} & {g.name for g in assess_quality(good).checks}  # without a period
    assert len(quality.checks) == 20
    assert all(g.why.endswith(".") for g in quality.checks)
    assert quality.summary().startswith("usable")
    first = json.loads(json.dumps(quality.to_dict(), allow_nan=False))["gates"][0]
    assert (first["name"], first["severity"], first["unit"]) == ("length", "ok", "samples")


@pytest.mark.parametrize(("period", "severity"), [(100.0, "ok"), (200.0, "warn"), (500.0, "reject")])
def test_cycles(good, period, severity):
    found = find_check(good, "cycles", period)
    assert (found.severity, found.value) == (severity, N / period)


@pytest.mark.parametrize(("period", "severity"), [(12.0, "ok"), (6.0, "warn"), (3.0, "reject")])
def test_samples_per_cycle(good, period, severity):
    found = find_check(good, "sampling", period)
    assert (found.severity, found.value) == (severity, period)


def test_a_short_record_needs_more_samples_per_cycle(good):
    assert find_check(good, "sampling", 5.0).severity == "warn"
    assert find_check(good.window(0, 150), "sampling", 5.0).severity == "reject"


def test_period_must_be_positive(good):
    with pytest.raises(ParameterError, match="period"):
        assess_quality(good, 0.0)


@pytest.mark.parametrize(("n", "severity"), [(320, "ok"), (280, "warn"), (40, "reject")])
def test_length(good, n, severity):
    found = find_check(good.window(0, n), "length")
    assert (found.severity, found.value) == (severity, n)


@pytest.mark.parametrize("signal", ["op", "pv"])
def test_constant_signal(good, signal):
    record = replace(good, **{signal: np.full(N, 42.0)})
    assert (faults(record)[f"{signal} movement"], assess_quality(record).usable) == ("reject", False)
    assert "in automatic" not in find_check(record, "length").why  # it is


def test_no_pv(good):
    assert faults(replace(good, pv=None))["pv movement"] == "reject"


@pytest.mark.parametrize("limit", [0.0, 100.0])
def test_saturation_at_the_span(good, limit):
    op = good.op.copy()
    op[300:420] = limit
    record = replace(good, op=op)
    assert faults(record) == {"saturation": "warn"}
    assert find_check(record, "saturation").value == pytest.approx(10.0)
    assert analysis_window(record) == (0, N)  # there OP is known: the valve was sent that


def test_saturation_at_a_limit_of_its_own(good):
    op = good.op.copy()
    op[300:420] = 77.0
    record = replace(good, op=op)
    assert find_check(record, "saturation").value == pytest.approx(10.0)
    assert analysis_window(record) == (420, N)


def test_a_loop_that_is_always_saturated_is_refused(good):
    op = np.full(N, 100.0)
    op[:100] = good.op[:100]
    quality = assess_quality(replace(good, op=op))
    assert not quality.usable
    assert "saturation" in {g.name for g in quality.rejections}


def test_manual_by_the_mode(good):
    auto = np.ones(N, dtype=bool)
    auto[0:300] = False
    record = replace(good, auto=auto)
    assert faults(record) == {"manual": "warn"}
    assert find_check(record, "manual").value == pytest.approx(25.0)
    assert analysis_window(record) == (300, N)


def test_manual_without_a_mode(good):
    op = good.op.copy()
    op[900:1100] = 50.0
    record = replace(good, op=op)
    assert faults(record) == {"manual": "warn"}
    assert analysis_window(record) == (0, 900)


def test_an_op_that_never_rests_and_then_does_was_in_manual(good):
    op = good.op.copy()
    op[900:920] = 50.0
    short = replace(good, op=op)
    assert find_check(short, "manual").value == pytest.approx(100.0 * 20.0 / N)
    assert analysis_window(short) == (0, 900)
    op[900:920] = good.op[900:920]
    op[900:908] = 50.0
    assert analysis_window(replace(good, op=op)) == (0, N)
    # Rounded, or by a controller slower than the record, it rests now and then, and for no one's hand.
    rests = np.round(good.op)
    rests[900:920] = 50.0
    assert analysis_window(replace(good, op=rests)) == (0, N)
    assert find_check(replace(good, op=np.repeat(good.op[::20], 20)), "manual").value == 0.0


@pytest.mark.parametrize("also_op", [True, False])
def test_a_frozen_stretch_is_left_out_and_is_not_manual(good, also_op):
    op, pv = good.op.copy(), good.pv.copy()
    pv[700:1000] = 200.0
    if also_op:
        op[700:1000] = 50.0
    record = replace(good, op=op, pv=pv)
    assert faults(record) == {"frozen pv": "warn"}
    assert find_check(record, "frozen pv").value == pytest.approx(100 * 300 / N)
    assert analysis_window(record) == (0, 700)


def test_op_and_pv_that_rest_together_say_that_the_historian_was_not_reached(good):
    op, pv = good.op.copy(), good.pv.copy()
    pv[700:708] = 200.0
    assert find_check(replace(good, pv=pv), "historian outages").value == 0
    op[700:708] = 50.0
    record = replace(good, op=op, pv=pv)
    assert faults(record) == {"historian outages": "warn"}
    assert find_check(record, "historian outages").value == 1
    assert analysis_window(record) == (0, N)
    # Of a coarse PV, which rests by itself as well, so short a rest says nothing.
    coarse = np.round(good.pv / np.ptp(good.pv) * 10.0)
    coarse[700:708] = 20.0
    assert find_check(replace(good, op=op, pv=coarse), "historian outages").value == 0
    # A loop at rest before it is moved was reached by its historian.
    op, pv = good.op.copy(), good.pv.copy()
    op[:8], pv[:8] = op[8], pv[8]
    assert find_check(replace(good, op=op, pv=pv), "historian outages").value == 0


def test_clipped_op_is_found_in_a_record_with_manual_control(good):
    op = np.minimum(good.op, np.percentile(good.op, 70.0))
    alone = find_check(replace(good, op=op), "saturation").value
    assert alone > 15.0
    op[900:960] = np.percentile(op, 40.0)
    record = replace(good, op=op)
    assert find_check(record, "saturation").value == pytest.approx(alone, abs=100 * 60 / N)
    assert find_check(record, "manual").value == pytest.approx(100 * 60 / N)


def test_rests_that_come_back_are_not_frozen():
    # A coarse transmitter on a slow cycle: PV rests for 60 samples and more, again and again.
    k = np.arange(N)
    pv = np.round(2.0 * np.sin(2 * np.pi * k / 400))
    op = 50 + 6 * np.cos(2 * np.pi * k / 400) + np.random.default_rng(1).normal(0, 0.1, N)
    assert max(np.diff(np.flatnonzero(np.diff(pv)))) > 60
    assert find_check(LoopRecord("LIC-1", 1.0, op=op, pv=pv), "frozen pv").value == 0.0


def test_slow_historian_repeats_both(good):
    every_third = np.arange(N) // 3 * 3
    record = replace(good, op=good.op[every_third], pv=good.pv[every_third])
    assert faults(record) == {"held values": "warn"}


def test_interpolated_by_the_historian(good):
    k = np.arange(N)
    knots = k[::12]
    record = replace(good, op=np.interp(k, knots, good.op[knots]), pv=np.interp(k, knots, good.pv[knots]))
    assert faults(record, PERIOD) == {"compression": "reject"}
    assert find_check(record, "compression", PERIOD).value == pytest.approx(PERIOD / 12, rel=0.2)  # points per cycle
    knots = k[::5]
    record = replace(good, op=np.interp(k, knots, good.op[knots]), pv=np.interp(k, knots, good.pv[knots]))
    assert faults(record, PERIOD) == {"compression": "warn"}
    assert find_check(record, "compression", PERIOD).value == pytest.approx(80, abs=3)  # four of five samples are drawn


def test_straight_op_over_a_still_pv_is_integral_action_not_compression():
    # A stuck valve without noise: PV stands off the set point, OP ramps exactly.
    phase = np.arange(N) // 40 % 2
    pv = np.where(phase == 0, 1.0, -1.0)
    op = 50 - np.cumsum(pv) * 0.1
    assert find_check(LoopRecord("FIC-1", 1.0, op=op, pv=pv), "compression").severity == "ok"


@pytest.mark.parametrize(
    ("signal", "step", "severity"),
    [
        *(("pv", 0.5, "ok"), ("pv", 2.0, "warn"), ("pv", 30.0, "reject")),
        *(("op", 0.5, "ok"), ("op", 1.0, "warn"), ("op", 4.0, "reject")),
    ],
)
def test_resolution(good, signal, step, severity):
    record = replace(good, **{signal: np.round(getattr(good, signal) / step) * step})
    assert find_check(record, f"{signal} resolution").severity == severity


def test_coarse_op(good):
    assert faults(replace(good, op=np.round(good.op)))["op resolution"] == "warn"


def test_missing_values_and_bridged_gaps(good):
    pv = good.pv.copy()
    pv[100:103] = np.nan
    pv[700:730] = np.nan
    record = replace(good, pv=pv)
    assert faults(record) == {"missing values": "warn"}
    found = find_check(record, "missing values")
    assert found.value == pytest.approx(100 * 33 / N)
    assert "longest gap lasts 30 s" in found.why
    assert analysis_window(record) == (0, 700)
    part = condition(record).part
    assert len(part) == 700
    np.testing.assert_allclose(part.pv[100:103], pv[99] + (pv[103] - pv[99]) * np.array([0.25, 0.5, 0.75]))
    assert any("3 missing samples were filled" in guess for guess in part.provenance.assumptions)


def test_mostly_bridged_is_refused(good):
    pv = good.pv.copy()
    pv[::2] = np.nan
    pv[:200] = np.nan
    assert faults(replace(good, pv=pv))["missing values"] == "reject"


def test_a_long_gap_does_not_spoil_a_long_stretch_but_gaps_in_every_cycle_do(good):
    pv = good.pv.copy()
    pv[:700] = np.nan
    assert faults(replace(good, pv=pv), PERIOD) == {"missing values": "warn"}
    pv = good.pv.copy()
    pv[np.arange(N) % 100 < 30] = np.nan  # thirty per cent in gaps of half a cycle
    assert faults(replace(good, pv=pv), PERIOD)["missing values"] == "reject"


def test_op_at_its_limit_in_every_cycle_is_refused_as_saturation(good):
    record = replace(good, op=np.minimum(good.op, 53.0))
    found = assess_quality(record, PERIOD).rejections
    assert "saturation" in {g.name for g in found}
    assert "record longer" in next(g for g in found if g.name == "saturation").why


def test_op_at_the_end_of_its_span_in_every_cycle_is_known(good):
    record = replace(good, op=np.maximum(good.op - np.median(good.op), 0.0))
    quality = assess_quality(record, PERIOD)
    assert quality.usable
    assert "saturation" in {g.name for g in quality.warnings}
    assert (quality.first, quality.last) == (0, N)


def test_a_record_without_memory_is_doubted(good):
    rng = np.random.default_rng(2)
    record = replace(good, op=50 + rng.normal(0, 1, N), pv=rng.normal(0, 1, N))
    assert faults(record) == {"sampling": "warn"}
    assert find_check(record, "sampling").value < 0.1


@pytest.mark.parametrize("change", [lambda op: op / 100, lambda op: (op - 50) / 6, lambda op: 8 * op])
def test_op_not_in_percent_only_lowers(good, change):
    record = replace(good, op=change(good.op))
    assert faults(record) == {"op scale": "warn"}
    assert assess_quality(record).usable


def test_copied_stretch(good):
    op, pv = good.op.copy(), good.pv.copy()
    op[800:900], pv[800:900] = op[200:300], pv[200:300]
    record = replace(good, op=op, pv=pv)
    assert faults(record) == {"copied data": "warn"}
    assert find_check(record, "copied data").value == pytest.approx(100 * 100 / N)


def test_a_short_copy_is_seen_where_no_value_is_rounded(good):
    rng = np.random.default_rng(4)
    op, pv = (x + 1e-3 * rng.normal(size=N) for x in (good.op, good.pv))
    op[800:811], pv[800:811] = op[205:216], pv[205:216]
    assert find_check(replace(good, op=op, pv=pv), "copied data").value == pytest.approx(100 * 11 / N)
    coarse = replace(good, op=np.round(op, 1), pv=np.round(pv, 1))
    assert find_check(coarse, "copied data").value == 0.0  # eleven rounded values can be the same by chance


def test_an_exactly_periodic_simulation_is_no_copy():
    k = np.arange(N) % 50
    wave = np.abs(k - 25) + np.sin(k)
    found = find_check(LoopRecord("FIC-1", 1.0, op=50 + wave, pv=wave[::-1]), "copied data")
    assert found.severity == "ok"
    assert "simulated" in found.why


def test_a_coarse_cycle_comes_back_to_itself_and_is_no_copy(good):
    # Without noise, 200 levels: whole stretches recur by chance at some multiple of the period of 60.3 samples.
    k = np.arange(3000)
    wave = 2 * np.pi * k / 60.3
    record = LoopRecord("FIC-1", 1.0, op=50 + np.round(np.sin(wave), 2), pv=np.round(np.cos(wave), 2))
    found = find_check(record, "copied data")
    assert found.value > 2.0  # it does recur
    assert found.severity == "ok"


def test_a_clock_jump_is_cut_where_the_signals_break_off(good):
    keep = np.r_[0:500, 530:N]  # half a cycle is left out
    record = replace(good, op=good.op[keep], pv=good.pv[keep], provenance=replace(good.provenance, clock_jumps=1))
    first, last = analysis_window(record)
    assert first in (501, 502)
    assert last == len(record)
    assert faults(record) == {"clock jumps": "warn"}
    assert analysis_window(replace(record, provenance=good.provenance)) == (0, len(record))


def test_clock_jump_without_lost_rows_keeps_the_record(good):
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 0.5, N)  # that the controller passes on
    record = replace(good, op=good.op - 0.2 * noise, pv=good.pv + noise)
    assert analysis_window(replace(record, provenance=replace(good.provenance, clock_jumps=1))) == (0, N)


def test_clock_jumps_of_the_reader(good):
    record = replace(good, provenance=replace(good.provenance, clock_jumps=1))
    assert faults(record) == {"clock jumps": "warn"}


def test_corrected_summer_time_does_not_warn(good):
    record = replace(good, provenance=replace(good.provenance, clock_jumps=1, summer_time=1))
    assert faults(record) == {}
    assert "summer time was corrected" in find_check(record, "clock jumps").why
    other = replace(good, provenance=replace(good.provenance, clock_jumps=2, summer_time=1))
    assert faults(other) == {"clock jumps": "warn"}


def test_an_hour_that_was_lost_then_is_no_change_of_summer_time(good):
    keep = np.r_[0:500, 530:N]
    provenance = replace(good.provenance, clock_jumps=1, summer_time=1)
    record = replace(good, op=good.op[keep], pv=good.pv[keep], provenance=provenance)
    assert analysis_window(record)[0] in (501, 502)
    assert faults(record) == {"clock jumps": "warn"}


@settings(deadline=None, max_examples=60)
@given(data=some.data(), n=some.integers(0, 80))
def test_window_is_the_longest_segment_without_faults(data, n):
    bad = np.array(data.draw(some.lists(some.booleans(), min_size=n, max_size=n)), dtype=bool)
    auto = np.array(data.draw(some.lists(some.booleans(), min_size=n, max_size=n)), dtype=bool) | (np.arange(n) % 3 > 0)
    record = LoopRecord("x", 1.0, op=np.where(bad, np.nan, 50 + np.sin(range(n))), pv=np.cos(range(n)), auto=auto)

    # The slow twin: automatic throughout, samples at both ends, no gap above 20; above 5 if a fifth would be missing.
    def fits(first, last, gap):
        ends = auto[first:last].all() and not bad[first] and not bad[last - 1]
        return ends and "1" * (gap + 1) not in "".join("1" if b else "0" for b in bad[first:last])

    def longest(gap):
        found = ((a, b) for a in range(n) for b in range(a + 1, n + 1) if fits(a, b, gap))
        return max(found, key=lambda one: one[1] - one[0], default=(0, 0))

    first, last = longest(20)
    too_few = bad[first:last].sum() > 0.2 * (last - first)
    assert analysis_window(record) == (longest(5) if too_few else (first, last))
    assert not np.isnan(condition(record).part.op).any()
    assess_quality(record, period=10.0)

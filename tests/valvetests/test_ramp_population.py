from __future__ import annotations

import time

import pytest

import stiction as st

from .population import clean, right_ramps, seen_by_flow, seen_by_position, truth, valves

SEEDS = range(3)


def test_position_with_noise_and_rounding():
    right = total = 0
    for name, valve in valves().items():
        known = truth(valve)
        for seed in SEEDS:
            test = st.analyse_ramp(seen_by_position(name, seed))
            assert test.sb.value == pytest.approx(known.sb, rel=0.05), name
            assert test.sj.value == pytest.approx(known.sj, rel=0.10), name
            assert test.r_low < known.r <= test.r_high, name
            assert test.S.value == pytest.approx(2 * known.sb - known.sj, rel=0.05), name
            good, ramps = right_ramps(test, known)
            right, total = right + good, total + ramps
    assert total >= 100
    assert right >= 0.95 * total


def test_flow_only_behind_a_sensor():
    for name, valve in valves().items():
        known = truth(valve)
        for seed in SEEDS:
            test = st.analyse_ramp(seen_by_flow(name, seed))
            assert test.signal == "pv"
            assert test.sb.value == pytest.approx(known.sb, rel=0.10), name
            assert test.sj.value == pytest.approx(known.sj, rel=0.20), name
            assert test.r_low < known.r <= test.r_high, name


def test_every_stair_is_an_event():
    # Stairs of a physical valve are counted on its clean stem: rises of more than half a jump in a sample.
    record, known = clean("light"), truth(valves()["light"])
    test = st.analyse_ramp(record)
    slow = test.ramps[6]
    assert slow.rate == pytest.approx(0.5 * known.r, rel=0.01)
    window = record.mv[round(slow.start) : round(slow.end)]
    rises = window[1:] - window[:-1] > 0.5 * known.sj
    slips = [event for event in test.events if event.kind == "slip" and event.ramp == 6]
    assert len(slips) == slow.slips == int(rises.sum())
    assert [event.direction for event in slips] == [1] * len(slips)


def test_three_thousand_samples_take_well_under_a_tenth_of_a_second():
    record = seen_by_position("light", 0)
    st.analyse_ramp(record)
    taken = []
    for _ in range(3):
        begin = time.perf_counter()
        st.analyse_ramp(record)
        taken.append(time.perf_counter() - begin)
    assert len(record) >= 3000
    assert min(taken) < 0.1

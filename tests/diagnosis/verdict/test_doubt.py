"""A probability from data in doubt is never sure, and never turns round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.diagnosis.verdict.doubt import (
    BEYOND,
    FEW,
    HIDES,
    KEPT,
    LEAST,
    MOST,
    PLAINLY,
    ROWS,
    STEPS,
    SURELY,
    UNKNOWN,
    held_back,
    only_saturated,
)
from stiction.diagnosis.verdict.objection import Objection
from stiction.records.assess import Quality
from stiction.records.check_result import CheckInput, CheckResult
from stiction.records.loop_checks import LOOP_CHECKS
from stiction.records.record import LoopRecord
from stiction.records.storage_checks import STORAGE_CHECKS

LOWERING = (
    "cycles",
    "sampling",
    "pv resolution",
    "missing values",
    "op resolution",
    "saturation",
    "frozen pv",
    "length",
)


def odds(p):
    return p / (1.0 - p)


def quality(lowers=(), refuses=(), first=5, rows=1000, value=1.0):
    gates = tuple(CheckResult(name, "warn", value, 0.0, "-", "clock_even") for name in lowers)
    gates += tuple(CheckResult(name, "reject", 1.0, 0.0, "-", "clock_even") for name in refuses)
    return Quality(gates, not refuses, rows, float(rows), 0.0, first, rows)


def spikes(number):
    """Gates of a record that stores so many values far off all others."""
    return quality(("outliers",), value=number)


def hides(name):
    """Whether a value of a gate that itself finds nothing keeps a probability from being sure."""
    return lambda x: bounded(one_check(name, "ok", x, 0.0))


def one_check(*result):
    """Quality of a record with one data check."""
    return Quality((CheckResult(*result, "-", "clock_even"),), True, 1000, 1000.0, 0.0, 0, 1000)


def bounded(quality, *, own_samples=False):
    return [held_back(p, quality, own_samples=own_samples).probability for p in (0.005, 0.995)] == [0.1, 0.9]


def kept(share):
    """Whether a record of which such a share is kept is bound."""
    return bounded(quality(first=1000 - round(share * 1000)), own_samples=True)


def copied(p, also=(), **found):
    """A probability from a record of which a stretch is a copy."""
    return held_back(p, quality(("copied data", *also)), **found)


LIMITS = [
    ("steps of OP", hides("op resolution"), 100.0, 99.0),
    ("missing samples [%]", hides("missing values"), 10.0, 10.1),
    ("held samples [%]", hides("held values"), 5.0, 5.1),
    ("straight lines [%]", hides("compression"), 2.0, 2.1),
    ("samples", lambda n: held_back(0.06, quality(first=0, rows=n)).probability == 0.1, 880, 879),
    ("surely, of few samples", lambda p: held_back(p, quality(first=0, rows=700)).probability == 0.1, 0.0499, 0.05),
    ("surely, of few for a cycle", lambda p: held_back(p, quality(("sampling",))).probability == 0.1, 0.0411, 0.0412),
    ("surely, of both", lambda p: held_back(p, quality(("sampling",), rows=700)).probability == 0.1, 0.0068, 0.00681),
    ("surely, of half as many", lambda p: held_back(p, quality(first=0, rows=439)).probability == 0.1, 0.0099, 0.01),
    ("half as many", lambda n: held_back(0.02, quality(first=0, rows=n)).probability == 0.1, 440, 439),
    ("plainly, of other rows", lambda p: copied(p).probability == 0.1, 0.00314, 0.00315),
    ("share kept", kept, 0.75, 0.749),
    ("one loop in four", lambda p: held_back(p, quality(("copied data",))).probability != pytest.approx(p), 0.25, 0.24),
    ("even odds", lambda p: held_back(p, quality(("copied data",))).probability != pytest.approx(p), 0.5, 0.51),
    ("saturation that is the finding", lambda p: bool(held_back(0.4, quality(("saturation",)), p).why), 0.5, 0.49),
    ("spikes that are the finding", lambda p: not held_back(0.4, spikes(6.0), sensor=p).why, 0.49, 0.5),
    ("their number", lambda n: not held_back(0.4, spikes(n), sensor=0.9).why, 5.0, 6.0),
]
"""What is limited, whether a value lies beyond the limit, the last value that does not and one that does."""


@pytest.mark.parametrize(("beyond", "inside", "outside"), [row[1:] for row in LIMITS], ids=[row[0] for row in LIMITS])
def test_limits(beyond, inside, outside):
    assert not beyond(inside)
    assert beyond(outside)


@pytest.mark.parametrize(
    "found", [{"against": (Objection.JUMP_LIKELY,)}, {"against": (Objection.JUMP_OPEN,)}, {"valve_seen": False}]
)
def test_rows_that_are_missing_bind_with_what_was_found(found):
    assert copied(1e-5).probability < 0.001
    assert copied(1e-5, **found).probability == 0.1
    assert copied(1.0 - 1e-5).probability == 0.9


@pytest.mark.parametrize("name", sorted({*HIDES} - {*ROWS}))
def test_rows_that_are_missing_bind_with_what_smears_the_others(name):
    assert copied(1e-7, ("clock jumps", "missing values")).probability < 0.001
    assert copied(1e-7, (name,)).probability == 0.1


def test_the_limits_are_all_in_the_table():
    assert set(BEYOND) == {"missing values", "held values", "compression"}
    assert set(HIDES) == {
        *(
            "exception reporting",
            "moving average",
            "clock jumps",
            "length",
            "manual",
            "storage rate",
            "historian outages",
            "outliers",
        ),
        *("resampled", "saturation", "copied data"),
    }


@given(p=some.floats(0.0, 1.0))
def test_data_beyond_doubt_change_nothing(p):
    assert held_back(p, quality()) == (p, "")
    assert held_back(p, quality(("op scale",))) == (p, "")
    assert held_back(p, quality(("saturation",), first=0)) == (p, "")  # nothing was left out: the OP is known


@given(p=some.floats(0.0, 1.0), names=some.lists(some.sampled_from(LOWERING), min_size=1, unique=True))
def test_doubts_draw_towards_what_is_not_known_and_bound(p, names):
    found = held_back(p, quality(names))
    surely = found.probability < SURELY and not set(names) & {*HIDES, "op resolution"}
    assert surely or LEAST <= found.probability <= MOST or not set(names) & {*HIDES, "sampling", "op resolution"}
    low, high = UNKNOWN
    nearest = min(max(p, low), high)
    assert abs(found.probability - nearest) <= abs(p - nearest) + 1e-12
    assert (found.probability - nearest) * (p - nearest) >= -1e-15  # never to the other side
    hiding = {*HIDES, "sampling", "op resolution"} & {*names}
    assert all(name in found.why for name in (hiding if "allow" in found.why else names))
    more = held_back(p, quality([*names, "held values"]))
    assert abs(more.probability - nearest) <= abs(found.probability - nearest) + 1e-12


@given(p=some.floats(0.0, 1.0))
def test_where_much_of_the_record_is_left_out_nothing_is_sure(p):
    assert LEAST <= held_back(p, quality(first=round(1000 * (1.0 - KEPT)) + 1)).probability <= MOST
    assert held_back(p, quality(first=round(1000 * (1.0 - KEPT))), own_samples=True) == (p, "")
    assert held_back(p, quality(first=500, rows=4000)) == (p, "")


@pytest.mark.parametrize("name", BEYOND)
def test_a_little_of_what_can_hide_a_valve_hides_none(name):
    little = quality((name,), value=BEYOND[name])
    assert held_back(1e-6, little, own_samples=True).probability < LEAST / 100.0
    beyond = held_back(0.005, quality((name,), value=1.01 * BEYOND[name]))
    assert beyond == (LEAST, f"The data allow no less than 0.10 ({name}).")


@given(p=some.floats(0.0, 1.0))
def test_an_op_of_few_steps_hides_slips_whether_or_not_its_gate_lowers(p):
    coarse = one_check("op resolution", "ok", STEPS - 1.0, 20.0)
    assert held_back(p, coarse).probability == min(max(p, LEAST), MOST)
    fine = one_check("op resolution", "ok", STEPS, 20.0)
    assert held_back(p, fine) == (p, "")


@given(p=some.floats(0.0, 1.0), name=some.sampled_from(sorted(BEYOND)))
def test_what_can_hide_a_slip_does_so_beyond_a_value_whether_or_not_its_gate_lowers(p, name):
    more = one_check(name, "ok", BEYOND[name] + 1.0, 50.0)
    least = 0.0 if name in ROWS and p < PLAINLY else LEAST
    assert held_back(p, more).probability == min(max(p, least), MOST)
    few = one_check(name, "ok", BEYOND[name], 50.0)
    assert held_back(p, few) == (p, "")


def test_few_samples_for_a_cycle_hide_nothing_in_the_controllers_own_samples():
    assert held_back(0.06, quality(("sampling",))).probability == LEAST
    assert held_back(0.06, quality(("sampling",)), own_samples=True).probability < 0.08


@pytest.mark.parametrize("own_samples", [True, False])
def test_a_jump_of_the_clock_hides_a_slip_in_any_samples(own_samples):
    assert bounded(quality(("clock jumps",)), own_samples=own_samples)


@given(p=some.floats(0.0, 1.0))
def test_a_short_record_of_other_samples_than_the_controllers_is_never_sure(p):
    short = quality(first=0, rows=FEW - 1)
    least = LEAST if p >= SURELY else 0.0
    assert held_back(p, short).probability == min(max(p, least), MOST)
    assert ("few samples" in held_back(p, short).why) is not (least <= p <= MOST)
    assert held_back(p, short, own_samples=True) == (p, "")
    assert held_back(p, quality(("cycles",), first=0, rows=FEW - 1)).probability <= MOST
    assert held_back(p, quality(("clock jumps",), first=0, rows=FEW - 1)).probability >= LEAST


@given(p=some.floats(0.0, 1.0))
def test_of_a_valve_that_is_not_seen_nothing_is_sure(p):
    found = held_back(p, quality(), valve_seen=False)
    assert found.probability == min(max(p, LEAST), MOST)
    assert ("valve not seen" in found.why) is not (LEAST <= p <= MOST)


@given(p=some.floats(0.0, 0.99 * SURELY))
def test_a_faulty_transmitter_may_be_why_a_valve_is_not_seen_but_not_of_a_historians_few_samples(p):
    assert held_back(p, quality(), sensor=0.9, valve_seen=False) == (p, "")
    few = quality(first=0, rows=FEW - 1)
    assert held_back(p, few, sensor=0.9) == (p, "")
    assert held_back(p, few, sensor=0.9, valve_seen=False).probability == LEAST
    assert held_back(p, few, sensor=0.9, valve_seen=False, own_samples=True) == (p, "")


@given(p=some.floats(0.0, 1.0), others=some.sampled_from([(), (Objection.EVERY_RIVAL,)]))
def test_what_speaks_against_a_good_valve_keeps_it_from_being_surely_good(p, others):
    found = held_back(p, quality(()), against=(Objection.JUMP_LIKELY, *others))
    # Alone a likely jump does so only where little else is plain.
    held = p < LEAST and (p >= SURELY or others)
    assert found.probability == (LEAST if held else p)
    assert (Objection.JUMP_LIKELY in found.why) is bool(held)


@given(p=some.floats(0.0, 0.5))
def test_saturation_that_is_the_finding_is_no_doubt(p):
    assert held_back(p, quality(("saturation",)), saturation=0.6) == (p, "")


@given(p=some.floats(0.0, 1.0), q=some.floats(0.0, 1.0))
def test_the_order_of_two_probabilities_stays(p, q):
    low, high = sorted((p, q))
    doubts = quality(("cycles", "clock jumps"))
    assert held_back(low, doubts).probability <= held_back(high, doubts).probability


def test_the_reason_says_how_much():
    told = held_back(0.8, quality(("cycles",))).why
    assert told == "The data are in doubt (cycles), which makes 0.80 a 0.78."
    assert held_back(0.5, quality(("cycles",))).why == "The data are in doubt (cycles)."
    assert held_back(0.004, quality(("copied data",))).why == "The data allow no less than 0.10 (copied data)."
    assert held_back(0.004, quality(("copied data", "cycles"))).why == "The data allow no less than 0.10 (copied data)."
    # Of the logarithms of the odds nine tenths are kept of the way from even, and from one to three; then four fifths.
    assert odds(held_back(0.8, quality(("sampling",))).probability) == pytest.approx(4.0**0.9)
    assert odds(held_back(1 / 13, quality(("op scale", "pv resolution"))).probability) == pytest.approx(4.0**-0.9 / 3.0)
    assert odds(held_back(1 / 13, quality(("pv resolution", "cycles"))).probability) == pytest.approx(4.0**-0.72 / 3.0)
    assert held_back(0.3, quality(("sampling",))).probability == pytest.approx(0.3)


def test_every_name_is_that_of_a_gate():
    k, rng = np.arange(900.0), np.random.default_rng(1)
    record = LoopRecord("FC1", 1.0, op=50 + np.sin(k / 9) + 0.1 * rng.normal(size=900), pv=np.cos(k / 9))
    view = CheckInput(record, record, 56.5)
    names = {gate.name for check in (*LOOP_CHECKS, *STORAGE_CHECKS) if (gate := check(view)) is not None}
    names |= {"moving average", "outliers", "resampled"}  # say nothing where there is nothing to say
    assert {*HIDES, *BEYOND, "op resolution", "sampling"} <= names


@pytest.mark.parametrize(
    ("refuses", "only"),
    [
        (("saturation",), True),
        (("saturation", "length", "cycles"), True),
        (("saturation", "missing values"), False),
        (("length",), False),
        ((), False),
    ],
)
def test_a_record_refused_for_saturation_alone_is_known(refuses, only):
    assert only_saturated(quality(refuses=refuses)) is only

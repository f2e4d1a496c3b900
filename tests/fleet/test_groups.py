"""Groups and their sources: simulated plants whose truth is known, and waves made by the test."""

from __future__ import annotations

import json
import re
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import poisson

from stiction.errors import ParameterError
from stiction.fleet import LoopVerdict, common_clock, group_oscillations, make_block_means, rank_roots
from stiction.records import LoopRecord
from stiction.records.record import Provenance
from stiction.simulation.plant import simulate_plant

PLANTS = range(4)
MANY_PLANTS = range(20)


@cache
def groups_of(seed: int):
    plant = simulate_plant(seed)
    return plant, group_oscillations(plant.records)


def pair_counts(seed: int) -> np.ndarray:
    """Pairs that are right, wrong and missing; a loop that the oscillation reaches only weakly is not counted."""
    plant, groups = groups_of(seed)
    weak = {loop.record.tag for loop in plant.loops if loop.weak_group}
    true = {frozenset(pair) for tags in plant.groups.values() for pair in combinations(tags, 2)}
    tags_of = [[tag for tag in group.tags if tag not in weak] for group in groups]
    found = {frozenset(pair) for tags in tags_of for pair in combinations(tags, 2)}
    return np.array([len(true & found), len(found - true), len(true - found)])


def rank_of_root(plant, groups) -> list[int]:
    """Rank of the true source in the group that shares most loops with it."""
    ranks = []
    for root, tags in plant.groups.items():
        if len(tags) > 1:
            group = max(groups, key=lambda one: len(set(one.tags) & set(tags)))
            ranked = [candidate.tag for candidate in group.roots]
            ranks.append(ranked.index(root) if root in ranked else 99)
    return ranks


def require_bounds(seeds) -> None:
    right, wrong, missing = np.sum([pair_counts(seed) for seed in seeds], axis=0)
    assert right / (right + wrong) >= 0.9
    assert right / (right + missing) >= 0.9
    ranks = np.array([rank for seed in seeds for rank in rank_of_root(*groups_of(seed))])
    assert np.mean(ranks == 0) >= 0.8
    assert np.mean(ranks <= 1) >= 0.95


def test_plants_have_their_groups_and_sources():
    require_bounds(PLANTS)


@pytest.mark.slow
def test_many_plants_have_their_groups_and_sources():
    require_bounds(MANY_PLANTS)


def test_verdicts_and_connections_name_the_source():
    for seed in PLANTS:
        plant = groups_of(seed)[0]
        verdicts = {
            loop.record.tag: LoopVerdict(0.85 if loop.S else 0.15, 0.7 if loop.cause == "tight tuning" else 0.1)
            for loop in plant.loops
        }
        groups = group_oscillations(plant.records, verdicts=verdicts, connections=plant.connections, spans=plant.spans)
        assert set(rank_of_root(plant, groups)) == {0}


def test_block_means_give_the_same_groups_as_records():
    plant, groups = groups_of(0)
    clock = common_clock(plant.records)
    again = group_oscillations([make_block_means(record, clock) for record in plant.records])
    assert [one.to_dict() for one in again] == [one.to_dict() for one in groups]


def test_group_lists_all_parts_of_its_scores():
    group = groups_of(0)[1][0]
    row = json.loads(json.dumps(group.to_dict()))
    assert row["members"] == [root["tag"] for root in row["roots"]]
    assert sum(root["probability"] for root in row["roots"]) == pytest.approx(1.0, abs=1e-3)
    assert group.roots[0].tag in group.summary()
    for root in group.roots:
        assert all(part.text in root.why for part in root.parts)
    scores = [sum(part.log_odds for part in root.parts) for root in group.roots]
    np.testing.assert_allclose(np.subtract(scores, np.mean(scores)), [root.score for root in group.roots], atol=1e-9)


def waves(periods, *, seed=0, n=8000, spread=0.2, shared=True) -> list[LoopRecord]:
    """One loop for each period; loops of one period share the phase, which wanders, or each has its own."""
    rng = np.random.default_rng(seed)
    phases, records = {}, []
    for k, period in enumerate(periods):
        steps = 2 * np.pi / period * (1.0 + spread * np.random.default_rng(round(10 * period)).standard_normal(n))
        own = 2 * np.pi / period * (1.0 + spread * rng.standard_normal(n))
        phase = phases.setdefault(period, np.cumsum(steps)) if shared else np.cumsum(own)
        pv = np.sin(phase - 0.3 * k) + rng.normal(0.0, 0.2, n)
        records.append(LoopRecord(f"FIC-{k}", 1.0, op=50.0 - 2.0 * pv, pv=pv, sp=np.zeros(n)))
    return records


def test_loops_of_two_sources_make_two_groups():
    groups = group_oscillations(waves([40.0, 90.0, 40.0, 90.0, 90.0, 61.0]))
    assert [set(group.tags) for group in groups] == [{"FIC-1", "FIC-3", "FIC-4"}, {"FIC-0", "FIC-2"}]


def test_loops_with_the_same_period_but_phases_of_their_own_make_no_group():
    assert group_oscillations(waves([40.0] * 6, spread=1.0, shared=False)) == ()


def test_record_too_short_for_two_periods_says_so():
    """8000 s resolve 40^2 / 8000 = 0.2 s at 40 s; periods dT apart need T^2 / dT."""
    alone = waves([40.1], spread=0.0, seed=5)[0]
    records = [*waves([40.0] * 4, spread=0.5), LoopRecord("LIC-9", 1.0, op=alone.op, pv=alone.pv, sp=alone.sp)]
    group = group_oscillations(records, min_coherence=0.9)[0]
    assert set(group.tags) == {"FIC-0", "FIC-1", "FIC-2", "FIC-3"}
    assert group.resolution == pytest.approx(0.2, rel=0.02)
    assert group.remark.startswith("1 more oscillation ")
    resolution, apart, needed, length = (float(x) for x in re.findall(r"([\d.]+) (?:s|h)\b", group.remark))
    assert (resolution, length) == pytest.approx((0.2, 8000 / 3600), rel=0.02)
    assert apart * needed * 3600.0 == pytest.approx(40.1**2, rel=0.2)
    assert group_oscillations(records[:4])[0].remark == ""


def test_chance_is_the_tail_of_the_poisson_distribution():
    """Two loops at 40 s beside three unrelated ones within 20 % in log T: lambda = 3 / 0.4 * 2 * 40 / 8000."""
    records = waves([40.0, 40.0, 36.0, 44.0, 47.0], spread=0.1)
    group = group_oscillations(records, max_chance=1.0)[0]
    assert set(group.tags) == {"FIC-0", "FIC-1"}
    assert group.chance == pytest.approx(poisson.sf(0, 3 / 0.4 * 2 * 40 / 8000), rel=0.02)
    assert group_oscillations(records, max_chance=0.01) == ()


def test_secondary_loop_comes_before_its_primary():
    primary, secondary = waves([40.0, 40.0], spread=0.0)
    primary = LoopRecord(
        "TIC-1", 1.0, op=primary.op, pv=primary.pv, sp=primary.sp, provenance=Provenance(secondary_tag="FIC-1")
    )
    clock = common_clock([primary, secondary])
    means = [make_block_means(one, clock) for one in (primary, secondary)]
    parts = {root.tag: {part.name: part.log_odds for part in root.parts} for root in rank_roots(means, 40.0)}
    assert parts["FIC-1"]["cascade"] == 1.0
    assert parts["TIC-1"]["cascade"] == -1.0


def test_connections_count_through_loops_outside_the_group():
    clock = common_clock(records := waves([40.0] * 3))
    means = [make_block_means(one, clock) for one in records]
    links = [("FIC-0", "LIC-5"), ("LIC-5", "FIC-1"), ("FIC-1", "FIC-2")]
    reach = {
        root.tag: next(part.value for part in root.parts if part.name == "reach")
        for root in rank_roots(means, 40.0, connections=links)
    }
    assert reach == {"FIC-0": 1.0, "FIC-1": 0.5, "FIC-2": 0.0}


def test_nothing_is_grouped_in_quiet_loops():
    rng = np.random.default_rng(0)
    quiet = [LoopRecord(f"FIC-{k}", 1.0, op=rng.normal(50, 1, 4000), pv=rng.normal(3, 1, 4000)) for k in range(20)]
    assert group_oscillations(quiet) == ()
    assert group_oscillations([]) == ()


@pytest.mark.parametrize(
    ("options", "words"),
    [({"min_coherence": 1.5}, "min_coherence"), ({"bin_width": 0.5}, "bin_width"), ({"max_blocks": 0}, "max_blocks")],
)
def test_numbers_outside_their_limits_are_refused(options, words):
    with pytest.raises(ParameterError, match=words):
        group_oscillations(waves([40.0, 40.0]), **options)


def test_two_loops_of_one_tag_are_refused():
    one = waves([40.0])[0]
    with pytest.raises(ParameterError, match="FIC-0"):
        group_oscillations([one, one])


def test_no_probability_is_refused():
    with pytest.raises(ParameterError, match="stiction"):
        LoopVerdict(stiction=1.2)

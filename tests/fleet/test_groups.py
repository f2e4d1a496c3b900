"""Groups and their sources: simulated plants whose truth is known, and waves made by the test."""

from __future__ import annotations

import json
from functools import cache
from itertools import combinations

import numpy as np
import pytest

from fleet.unrelated_loops import draw_unrelated_loops
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
        said = [part.text for part in root.parts if part.text in root.why]
        assert root.why == " ".join(sorted(said, key=root.why.index)) or root.why.startswith("Nothing points to")
        assert all(text.endswith(".") and text[0].isupper() for text in said)
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


def test_steady_waves_of_one_period_make_no_group_without_a_connection():
    """Two steady waves cohere at every shift: that shows no connection, unless one is listed."""
    records = waves([40.0, 40.0, 40.01], spread=0.0)
    assert group_oscillations(records) == ()
    [group] = group_oscillations(records, connections=[("FIC-0", "LIC-7"), ("LIC-7", "FIC-1")])
    assert set(group.tags) == {"FIC-0", "FIC-1"}
    assert group.similar == ("FIC-2",)
    assert {one.through for one in group.members} == {"", "through LIC-7"} or group.roots[0].tag == "FIC-1"
    assert "Similar periods, connection not shown: FIC-2." in group.summary()


def share_of_grouped_pairs(seed: int, count: int, periods: tuple[float, float], samples: int) -> float:
    records = draw_unrelated_loops(seed, count, *periods, samples=samples)
    pairs = sum(len(group.tags) * (len(group.tags) - 1) / 2 for group in group_oscillations(records))
    return pairs / (count * (count - 1) / 2)


@pytest.mark.parametrize(("periods", "samples"), [((188.0, 202.0), 4320), ((560.0, 600.0), 4320)])
def test_unrelated_loops_with_similar_periods_are_not_grouped(periods, samples):
    """The bound is a twentieth of the pairs; the periods are those of four loops that were grouped once."""
    assert max(share_of_grouped_pairs(seed, 40, periods, samples) for seed in range(2)) <= 0.05
    assert share_of_grouped_pairs(7, 4, periods, samples) == 0.0


@pytest.mark.slow
def test_many_sets_of_unrelated_loops_are_not_grouped():
    shares = [
        share_of_grouped_pairs(seed, 40, periods, samples)
        for seed in range(20)
        for periods, samples in (((188.0, 202.0), 4320), ((560.0, 600.0), 4320), ((188.0, 202.0), 1440))
    ]
    assert max(shares) <= 0.05


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

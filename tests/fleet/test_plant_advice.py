"""What a planner is told about simulated plants whose truth is known."""

from __future__ import annotations

import pytest

import stiction as st
from stiction.apps.demo_plant import write_plant_files
from stiction.simulation.plant import simulate_plant

CHANGES = ("repair", "retune")
"""Kinds of work that change the loop; a test leaves it as it was."""
FAULTS = ("stiction", "tight tuning")


def audit_plant(seed: int, folder):
    plant = simulate_plant(seed)
    data, tags, links = write_plant_files(plant, folder)
    return plant, st.audit(data, folder / "audit", map=tags, connections=links, workers=2)


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(1, 21), range(21, 41)], ids=["1 to 20", "21 to 40"])
def test_twenty_plants_begin_with_a_source_and_change_no_other_loop(seeds, tmp_path):
    first = 0
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        plant, audit = audit_plant(seed, folder)
        first += audit.rows[0].tag in plant.groups
        healthy = {loop.record.tag for loop in plant.loops if loop.cause not in FAULTS and loop.state == "in_control"}
        changed = [item.tag for item in st.work_list(audit) if item.tag in healthy and item.kind in CHANGES]
        unclear = [tag for group in audit.groups if len(group["leading_roots"]) > 1 for tag in group["leading_roots"]]
        assert set(changed) <= set(unclear), (seed, changed)
    assert first >= 18

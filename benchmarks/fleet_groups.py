"""Groups and sources in simulated plants, audited with map and connections: `python benchmarks/fleet_groups.py`.

Prints precision and recall of the pairs of loops in one group, and how often the true source comes first and among the
first two. A loop that an oscillation reaches only weakly is not counted.
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import combinations
from pathlib import Path

import numpy as np

import stiction as st
from stiction.apps.demo_plant import write_plant_files
from stiction.simulation.plant import simulate_plant


def measure(seed: int, workers: int) -> tuple[np.ndarray, list[int]]:
    """Audit one plant: pairs that are right, wrong and missing, and the rank of the true source of each group."""
    plant = simulate_plant(seed)
    with tempfile.TemporaryDirectory() as folder:
        data, map_file, links = write_plant_files(plant, Path(folder))
        found = st.audit(data, Path(folder, "audit"), map=map_file, connections=links, workers=workers)
    weak = {loop.record.tag for loop in plant.loops if loop.weak_group}
    true = {frozenset(pair) for tags in plant.groups.values() for pair in combinations(tags, 2)}
    members = [[tag for tag in group["members"] if tag not in weak] for group in found.groups]
    pairs = {frozenset(pair) for tags in members for pair in combinations(tags, 2)}
    ranks = []
    for root, tags in plant.groups.items():
        if len(tags) > 1:
            shared = [len(set(group["members"]) & set(tags)) for group in found.groups]
            roots = [one["tag"] for one in found.groups[int(np.argmax(shared))]["roots"]] if shared else []
            ranks.append(roots.index(root) if root in roots else 99)
    return np.array([len(true & pairs), len(pairs - true), len(true - pairs)]), ranks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    counts, ranks = np.zeros(3), []
    for seed in range(asked.plants):
        pairs, places = measure(seed, asked.workers)
        counts, ranks = counts + pairs, ranks + places
        print(f"plant {seed}: pairs right, wrong, missing {pairs}, ranks of the sources {places}", flush=True)
    right, wrong, missing = counts
    first, two = np.mean(np.array(ranks) == 0), np.mean(np.array(ranks) <= 1)
    print(f"precision {right / (right + wrong):.3f}, recall {right / (right + missing):.3f}")
    print(f"{len(ranks)} sources: first {first:.3f}, among the first two {two:.3f}")


if __name__ == "__main__":
    main()

"""Many loops: block means of their signals, numbers of each loop, oscillations that loops share, and their source."""

from stiction.fleet.block_means import BlockMeans, Clock, common_clock, make_block_means
from stiction.fleet.group import Group, Member, RootCandidate, RootEvidence
from stiction.fleet.loop_metrics import LoopMetrics, compute_priority, loop_metrics
from stiction.fleet.oscillation_groups import group_oscillations
from stiction.fleet.root_cause import LoopVerdict, RootWeights, rank_roots

__all__ = [
    "BlockMeans",
    "Clock",
    "Group",
    "LoopMetrics",
    "LoopVerdict",
    "Member",
    "RootCandidate",
    "RootEvidence",
    "RootWeights",
    "common_clock",
    "compute_priority",
    "group_oscillations",
    "loop_metrics",
    "make_block_means",
    "rank_roots",
]

"""Many loops: audits of whole plants, numbers of each loop, oscillations that loops share, and their source."""

from stiction.fleet.audit_options import AuditOptions
from stiction.fleet.audit_result import Audit, open_audit
from stiction.fleet.block_means import BlockMeans, Clock, common_clock, make_block_means
from stiction.fleet.compare import compare_audits, confirmed_share
from stiction.fleet.exports import write_exports
from stiction.fleet.find_loops import find_loop_places
from stiction.fleet.group import Group, Member, RootCandidate, RootEvidence
from stiction.fleet.labels import Label, LabelConflictError, append_label, read_labels
from stiction.fleet.loop_metrics import LoopMetrics, compute_priority, loop_metrics
from stiction.fleet.loop_row import LoopRow
from stiction.fleet.oscillation_groups import group_oscillations
from stiction.fleet.plant_audit import audit
from stiction.fleet.progress import Progress
from stiction.fleet.root_cause import LoopVerdict, RootWeights, rank_roots
from stiction.fleet.source_parts import LoopPlace
from stiction.fleet.work_list import WorkItem, work_list

__all__ = [
    "Audit",
    "AuditOptions",
    "BlockMeans",
    "Clock",
    "Group",
    "Label",
    "LabelConflictError",
    "LoopMetrics",
    "LoopPlace",
    "LoopRow",
    "LoopVerdict",
    "Member",
    "Progress",
    "RootCandidate",
    "RootEvidence",
    "RootWeights",
    "WorkItem",
    "append_label",
    "audit",
    "common_clock",
    "compare_audits",
    "compute_priority",
    "confirmed_share",
    "find_loop_places",
    "group_oscillations",
    "loop_metrics",
    "make_block_means",
    "open_audit",
    "rank_roots",
    "read_labels",
    "work_list",
    "write_exports",
]

"""A group of loops with one oscillation, its members, and the loops that may be its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from stiction.display.duration_format import format_seconds
from stiction.display.json_form import FOUR_DECIMALS, Result, json_as
from stiction.display.result_display import ResultDisplay

__all__ = ["Group", "Member", "RootCandidate", "RootEvidence"]


@dataclass(frozen=True, slots=True)
class Member:
    """One loop of a group."""

    tag: str
    """Tag of the loop."""
    period: float = field(metadata=json_as("period_s"))
    """Period that the loop itself shows [s]."""
    regularity: float
    """Thornhill's regularity r [-]; above 1 is regular."""
    signal: str
    """Signal that shows the oscillation best: "error" or "op"."""
    coherence: float = field(metadata=FOUR_DECIMALS)
    """Coherence of the envelope with the common oscillation of the group [-]."""
    phase: float = field(metadata=json_as("phase_deg", digits=2))
    """Phase of that signal against the common oscillation [deg], from -180 to 180; a later signal has a lower one."""


@dataclass(frozen=True, slots=True)
class RootEvidence(Result):
    """One part of the score of a loop as the source of a group."""

    name: str
    """What was looked at, such as "harmonics"."""
    value: float
    """Its value; the unit is in `text`."""
    log_odds: float = field(metadata=json_as(digits=3))
    """What it adds to the score [-]."""
    text: str
    """The finding in a few words."""


@dataclass(frozen=True, slots=True)
class RootCandidate(Result):
    """A loop that may be the source of a group's oscillation."""

    _json_keys = ("tag", "score", "probability", "why", "parts")

    tag: str
    """Tag of the loop."""
    score: float = field(metadata=json_as(digits=3))
    """Log odds against the other loops of the group, the sum of `parts` less their mean over the group [-]."""
    probability: float = field(metadata=FOUR_DECIMALS)
    """Probability that it is the source, if one of the group's loops is [-]."""
    parts: tuple[RootEvidence, ...]
    """What the score is made of."""

    @property
    def why(self) -> str:
        """The parts in words, the strongest first."""
        ordered = sorted(self.parts, key=lambda part: -abs(part.log_odds))
        return "; ".join(f"{part.text} ({part.log_odds:+.1f})" for part in ordered)


@dataclass(frozen=True, slots=True)
class Group(ResultDisplay, kind="group"):
    """Loops that share one oscillation."""

    _json_keys = (
        "period as period_s", "tags as members", "members as member_details", "perhaps_also", "roots",
        "leading_tags as leading_roots", "floor as coherence_floor", "resolution as resolution_s", "chance", "remark",
    )  # fmt: skip

    period: float
    """Period, median over the members [s]."""
    members: tuple[Member, ...]
    """Loops of the group, the most likely source first."""
    perhaps_also: tuple[str, ...]
    """Tags of loops that cohere with the group but are not regular themselves."""
    roots: tuple[RootCandidate, ...]
    """All members as source, the likeliest first."""
    floor: float = field(metadata=FOUR_DECIMALS)
    """Coherence from which two loops counted as related [-]."""
    resolution: float
    """Difference of two periods that the record just resolves, T^2 over its length [s]."""
    chance: float = field(default=0.0, metadata=FOUR_DECIMALS)
    """Probability that so many unrelated loops have the same period by chance [-]."""
    remark: str = ""
    """Which other periods the record is too short to tell from this one; empty where there are none."""

    @property
    def tags(self) -> tuple[str, ...]:
        """Tags of the members."""
        return tuple(member.tag for member in self.members)

    def leading_roots(self, *, clear_lead: float = 0.7) -> tuple[RootCandidate, ...]:
        """Return the source when its probability is `clear_lead` [-] or more, else the two likeliest loops."""
        return self.roots[: 1 if self.roots[0].probability >= clear_lead else 2]

    @property
    def leading_tags(self) -> tuple[str, ...]:
        """Tags of the source, or of the two likeliest loops."""
        return tuple(root.tag for root in self.leading_roots())

    def summary(self) -> str:
        """The group in a few sentences."""
        first, *second = self.leading_roots()
        if second:
            root = f"The source is one of these two: {first.tag} or {second[0].tag}. Check {first.tag} first."
        else:
            root = (
                f"The most likely source is {first.tag} (probability {first.probability:.2f}). Correct it first, then "
                "run the audit again."
            )
        also = f" Perhaps also: {', '.join(self.perhaps_also)}." if self.perhaps_also else ""
        evidence = " ".join(f"Evidence for {one.tag}: {one.why}." for one in (first, *second))
        remark = f" {self.remark}" if self.remark else ""
        return (
            f"{len(self.members)} loops oscillate together every {format_seconds(self.period)}: "
            f"{', '.join(self.tags)}.{also} {root} {evidence}{remark}"
        )

"""A group of loops with one oscillation, its members, and the loops that may be its source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stiction.display.duration_format import format_seconds
from stiction.display.result_display import ResultDisplay

__all__ = ["Group", "Member", "RootCandidate", "RootEvidence"]


@dataclass(frozen=True, slots=True)
class Member:
    """One loop of a group."""

    tag: str
    """Tag of the loop."""
    period: float
    """Period that the loop itself shows [s]."""
    regularity: float
    """Thornhill's regularity r [-]; above 1 is regular."""
    signal: str
    """Signal that shows the oscillation best: "error" or "op"."""
    coherence: float
    """Coherence of the envelope with the common oscillation of the group [-]."""
    phase: float
    """Phase of that signal against the common oscillation [deg], from -180 to 180; a later signal has a lower one."""


@dataclass(frozen=True, slots=True)
class RootEvidence:
    """One part of the score of a loop as the source of a group."""

    name: str
    """What was looked at, such as "harmonics"."""
    value: float
    """Its value; the unit is in `text`."""
    log_odds: float
    """What it adds to the score [-]."""
    text: str
    """The finding in a few words."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {"name": self.name, "value": self.value, "log_odds": round(self.log_odds, 3), "text": self.text}


@dataclass(frozen=True, slots=True)
class RootCandidate:
    """A loop that may be the source of a group's oscillation."""

    tag: str
    """Tag of the loop."""
    score: float
    """Log odds against the other loops of the group, the sum of `parts` less their mean over the group [-]."""
    probability: float
    """Probability that it is the source, if one of the group's loops is [-]."""
    parts: tuple[RootEvidence, ...]
    """What the score is made of."""

    @property
    def why(self) -> str:
        """The parts in words, the strongest first."""
        ordered = sorted(self.parts, key=lambda part: -abs(part.log_odds))
        return "; ".join(f"{part.text} ({part.log_odds:+.1f})" for part in ordered)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "tag": self.tag,
            "score": round(self.score, 3),
            "probability": round(self.probability, 4),
            "why": self.why,
            "parts": [part.to_dict() for part in self.parts],
        }


@dataclass(frozen=True, slots=True)
class Group(ResultDisplay, kind="group"):
    """Loops that share one oscillation."""

    period: float
    """Period, median over the members [s]."""
    members: tuple[Member, ...]
    """Loops of the group, the most likely source first."""
    perhaps_also: tuple[str, ...]
    """Tags of loops that cohere with the group but are not regular themselves."""
    roots: tuple[RootCandidate, ...]
    """All members as source, the likeliest first."""
    floor: float
    """Coherence from which two loops counted as related [-]."""
    resolution: float
    """Difference of two periods that the record just resolves, T^2 over its length [s]."""
    chance: float = 0.0
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

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        members = [
            {
                "tag": one.tag,
                "period_s": one.period,
                "regularity": one.regularity,
                "signal": one.signal,
                "coherence": round(one.coherence, 4),
                "phase_deg": round(one.phase, 2),
            }
            for one in self.members
        ]
        return {
            "period_s": self.period,
            "members": list(self.tags),
            "member_details": members,
            "perhaps_also": list(self.perhaps_also),
            "roots": [root.to_dict() for root in self.roots],
            "leading_roots": [root.tag for root in self.leading_roots()],
            "coherence_floor": round(self.floor, 4),
            "resolution_s": self.resolution,
            "chance": round(self.chance, 4),
            "remark": self.remark,
        }

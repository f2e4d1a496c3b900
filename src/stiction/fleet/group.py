"""A group of loops with one oscillation, its members, and the loops that may be its source."""

from __future__ import annotations

from dataclasses import dataclass, field

from stiction.display.duration_format import format_duration
from stiction.display.json_form import FOUR_DECIMALS, Result, json_as
from stiction.display.number_format import count_noun, format_probability
from stiction.display.result_display import ResultDisplay

__all__ = ["Group", "Member", "RootCandidate", "RootEvidence"]


MIN_SAID, MAX_SAID = 0.3, 3
"""Log odds from which a finding is said, and how many are said [-]."""


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
    through: str = ""
    """How the oscillation comes from the likeliest source, in words; empty of the source."""


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
    """The finding as a sentence."""


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
        """Up to three findings that point to this loop, the strongest first, as sentences."""
        ordered = sorted((part for part in self.parts if part.log_odds >= MIN_SAID), key=lambda part: -part.log_odds)
        return " ".join(part.text for part in ordered[:MAX_SAID]) or "Nothing points to this loop more than to others."


@dataclass(frozen=True, slots=True)
class Group(ResultDisplay, kind="group"):
    """Loops that share one oscillation."""

    _json_keys = (
        "period as period_s", "tags as members", "members as member_details", "perhaps_also", "similar", "roots",
        "leading_tags as leading_roots", "floor as coherence_floor",
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
    similar: tuple[str, ...] = ()
    """Tags of other loops with a similar period; a connection with the group is not shown."""

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
            root = (
                f"The source is {first.tag} or {second[0].tag}: put {first.tag} in manual for three periods; if "
                f"{second[0].tag} goes on swinging, it is the source."
            )
        else:
            root = f"The source is probably {first.tag} ({format_probability(first.probability)}). Put it right first."
        leading = {one.tag for one in (first, *second)}
        followers = [tag for tag in self.tags if tag not in leading]
        verb = "follows: look at it" if len(followers) == 1 else "follow: look at them"
        parts = [
            f"{count_noun(len(self.members), 'loop')} oscillate together every {format_duration(self.period)}.",
            root,
            *(f"Why {one.tag}: {one.why}" for one in (first, *second)),
            f"{', '.join(followers)} {verb} again after that." if followers else "",
            f"Perhaps also: {', '.join(self.perhaps_also)}." if self.perhaps_also else "",
            f"Similar periods, connection not shown: {', '.join(self.similar)}." if self.similar else "",
        ]
        return " ".join(part for part in parts if part)

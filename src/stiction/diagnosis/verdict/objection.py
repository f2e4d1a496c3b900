"""What keeps a verdict from being sure, beside the gates: members to compare, whose words are free to change."""

from __future__ import annotations

from enum import StrEnum, unique

__all__ = ["Objection"]


@unique
class Objection(StrEnum):
    """An objection to a sure verdict, as it is told.

    Examples
    --------
    >>> f"The data allow no more than 0.90 ({Objection.FEW_SAMPLES})."
    'The data allow no more than 0.90 (few samples).'
    """

    MUCH_LEFT_OUT = "much left out"
    """Of the record less than `doubt.KEPT` is analysed."""
    FEW_SAMPLES = "few samples"
    """Fewer than `doubt.FEW`, not the controller's own."""
    NOT_SEEN = "valve not seen"
    """OP explains next to nothing, and no fault is seen that explains why (`contradiction.explains_nothing`)."""
    PV_LATE = "PV stored late"
    """PV was stored some samples late (`in_step.samples_late`)."""
    NO_LAW = "no controller explains OP"
    """OP is not what a controller made of this PV (`contradiction.UNLAWFUL`)."""
    JUMP_LIKELY = "a jump is likely"
    """Against a good valve: its jump is beyond chance."""
    JUMP_PLAIN = "a jump is plain"
    """Against a good valve: a jump beyond `contradiction.PLAIN_JUMP`, whatever else is wrong with the loop."""
    MUCH_MORE = "a sticky valve explains much more"
    """Against a good valve: beyond `contradiction.MUCH_MORE`."""
    EVERY_RIVAL = "a sticky valve beats every rival"
    """Against a good valve: beyond `contradiction.BEATS_EVERY`."""
    PREDICTS = "a sticky valve predicts the PV"
    """Against a good valve: beyond `contradiction.PREDICTS`, though something else may drive the loop."""
    BESIDE_WAVE = "beside a wave from outside a sticky valve predicts the PV better"
    """Against a good valve: beyond `contradiction.BEATS_EVERY`, with a jump, where nothing else is wrong."""
    JUMP_OPEN = "play and stiction differ by J, which other samples than the controller's hardly tell"
    """Against a good valve: what speaks for one is play."""
    SLIPS_DROWN = "samples not seen to be the controller's"
    """Against a good valve: values such as a plant's historian keeps (`contradiction.LIKE_A_PLANTS`)."""
    STANDS_STILL = "the valve's position stands still"
    """Against a good valve: by it the stem may be stuck fast (`contradiction.STILL`)."""
    ANOTHER_STEM = "the valve's position does not go with OP"
    """Against a good valve: its stem would; the position is another valve's, or the stem sticks."""
    NOT_ITS_OWN = "the loop found makes no such cycle"
    """Against a sticking valve: the loop found does not make its regular cycle (`contradiction.OWN_CYCLE`)."""
    NO_JUMP = "the valve does not jump"
    """Against a sticking valve: to within `contradiction.NO_JUMP` it has play only."""
    NOTHING_EXPLAINED = "OP explains next to nothing"
    """Against a sticking valve: less than `contradiction.BY_CHANCE`."""
    MOST_OF_IT = "a good valve with something more predicts most of it"
    """Against a sticking valve: a bent or gated good one takes `contradiction.TAKEN` of what it adds to a good one."""
    SMALL_BAND = "the band is small beside what OP moves, and a good valve explains as much"
    """Against a sticking valve: such a band (`contradiction.SMALL`) says nothing of it."""
    FEW_TURNS = "OP seldom turns round in a short record"
    """Against a sticking valve: friction shows nowhere else, and a load that wanders looks like it
    (`contradiction.SHORT`)."""
    AS_MUCH = "a good valve explains as much"
    """Against a sticking valve: a good one explains as much of the PV."""

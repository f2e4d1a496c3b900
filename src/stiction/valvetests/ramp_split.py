"""The ramps of a test, found in the OP."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.valvetests.segmentation import Segment, segment_signal
from stiction.valvetests.stem_signal import reject_feedback

if TYPE_CHECKING:
    from stiction.valvetests.stem_signal import StemSignal

__all__ = ["OpRamp", "find_ramps"]

MIN_RAMP_TRAVEL = 0.5
"""Smallest OP travel of a ramp [% of span]."""
MIN_RAMP_SAMPLES = 20
"""Smallest number of samples of a ramp [-]."""
MAX_OP_NOISE = 0.5
"""OP noise above which the OP is not a test signal [% of span]."""
MAX_RATE_DIFFERENCE = 0.25
"""Neighbouring lines whose rates differ by less than this share are one ramp [-]."""
RAMP_TEST_NEEDS = ("a ramp test needs the loop in manual and a straight OP: see ", Setting("plan_ramp_test"), ".")


@dataclass(frozen=True, slots=True)
class OpRamp:
    """One straight rise or fall of the OP."""

    line: Segment
    """The OP as a straight line [% of span]."""

    @property
    def rate(self) -> float:
        """Rate [% of span / s]."""
        return self.line.slope

    @property
    def direction(self) -> int:
        """1 rising, -1 falling."""
        return 1 if self.line.slope > 0.0 else -1

    @property
    def op_start(self) -> float:
        """OP at the start [% of span]."""
        return self.line.at(self.line.start)

    @property
    def op_end(self) -> float:
        """OP at the end [% of span]."""
        return self.line.at(self.line.end)


def find_ramps(reading: StemSignal, tag: str) -> tuple[tuple[OpRamp, ...], list[Segment]]:
    """Ramps of the OP, and the whole OP as segments.

    Raises RecordError when the OP has no ramp or reacts to PV.
    """
    if reading.op_sigma > MAX_OP_NOISE and reading.op_step < MAX_OP_NOISE:
        raise RecordError(
            f"The OP of {tag} moves by {reading.op_sigma:.2g} % from sample to sample and has no ramp (is the loop in "
            "automatic?); ",
            *RAMP_TEST_NEEDS,
            " For a record of normal operation use diagnose.",
        )
    reject_feedback(reading, tag, RAMP_TEST_NEEDS)
    pieces = _join_ramps(segment_signal(reading.time, reading.op, reading.op_sigma))
    ramps = tuple(OpRamp(piece) for piece in pieces if _is_ramp(piece, reading.op_sigma))
    if not ramps:
        rests = sum(piece.slope == 0.0 for piece in pieces)
        if rests >= 3:
            raise RecordError(
                f"The OP of {tag} moves in steps (constant {rests} times), not in ramps; use ",
                Setting("analyse_steps"),
                ". A step test cannot measure the rate r: see ",
                Setting("plan_ramp_test"),
                ".",
            )
        swing = float(np.ptp(reading.op))
        raise RecordError(
            f"The OP of {tag} has no ramp of {MIN_RAMP_TRAVEL} % and {MIN_RAMP_SAMPLES} samples (its range is "
            f"{swing:.3g} %)",
            remedy=("move it up and down as in the plan of ", Setting("plan_ramp_test")),
        )
    return ramps, pieces


def _is_ramp(piece: Segment, sigma: float) -> bool:
    travel = abs(piece.slope) * (piece.end - piece.start)
    return piece.n >= MIN_RAMP_SAMPLES and travel >= max(MIN_RAMP_TRAVEL, 5.0 * sigma)


def _join_ramps(pieces: list[Segment]) -> list[Segment]:
    """Join neighbouring lines of about the same rate that meet."""
    joined: list[Segment] = []
    for piece in pieces:
        before = joined[-1] if joined else None
        if before is not None and before.slope * piece.slope > 0.0 and _is_same_rate(before.slope, piece.slope):
            slope = (piece.at(piece.end) - before.at(before.start)) / (piece.end - before.start)
            level = 0.5 * (piece.at(piece.end) + before.at(before.start))
            joined[-1] = replace(before, last=piece.last, end=piece.end, slope=slope, level=level)
        else:
            joined.append(piece)
    return joined


def _is_same_rate(a: float, b: float) -> bool:
    return abs(a - b) <= MAX_RATE_DIFFERENCE * max(abs(a), abs(b))

r"""What a recorded valve position shows, and its weight in the verdict.

A position is used where it is one: it moves (not `frozen`, nor `hangs`, where PV follows its set point all the same),
goes with OP (not `unrelated`: another valve's), is more than OP itself (not an `echo`, a positioner's set point), and
some valve leaves little of it (not `unclear`). Else the record is judged as without it.

`identification.position` gives what the best valve that follows, the best with play and the best that sticks leave of
it: :math:`E_g, E_d, E_s`, `LITTLE` added to each. With n turns of the stem log odds are made of them,

.. math:: \ell_b = a_0 + a_1 \ln\frac{E_g}{\min(E_d, E_s)}, \quad
    \ell_j = b_0 + b_1 \tanh\Big(\frac{n}{m} \ln\frac{E_d}{E_s}\Big) + b_2 \frac{J}{S}

for a band against none, and for a jump in it against none. Where OP swings so far that a tenth of it is no small band
(`position.SMALL`), what a valve leaves is also measured by the noise that a narrower swing would let it have
(`Watching.finer`): a jump is judged by that, and a band by whichever says less of it. What is taken for noise grows
with OP's swing, which hides a jump, and keeps what no model of a good valve follows from being a band. With the other
findings' probabilities p,

.. math:: P(\text{band}) \propto (p_s + p_d)\, e^{\ell_b}, \quad P(c) \propto p_c, \quad
    \text{logit}\,\frac{P(\text{stiction})}{P(\text{band})} = \ln\frac{p_s}{p_d} + \ell_j

That is Bayes' rule for findings that are independent once the valve is known: what a valve of a given kind leaves of
the position is the transmitter's noise and rounding, of which the PV knows nothing. Three bounds guard it. A position
says no more than `MOST` of a band, since it may be something else than its name in a way that no check sees. The other
findings say no more than `AGAINST` against one: a wave from outside shows in the PV whatever the valve does. And they
say no more than `OTHERS` of a jump: they know play from integrating loops only, and the position sees it.

The numbers are logistic regressions, both outcomes weighing the same, on 2 060 loops of `simulation.population` (seeds
501 to 504, `position=True`), those of a jump on the 602 of them that have a band; a good valve's S was then bounded by
a tenth of OP's swing alone, as it still is where that is at most `position.SMALL` or hidden in noise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.interval import CHI2_1
from stiction.diagnosis.identification.position import SMALL, longest_seen, noise_of, watch
from stiction.diagnosis.identification.signals import hold_gaps
from stiction.diagnosis.result import Counted, Evidence
from stiction.records.quality.compression import exception_deviation
from stiction.records.quality.quantisation import quantisation_step, robust_range
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.position import Watched, Watching
    from stiction.diagnosis.identified import Identification
    from stiction.diagnosis.result import Verdict
    from stiction.records.record import LoopRecord

__all__ = ["BY_POSITION", "Shown", "stem_shown"]

BY_POSITION = "S and J are those of the recorded valve position."
"""What limits S and J that the position tells."""
BAND = (-1.16, 18.8)
"""a0 and a1: log odds of a band where both valves leave the same, and for each factor e between them [-]."""
JUMPS, TURNS = (-1.61, 2.57, 6.42), 8.0
"""b0, b1 and b2: log odds of a jump [-]; m: turns of the stem with which a factor e between them says most of what it
can [-]."""
AGAINST, OTHERS = 5.0, 1.5
"""Largest log odds that the other findings have against a band, and of sticking against play [-]: probabilities of
0.993 and 0.82."""
LITTLE = 0.05
"""Added to what is left, so that a perfect fit is no better than a good one [squares of the noise]."""
MOST = 7.0
"""Largest log odds of a band that a position speaks with [-], a probability of 0.999: more than `AGAINST`."""
FEWEST = 60
"""Samples of the position below which it is not used [-]."""
EXPLAINED = 0.16
"""Share of the position's variance below which it is another valve's [-]: of 224 of those one was explained further,
of 212 stems of the valve itself four were not (`simulation.population`, seeds 813 and 2501)."""
PLAINLY = 99.0
"""Share of the position's variance that a sticky valve explains, of a stem that turned `TURNS` times or more, from
which it is no other valve's [%]: where OP goes along with a wave from outside, a stem that rests in its band hardly
goes with OP. Of 118 positions of another valve (seed 61, `position="another"`) none is explained beyond 96, of those
that turned so often none beyond 93."""
UNCLEAR = 6.0
"""Squares of the noise [-] that the best valve may leave; 99 in 100 good ones and 97 in 100 with a band leave less."""
WHITE, WITHIN = 0.8, 0.5
"""Share of a position's deviation from which it is noise alone, and of OP's swing that this noise may swing over, of a
stem that stands still [-]."""
STANDS_STILL = (
    "The recorded valve position stands still while OP moves: its transmitter hangs, or the stem is stuck fast. Look "
    "at the valve; the record is judged without the position."
)
"""What is told of such a one."""
FOLLOWS = 0.5
"""Share of the set point's variance that PV takes away by following it, from which the stem moves [-]: a wave from
outside adds to it."""
HANGS = (
    "The recorded valve position stands still while PV follows its set point, as it cannot with a stem that is stuck: "
    "its transmitter hangs. Repair it; the record is judged without the position."
)
"""What is told of a position that stands still then."""
ROUNDING = 0.6
"""Deviation from OP, in resolutions of the position, up to which 99 in 100 samples of an echo lie [-]."""
SEEN, UNSEEN = (8.0, 0.04), (32.0, 0.22)
"""How much further than a likelihood region of 95 % the intervals reach where the record shows the controller's own
samples, and where OP between them trips the valve unseen: as a factor of the log likelihood, and beyond that as a share
of S [-]. By how often they hold S: 0.97 of 320 and 0.96 of 137 simulated sticky valves without mass (seeds 1901 and
1902 of `simulation.population` with `position="stem"`)."""


class Shown(NamedTuple):
    """What a recorded position shows."""

    what: str
    """`stiction`, `deadband` or `good`; or why it is not used: `missing`, `frozen`, `hangs`, `unrelated`, `echo`,
    `unclear`."""
    why: str
    """That in a sentence."""
    watching: Watching | None = None
    """The valves that explain it best; None where there is no telling, or it is another valve's."""
    band: float = 0.0
    """Log odds of a valve with a band against one that follows [-]."""
    jump: float = 0.0
    """Log odds of one that sticks against one with play [-]."""
    swing: float = 1.0
    """OP's swing [% of span]."""

    @property
    def used(self) -> bool:
        """Whether the position counts."""
        return self.what in ("stiction", "deadband", "good")

    @property
    def valve(self) -> Watched:
        """The valve that it shows."""
        assert self.watching is not None
        return getattr(self.watching, self.what)

    def weighed(self, causes: dict[str, float]) -> dict[str, float]:
        """Probabilities of the causes with the position taken into account.

        Parameters
        ----------
        causes : dict
            Cause -> probability without it [-].

        Returns
        -------
        dict
            The same causes -> probability [-]; they sum to 1.

        Examples
        --------
        >>> told = Shown("stiction", "", None, 3.0, 2.0).weighed({"stiction": 0.2, "deadband": 0.1, "none": 0.7})
        >>> {name: round(share, 2) for name, share in told.items()}
        {'stiction': 0.84, 'deadband': 0.06, 'none': 0.1}
        """
        others = sum(p for name, p in causes.items() if name not in ("stiction", "deadband"))
        band = max(causes["stiction"] + causes["deadband"], others * float(np.exp(-AGAINST)))
        before = float(np.log(max(causes["stiction"], 1e-12) / max(causes["deadband"], 1e-12)))
        split = float(np.clip(before, -OTHERS, OTHERS)) + self.jump
        band *= float(np.exp(self.band))
        sticks = 1.0 / (1.0 + float(np.exp(-split)))
        share = {**causes, "stiction": band * sticks, "deadband": band * (1.0 - sticks)}
        total = sum(share.values())
        return {name: p / total for name, p in share.items()}

    def counted(self, causes: dict[str, float]) -> Counted:
        """What it adds to the log odds of stiction against all but a deadband, given the probabilities without it."""
        return Counted("stem", self.valve.S / self.swing, float("nan"), _odds(self.weighed(causes)) - _odds(causes))

    def evidence(self) -> Evidence:
        """It as a row of the evidence table, by the smaller log odds: it sticks that has a band and a jump."""
        if not self.used:
            return Evidence("stem", float("nan"), 0.0, "undecided", False, self.why, "kano2004")
        odds = min(self.band, self.jump)
        vote: Verdict = "stiction" if odds > 0.0 else "no_stiction"
        return Evidence("stem", odds, 0.0, vote, True, self.why, "kano2004")

    def identified(self, found: Identification) -> Identification:
        """An identification with the S and J that the position shows; process and simulations stay."""
        S, J = self.valve.S, self.valve.J
        (S_low, S_high), (J_low, J_high) = (_interval(self.valve, axis, own=found.own_samples) for axis in (0, 1))
        return replace(
            found, S=S, J=J, S_low=S_low, S_high=S_high, J_low=J_low, J_high=min(J_high, S_high),
            reason=BY_POSITION,
        )  # fmt: skip


def stem_shown(part: LoopRecord, unit: str = "") -> Shown | None:
    """Look at the recorded valve position, if there is one.

    Parameters
    ----------
    part : LoopRecord
        The stretch that is analysed; NaN of the position are passed over, which values held over them could not be.
    unit : str
        Unit of OP in the whole record, as it stands behind a number; by default that of the stretch.

    Returns
    -------
    Shown or None
        What it shows; None where none was recorded.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0)
    >>> shown = stem_shown(record)
    >>> shown.what, round(shown.valve.S, 1), stem_shown(replace(record, mv=record.op)).what
    ('stiction', 5.0, 'echo')
    """
    if part.mv is None:
        return None
    sent = part.op if part.valve_signal is None else part.valve_signal
    # Where it is not known what the valve was sent, its position says nothing.
    y = np.where(np.isfinite(sent), part.mv, np.nan)
    cut = longest_seen(y)
    y = y[cut]
    there = np.isfinite(y)
    if there.sum() < FEWEST:
        return Shown(
            "missing",
            f"Fewer than {FEWEST} samples of the valve position can be compared with what the valve was sent; the "
            "record is judged without it.",
        )
    op = hold_gaps(sent)[cut]
    if not (robust_range(op[there]) > 0.0 and robust_range(y) > 1e-9 * float(np.nanmax(np.abs(y)))):
        return _still(part, robust_range(op[there]))
    step = quantisation_step(y)
    if _repeats(op, y, step):
        return Shown(
            "echo",
            "The recorded valve position repeats OP to within its rounding: a positioner that returns its set point "
            "says nothing of the stem. The record is judged without it.",
        )
    # No band is small by its size in a unit of which the span is not known.
    small = SMALL if (unit or part.op_unit_short) == "%" else float("inf")
    seen = watch(op, y, max(step, 2.0 * exception_deviation(y, step)), small)
    plain = seen.stiction.turns >= TURNS and seen.share(seen.stiction) > PLAINLY
    if max(seen.explained, _alike(op, y)) < EXPLAINED and not plain:
        if noise_of(y, step) > WHITE * float(np.nanstd(y)) and robust_range(y) < WITHIN * robust_range(op[there]):
            return _still(part, robust_range(op[there]))
        return Shown(
            "unrelated",
            "The recorded valve position does not go with OP: it is another valve's, or mostly noise. The record is "
            "judged without it.",
        )
    best = min(seen.good.left, seen.deadband.left, seen.stiction.left)
    if best > UNCLEAR:
        return Shown(
            "unclear",
            "The recorded valve position moves as no valve does, good or sticky: it was compressed, or something else "
            "moves the stem. The record is judged without it.",
            seen,
        )
    good, play, sticks = (np.log(one.left * np.array([1.0, seen.finer]) + LITTLE) for one in seen[:3])
    band = BAND[0] + BAND[1] * float((good - np.minimum(play, sticks)).min())
    beats = float(np.tanh(seen.stiction.turns / TURNS * (play - sticks)[1]))
    jump = JUMPS[0] + JUMPS[1] * beats + JUMPS[2] * seen.stiction.J / seen.stiction.S
    band = float(np.clip(band, -MOST, MOST))
    what = "good" if band <= 0.0 else "stiction" if jump > 0.0 else "deadband"
    shown = Shown(what, "", seen, band, float(jump), robust_range(op))
    return shown._replace(why=_said(shown, seen, unit or part.op_unit_short))


def _odds(causes: dict[str, float]) -> float:
    """Log odds of stiction against all but a deadband [-]."""
    rest = sum(p for name, p in causes.items() if name not in ("stiction", "deadband"))
    return float(np.log(max(causes["stiction"], 1e-30) / max(rest, 1e-30)))


def _said(shown: Shown, seen: Watching, unit: str) -> str:
    valve, moves = shown.valve, f"{shown.valve.S:.2g} {unit}"
    fits = f"such a valve explains {seen.share(valve):.1f} % of it, one that follows {seen.share(seen.good):.1f} %."
    if shown.what == "good":
        return f"The recorded valve position follows OP: a good valve explains {seen.share(seen.good):.1f} % of it."
    if shown.what == "deadband":
        return f"The recorded valve position rests for {moves} of OP where OP turns, then follows: {fits}"
    return f"The recorded valve position rests while OP moves {moves}, then jumps {valve.J:.2g} {unit}: {fits}"


def _still(part: LoopRecord, swing: float) -> Shown:
    """What a position shows that stands still while OP moves by `swing` [% of span]."""
    if part.sp is None or part.pv is None:
        return Shown("frozen", STANDS_STILL, swing=swing)
    error, spread = np.nanvar(part.pv - part.sp), np.nanvar(part.sp)
    follows = spread > 0.0 and error < (1.0 - FOLLOWS) * spread
    return Shown("hangs", HANGS, swing=swing) if follows else Shown("frozen", STANDS_STILL, swing=swing)


def _repeats(op: NDArray[np.float64], y: NDArray[np.float64], step: float) -> bool:
    """Whether a position is a straight line of OP, to within rounding, of this sample or of one before."""
    room = ROUNDING * step + 1e-6 * robust_range(y)
    for late in range(4):
        u, seen = op[: op.size - late], y[late:]
        ok = np.isfinite(seen)
        slope, level = np.polyfit(u[ok] - u.mean(), seen[ok], 1)
        [off] = quantiles(np.abs(seen[ok] - level - slope * (u[ok] - u.mean())), 0.99)
        if off < room + abs(slope) * quantisation_step(u):
            return True
    return False


def _alike(op: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Square of the correlation of position and OP [-]."""
    ok = np.isfinite(y)
    return float(np.corrcoef(op[ok], y[ok])[0, 1]) ** 2


def _interval(valve: Watched, axis: int, *, own: bool) -> tuple[float, float]:
    """Ends of the 95 % interval of S (0) or J (1) over the valves tried [% of span]."""
    value, (factor, share) = valve[axis], SEEN if own else UNSEEN
    limit = (float(valve.tried[:, 2].min()) + LITTLE) * float(np.exp(factor * CHI2_1 / max(valve.turns, 1))) - LITTLE
    inside = valve.tried[valve.tried[:, 2] <= limit, axis]
    low, high = (min(inside.min(), value), max(inside.max(), value)) if inside.size else (value, value)
    return max(float(low) - share * valve.S, 0.0), float(high) + share * valve.S

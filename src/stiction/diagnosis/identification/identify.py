"""From OP and PV to the sticky valve and the process behind it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.diagnosis.identification.closer import closely
from stiction.diagnosis.identification.dense_search import search
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.oscillation.rhythm import SHORTEST
from stiction.errors import ParameterError
from stiction.records.analysis_window import usable_segment
from stiction.records.record import mask_outliers, require_record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.identification.dense_search import Search
    from stiction.diagnosis.identified import Identification
    from stiction.diagnosis.result import Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["identify", "periods_of", "searched", "speaking"]

MODELS = ("kano", "stenman", "three_parameter")
"""Valve models that are identified."""
SHORTEST_PERIOD = 8
"""Samples per period below which a local mean over one period says nothing about the valve."""


def identify(
    record: LoopRecord, model: str = "kano", *, period: float | None = None, closer: bool = True
) -> Identification:
    """Identify stiction and process together, by simulation error and then by the likelihood of prediction errors.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.
    model : str
        Valve model; "kano" fits (S, J), "stenman" d, "three_parameter" (sb, sj, r) of eq. 5 repaired. The last two
        go on from (S, J), and compare the stem itself where the record has MV.
    period : float, optional
        Period of the oscillation [s]; slow disturbances are then kept out by comparing deviations from the
        moving average over one period. Without it the period is found as `diagnose` finds it, and where nothing
        cycles the record is compared about its mean. `inf` asks for the mean, whatever cycles: then a cycle that
        repeats tells its dead time up to whole periods only, and the gain with it.
    closer : bool
        Go on to the fine search; without it S and J are only as exact as the dense one.

    Returns
    -------
    Identification
        S and J with intervals, the process, both simulations and the error surface.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples with both OP and PV.
    ParameterError
        When `model` is unknown, or `period` not positive or shorter than four samples.

    Notes
    -----
    What is found without a period is what `diagnose` finds, of a record that it analyses whole and in step: here the
    record is taken as it is, stretches in manual included, and a PV that was stored late as well. Where no
    oscillation is regular, the comparison about the likeliest period or about the mean speaks whose valve explains
    more.

    Every (S, J / S) of a 24 x 10 grid up to the OP's swing (a limit cycle needs OP_pp >= S) is tried with 100
    processes, 10 lags (an integrator among them where the loop's kind is not known, behind one where it integrates) by
    10 dead times, by the error of the simulation. With a period
    this is done in stretches of about eight periods, at most eight. It gives the error surface and, without
    `closer`, S and J: those of the stretch that agrees best with the others, with the profile likelihood's interval.

    The closer search maximises the likelihood of the PV's prediction errors (see `likelihood`), which a disturbance
    that goes round the closed loop does not pull, over the whole record or, where more than 4 000 samples are left of
    it after thinning, over the 4 000 in its middle, without the samples that neither a sticky nor a good valve
    predicts (see `shocks`). The interval holds all valves that Vuong's test does not find worse from half cycle to
    half cycle (see `contest`). Where the record does not show the controller's own samples OP trips the valve unseen
    between them: S is then corrected for the noise on OP, and its interval is a factor of 1.3 either way or more. Where
    the controller's integral tells a sample between each two, S and J come from a search with these (see `between`). An
    actuator that lags is looked for too, and found where its likelihood stands out: by OP itself its valve would look
    stickier than it is. Of other than the controller's own samples that only counts in how far a sticky valve beats a
    good one: a straight one, the likeliest bent one (`characteristic`), one beside a wave from outside, and a good one
    while both have that wave (`outside_wave`). The process is the best behind that valve's stem, by simulation.

    References
    ----------
    srinivasan2005; jelali2008: search over the nonlinear block around a least-squares fit of the linear one.
    vuong1989.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> found = st.identify(st.simulate(loop, sp=10.0, duration=2000.0, seed=1))
    >>> abs(found.S - 3.0) < 0.3
    True
    """
    require_record(record)
    if model not in MODELS:
        raise ParameterError(f"model = {model!r} is not identified; use {', '.join(map(repr, MODELS))}.")
    known = searched(record, period)
    found = closely(known).told if closer else known.rough
    if model == "stenman":
        from stiction.diagnosis.identification.stenman import identify_stenman

        return identify_stenman(known.record, found, known.period)
    if model == "three_parameter":
        from stiction.diagnosis.identification.three_parameter import identify_three_parameter

        return identify_three_parameter(known.record, found, known.period)
    return found


def searched(record: LoopRecord, period: float | None = None) -> Search:
    """Search a record densely about the period given, or about the one that is found.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.
    period : float, optional
        Period of the oscillation [s]; it is found where it is not given. `inf` compares about the mean of the record.

    Returns
    -------
    Search
        What was found in the record without values far off all others; its `period` is the one it was compared about.

    Raises
    ------
    RecordError
        When the record has no PV, no variation, or fewer than 30 samples with both OP and PV.
    ParameterError
        When `period` is not positive or shorter than four samples.
    """
    if period is not None and not period > 0.0:
        raise ParameterError(
            f"period = {period} s is not a period; give the oscillation's, leave it out to have it found, or give inf "
            "to compare about the mean."
        )
    if period is not None and period < SHORTEST * record.dt:
        raise ParameterError(
            f"period = {period:g} s is shorter than {SHORTEST:g} samples of {record.dt:g} s, too short to be told from "
            "noise; give the oscillation's, leave it out to have it found, or record faster."
        )
    record = mask_outliers(record)
    if period is not None:
        return search(record, period if math.isfinite(period) else None)
    part = usable_segment(record)
    oscillation = find_oscillation(part)
    first, *others = periods_of(part, oscillation)
    searches = [search(record, first)]
    if not oscillation.oscillating:
        searches += [search(record, other, searches[0].controller) for other in others]
    return searches[speaking(searches, oscillation)]


def periods_of(part: LoopRecord, oscillation: Oscillation) -> tuple[float | None, ...]:
    """Periods about whose moving average a record is compared.

    Parameters
    ----------
    part : LoopRecord
        The stretch of it that is analysed.
    oscillation : Oscillation
        The oscillation found in that.

    Returns
    -------
    tuple of float or None
        That of the oscillation [s], or the likeliest one where none is regular, if it is neither too short nor too
        long for a moving average; and None, for the mean.
    """
    fits = SHORTEST_PERIOD * part.dt < oscillation.period < part.duration / 2.0
    return (oscillation.period, None) if fits else (None,)


def speaking(searches: Sequence[Search], oscillation: Oscillation) -> int:
    """Which of the comparisons about `periods_of` speaks: the first of a loop that oscillates, else the best one.

    Parameters
    ----------
    searches : sequence of Search
        The comparisons, in the order of `periods_of`.
    oscillation : Oscillation
        The oscillation found.

    Returns
    -------
    int
        Its index [-].
    """
    return 0 if oscillation.oscillating else max(range(len(searches)), key=lambda i: searches[i].rough.fit)

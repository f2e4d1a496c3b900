"""Analysis of a ramp test: stick band, jump, and the rate above which the stem follows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, require_count, require_positive
from stiction.records.record import require_record
from stiction.valvetests.fit_following import fit_following
from stiction.valvetests.friction_fit import FrictionFit, fit_friction
from stiction.valvetests.ramp_rate import bracket_rate, classify_ramps
from stiction.valvetests.ramp_result import RampTest
from stiction.valvetests.ramp_split import OpRamp, find_ramps
from stiction.valvetests.ramp_tables import ramp_events, ramps_by_travel, rows_for_fit
from stiction.valvetests.ramp_verdict import open_questions, ramp_verdict
from stiction.valvetests.result import Estimate
from stiction.valvetests.segmentation import noise_std, quantisation_step
from stiction.valvetests.stem_moves import StemMoves, classify_segments
from stiction.valvetests.stem_signal import MAX_ROUNDING_STEP, StemSignal, read_stem

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Srinivasan
    from stiction.records import LoopRecord

__all__ = ["analyse_ramp"]

REVERSED_POSITION_GAIN = -0.5
"""Travel over OP travel below which the position signal shows closing instead of opening [-]."""


def analyse_ramp(
    record: LoopRecord, *, signal: str | None = None, lag: float = 0.0, limit: float = 1.0, bins: int = 5
) -> RampTest:
    """Read a valve's stick band, jump and rate threshold from a ramp test.

    Parameters
    ----------
    record : LoopRecord
        OP [% of span] driven in ramps with the loop in manual, and the valve position `mv` or a flow `pv`.
    signal : {"mv", "pv"}, optional
        Signal that shows the stem; by default `mv` where it was recorded, else `pv`.
    lag : float
        Known first-order lag between the OP and the force on the stem (transducer, actuator) [s]; without it sb is
        wrong by the rate times the lag. The lag of a flow is found from the rates tested, two at least: from one rate
        it cannot be separated from deadband, and the intervals are wider.
    limit : float
        Limit on deadband plus stickband, S [% of span].
    bins : int
        Number of travel ranges for which sb and sj are reported [-].

    Returns
    -------
    RampTest

    Raises
    ------
    RecordError
        When the OP has no ramp or reacts to PV, the stem was not recorded, or more than a fifth of it is missing.
    ParameterError
        When `signal` is unknown, `lag` is negative, or `limit` or `bins` is not positive.

    Notes
    -----
    OP and stem are divided into rests and straight lines. A rest followed by another level is a slip; a line with
    about the slope of the OP is following. sb, sj and the frictionless line come from one least-squares fit. Their
    intervals hold the scatter from slip to slip, the sampling and rounding of the record, the travel of the OP while
    a slip goes on and, for a flow tested at one rate, the lag that such a test cannot separate from deadband. r lies
    between the fastest ramp with stairs and the slowest ramp that the stem followed, so its accuracy depends on the
    tested rates. Stairs too small to see in the noise are detected by their regularity.

    References
    ----------
    srinivasan2008, sections III and V and eq. 5: the ramps and the model. The analysis is this project's.

    Examples
    --------
    >>> import numpy as np, stiction as st
    >>> plan = st.plan_ramp_test(low=5.0, high=25.0, threshold=0.05)
    >>> test = st.analyse_ramp(st.stroke(st.Srinivasan(sb=3.0, sj=1.5, r=0.05), plan.op, plan.dt))
    >>> round(test.sb.value, 1), round(test.sj.value, 1), test.r_low < 0.05 <= test.r_high
    (3.0, 1.5, True)
    """
    require_record(record)
    limit = require_positive("limit", limit, "% of span")
    bins = require_count("bins", bins)
    settings = {"signal": signal, "lag": lag, "limit": limit, "bins": bins}
    reading = read_stem(record, signal, lag)
    op_ramps, pieces = find_ramps(reading, record.tag)
    moves, rounding = _classify_ramps(reading, op_ramps, record.tag)
    rows = rows_for_fit(op_ramps, moves)
    fit = None
    if rows.op.size:
        grain = {"dt": record.dt, "op_step": reading.op_step, "rounding": rounding}
        fit = fit_friction(rows, reading.signal == "mv", **grain)
    ramps = classify_ramps(op_ramps, moves, fit)
    r_low, r_high, contradiction = bracket_rate(ramps)
    sb = sj = deadband = S = Estimate()
    if fit is not None:
        sb, sj, deadband, S = fit.sb, fit.sj, fit.deadband, fit.S
    elif reading.signal == "mv":
        deadband, S = fit_following(op_ramps, moves)
    op_line = np.concatenate([[p.at(t) for t in reading.time[p.first : p.last]] for p in pieces])
    valve, position, model, residual = _compare_with_record(record, reading, op_line, fit, r_low, r_high)
    stuck = max(moved.lead for moved in moves)
    unknown = open_questions(reading, ramps, fit, stuck, r_low, r_high, contradiction)
    verdict, reason = ramp_verdict(sb, sj, S, stuck, limit, reading.signal, fit.systematic_error if fit else None)
    return RampTest(
        record, reading.signal, verdict, reason, limit, unknown, settings,
        sb=sb, sj=sj, r_low=r_low, r_high=r_high, deadband=deadband, S=S,
        offset=fit.offset if fit else math.nan, slope=fit.slope if fit else math.nan,
        delay=fit.delay if fit else math.nan, ramps=ramps, events=ramp_events(op_ramps, moves, fit),
        travel=ramps_by_travel(rows, fit, bins), valve=valve, residual=residual, position=position, model=model,
    )  # fmt: skip


def _classify_ramps(reading: StemSignal, ramps: tuple[OpRamp, ...], tag: str) -> tuple[tuple[StemMoves, ...], float]:
    """Motion of the stem in every ramp, and the step to which the stem is rounded [its unit]."""
    inside = [slice(ramp.line.first, ramp.line.last) for ramp in ramps]
    tested = np.concatenate([reading.stem[part] for part in inside])
    driven = np.concatenate([reading.op[part] for part in inside])
    spread = driven - driven.mean()
    gain = float(spread @ (tested - tested.mean()) / (spread @ spread)) or 1e-12
    if reading.signal == "mv":
        if gain < REVERSED_POSITION_GAIN:
            raise RecordError(
                f"The valve position of {tag} moves against the OP, by {gain:.2g} % per %; give the opening, "
                "which is 100 minus this signal."
            )
        gain = 1.0
    rounding = quantisation_step(tested, MAX_ROUNDING_STEP * abs(gain))
    sigma = max(noise_std(reading.stem), 0.5 * rounding, 0.002 * abs(gain))
    moves = tuple(
        classify_segments(ramp, reading.time[part], reading.stem[part], sigma, rounding, gain)
        for ramp, part in zip(ramps, inside, strict=True)
    )
    return moves, rounding


def _compare_with_record(
    record: LoopRecord,
    reading: StemSignal,
    op_line: NDArray[np.float64],
    fit: FrictionFit | None,
    r_low: float,
    r_high: float,
) -> tuple[Srinivasan | None, NDArray[np.float64], NDArray[np.float64], float]:
    """Return the fitted valve, the stem and the fitted valve's stem over the same OP, and their rms difference."""
    from stiction.models import Srinivasan
    from stiction.simulation import stroke

    position, model = np.full(len(record), math.nan), np.full(len(record), math.nan)
    if fit is None:
        return None, position, model, math.nan
    at = np.round(reading.time / record.dt).astype(int)
    position[at] = fit.offset + fit.slope * reading.stem
    if not fit.sb.known or fit.sb.value <= 0.0:
        return None, position, model, math.nan
    if math.isnan(r_high):
        r = math.inf
    else:
        r = math.sqrt(r_low * r_high) if r_low > 0.0 else 0.0
    valve = Srinivasan(fit.sb.value, min(max(fit.sj.value, 0.0), 2.0 * fit.sb.value), r)
    start = float(np.median(position[at[:10]]))
    op = np.interp(record.time, reading.time, op_line)
    model = np.asarray(stroke(valve, op, record.dt, mv_start=start).mv)
    miss = (model - position)[at]
    return valve, position, model, float(np.sqrt(np.mean(miss * miss)))

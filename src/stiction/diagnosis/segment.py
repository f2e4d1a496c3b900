"""The judged segment: the part of a record in which the valve can be judged, prepared once for all later stages."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state import LoopState, assess_loop_state, describe_action, describe_state
from stiction.diagnosis.oscillation import find_oscillation
from stiction.errors import ParameterError, RecordError
from stiction.records.assess import Quality, assess_quality
from stiction.records.conditioned import Conditioned, condition
from stiction.records.record import missing_pv_hint, require_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["NAME_CODES", "JudgedSegment", "judge_in_control", "judge_segment", "require_in_control"]

EXCLUDED_STATES = ("manual", "not_in_command", "shut_in", "valve_not_responding", "pv_frozen", "bad_data")
"""States whose stretches are left out; at a limit OP is still what the valve was sent."""
STILL = "OP or PV does not vary enough to identify a valve; record while both move."
"""Why a record that passes the data checks may still not be judged."""
NAME_CODES = "name the good codes (--good-codes, in Python good_codes=, or the column good of a map)."
"""Remedy where the quality codes of a record can be read in several ways."""
MIN_SAMPLES_PER_PERIOD = 4.0
"""Samples in the shortest period that can be given [-]."""


@dataclass(frozen=True, eq=False)
class JudgedSegment:
    """The part of a record that is judged, and what was found of it before the valve is looked at."""

    record: LoopRecord
    """The record as given, outliers missing; `quality.first` and `quality.last` bound the part that is judged."""
    signals: Conditioned = field(repr=False)
    """That part, ready for analysis, stretches out of control left out."""
    loop_state: LoopState
    """Whether the controller moves the valve and the process answers; else nothing is said about the valve."""
    oscillation: Oscillation
    """Whether and how the loop oscillates in that part."""
    quality: Quality
    """The data checks."""

    @property
    def part(self) -> LoopRecord:
        """The judged part as a record, without gaps in OP, PV and SP."""
        return self.signals.part

    @property
    def op(self) -> NDArray[np.float64]:
        """OP of the judged part, gaps interpolated [% of span]."""
        return self.signals.op

    @property
    def pv(self) -> NDArray[np.float64]:
        """PV of the judged part, gaps interpolated [engineering units]."""
        return self.signals.pv

    @property
    def dt(self) -> float:
        """Sampling period [s]."""
        return self.part.dt

    @property
    def period(self) -> float | None:
        """Period of the oscillation [s]; None where nothing oscillates."""
        return self.oscillation.period if self.oscillation.oscillating else None

    @property
    def pv_step_share(self) -> float:
        """Quantisation step of PV over its 98 % range [-]."""
        return self.signals.pv_step / self.signals.pv_swing if self.signals.pv_swing > 0.0 else 0.0

    @property
    def is_averaged(self) -> bool:
        """Whether OP and PV are moving averages."""
        return any(check.name == "moving average" for check in self.quality.checks)


def judge_segment(
    record: LoopRecord, *, period: float | None = None, samples: tuple[int, int] | None = None
) -> JudgedSegment:
    """Prepare a record for identification and verdict.

    Parameters
    ----------
    record : LoopRecord
        A record of one loop, OP and PV at least.
    period : float, optional
        Period of the oscillation [s]. It is found where it is not given; `inf` says that nothing oscillates.
    samples : tuple of int, optional
        First sample and one past the last of the window to judge; the whole record where it is not given.

    Returns
    -------
    JudgedSegment
        The longest part in which the loop is in control, with loop state, oscillation and data checks. A record out of
        control or with unusable data is returned as well; its `loop_state` says so.

    Raises
    ------
    RecordError
        When the record has no PV at all, or is a path or the list that `read` gives.
    ParameterError
        When `period` is not positive or shorter than four samples.

    Notes
    -----
    Long records are not averaged here: the search of the valve takes block means that suit the oscillation.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.diagnosis.segment import judge_segment
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> segment = judge_segment(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow"))
    >>> segment.loop_state.state, round(segment.oscillation.period)
    ('in_control', 140)
    """
    require_record(record)
    if samples is not None and samples != (0, len(record)):
        record = record.window(*samples)
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; a diagnosis needs OP and PV. {missing_pv_hint(record)}")
    if period is not None and not period > 0.0:
        raise ParameterError(
            f"period = {period:g} s is not positive; give the period of the oscillation, leave it out to estimate "
            "it, or give inf if nothing oscillates."
        )
    if period is not None and period < MIN_SAMPLES_PER_PERIOD * record.dt:
        raise ParameterError(
            f"period = {period:g} s is shorter than {MIN_SAMPLES_PER_PERIOD:g} samples of {record.dt:g} s; give the "
            "period of the oscillation, leave it out to estimate it, or record faster."
        )
    signals = condition(record)
    given, state = signals.record, assess_loop_state(signals)
    if state.in_control:
        signals = signals.without((one.first, one.last) for one in state.stretches if one.state in EXCLUDED_STATES)
    oscillation = find_oscillation(signals.part)
    if period is not None:
        oscillation = replace(oscillation, period=period, oscillating=bool(np.isfinite(period)))
    quality = assess_quality(signals, oscillation.period if oscillation.oscillating else None)
    if state.in_control and not (quality.usable and signals.moves):
        rejects = tuple(check.why for check in quality.rejections)
        state = replace(state, state="bad_data", share=1.0, rejects=rejects or (STILL,))
    return JudgedSegment(given, signals, state, oscillation, quality)


def require_in_control(segment: JudgedSegment) -> JudgedSegment:
    """Return a segment in which the valve can be judged; else raise a RecordError with the state and what to do."""
    state = segment.loop_state
    if state.in_control:
        return segment
    record = segment.record
    why = describe_state(state, record.start, record.provenance.pv_unit)
    raise RecordError(
        f"{record.tag}: no valve can be identified, because the loop state is {state.state}. {why} "
        f"{describe_action(state)}"
    )


def judge_in_control(record: LoopRecord, *, period: float | None = None) -> JudgedSegment:
    """Prepare a record in which a valve is to be identified, `period` as in `judge_segment`.

    Raises RecordError where the loop is out of control, and where the quality codes can be read in several ways:
    verdicts of several readings can be compared, not valves.
    """
    require_record(record)
    if record.other_readings:
        readings = [one.provenance.quality_reading for one in (record, *record.other_readings)]
        raise RecordError(
            f"{record.tag}: no valve can be identified, because the quality codes can be read in {len(readings)} ways; "
            f"{NAME_CODES} {' '.join(readings)}"
        )
    return require_in_control(judge_segment(record, period=period))

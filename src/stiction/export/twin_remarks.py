"""What is said about an identified loop where it is exported."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.display.duration_format import format_seconds

if TYPE_CHECKING:
    from stiction.compensation.twin import Twin
    from stiction.diagnosis import Diagnosis

__all__ = ["twin_remarks"]

NEAR = 0.2
"""Largest relative difference of period and OP amplitude from the record that is called the same [-]."""


def twin_remarks(twin: Twin, diagnosis: Diagnosis | None) -> tuple[str, ...]:
    """Return what a user of the twin must know: how it moves by itself, and what its record did not show.

    Parameters
    ----------
    twin : Twin
        The identified loop.
    diagnosis : Diagnosis, optional
        What was found of the record.

    Returns
    -------
    tuple of str
        One or two sentences each.
    """
    found: list[str] = []
    if diagnosis is not None:
        if not diagnosis.shows_size:
            shown = "decide whether the valve sticks" if diagnosis.verdict == "undecided" else "show a sticking valve"
            found.append(f"The record does not {shown}, so S and J are only those of the best fit.")
        if diagnosis.stuck or diagnosis.loop_state.state == "valve_not_responding":
            found.append("The record does not show that the valve moves.")
    if twin.start is None:
        return tuple(found)
    own, record = twin.start.cycle, twin.measured
    if not own.period > 0.0:
        found.append("Without disturbances it comes to rest: give it load or pv_disturbance.")
        return tuple(found)
    text = (
        f"Without disturbances it oscillates with a period of {format_seconds(own.period)} and "
        f"an OP amplitude of {own.amplitude_op:.3g} %"
    )
    pairs = ((own.period, record.period), (own.amplitude_op, record.amplitude_op))
    if any(abs(a / b - 1.0) > NEAR for a, b in pairs):
        text += (
            f"; the record, with its disturbances, with {format_seconds(record.period)} and "
            f"{record.amplitude_op:.3g} %: give it load or pv_disturbance"
        )
    return (*found, f"{text}.")

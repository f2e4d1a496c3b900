"""A compensator as structured text of IEC 61131-3: one function block with settings, limits and an off switch.

The rules stand in ``iec/*.st``, one page for each compensator, in the words of its Python page. The text uses what the
second and the third edition of the standard share: LREAL, DINT, INT and BOOL without implicit conversion, comments in
``(* *)``, no vendor's extension. Times are counted in scans, as the Python step counts samples.
"""

from __future__ import annotations

import inspect
import math
import sys
from datetime import date as Date
from typing import TYPE_CHECKING, Any

from stiction.compensation.iec_text import block_name, comment, pages
from stiction.compensation.predicted import predicted
from stiction.errors import ParameterError, require_not_negative, require_positive, require_range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.compensation.result import CompensationTrial
    from stiction.models.compensators import Compensator

__all__ = ["recommended_text", "structured_text"]

SETUP = (
    "Scan time: call the block once in every scan, after the controller; give the scan time as above.",
    "Off: with ENABLE FALSE, move OP in manual; VALVE_SIGNAL equals OP.",
    "Limits: OP_LOW and OP_HIGH are what the valve may see.",
)
WIRES = {
    "HOLD_INTEGRAL": "Wiring: force HOLD_INTEGRAL; the controller's integral stands still, its output does not jump.",
    "TRACK": "Wiring: force TRACK; the controller tracks VALVE_SIGNAL as in manual and takes over without a bump.",
}
TRIAL = (
    "ENABLE only in automatic and with a good PV, first with an operator at hand; watch PV and stem for 20 periods.",
    "Switch off where PV or stem travel is worse than predicted, and for good when the valve is repaired.",
)


def structured_text(
    compensator: Compensator,
    dt: float,
    op_limits: tuple[float, float] = (0.0, 100.0),
    *,
    tag: str = "loop",
    S: float | None = None,
    J: float | None = None,
    date: Date | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Write a compensator as one function block of IEC 61131-3 structured text.

    Parameters
    ----------
    compensator : Compensator
        The compensator with its settings.
    dt : float
        Scan time of the control system [s].
    op_limits : tuple of float
        Lowest and highest signal to the valve [% of span].
    tag : str
        Name of the loop; the block is named after it.
    S, J : float, optional
        Stiction that the settings were made for, for the header [% of span].
    date : datetime.date, optional
        Date for the header; today by default.
    notes : sequence of str, optional
        Further lines of the header, such as what a trial predicts.

    Returns
    -------
    str
        The text, in ASCII.

    Raises
    ------
    ParameterError
        When `dt` is not positive, `S` or `J` is negative or not finite, the limits have no room,
        or the compensator has no page in structured text.

    Notes
    -----
    With ENABLE FALSE, and in the first scan, OP passes and the block forgets; so switching on starts like the simulated
    compensator at rest. Switching off takes a pulse away at once, no further than its height; the moves open the loop,
    and the controller, which tracks VALVE_SIGNAL meanwhile, takes over where it is.

    References
    ----------
    iec61131_3: syntax and order of evaluation, after; the standard was not at hand.

    Examples
    --------
    >>> import stiction as st
    >>> text = structured_text(st.Knocker(1.5, 2.0, 5.0), dt=1.0, tag="FIC-101", S=3.0, J=1.0)
    >>> [line.strip() for line in text.splitlines() if "AMPLITUDE :" in line or "FUNCTION_BLOCK FIC" in line]
    ['FUNCTION_BLOCK FIC_101_KNOCKER', 'AMPLITUDE : LREAL := 1.5;  (* height of a pulse [% of span] *)']
    """
    dt = require_positive("dt", dt, "s")
    low, high = _limits(op_limits)
    page = type(compensator).__module__.rpartition(".")[2]
    if f"{page}.st" not in pages().list_templates():
        raise ParameterError(
            f"compensator {type(compensator).__name__} has no page in structured text; give one of stiction's own."
        )
    template = pages().get_template(f"{page}.st")
    given = {**_settings(compensator, page, dt), "op_low": low, "op_high": high, "name": block_name(tag, page)}
    declared = template.render(header=(), **given)
    wires = [line for output, line in WIRES.items() if f"{output} : BOOL" in declared]
    sized = [
        f"{name} = {require_not_negative(name, value, '% of span'):.2f} % of span"
        for name, value in (("S", S), ("J", J))
        if value is not None
    ]
    header = [
        f"{type(compensator).__name__} for the sticking valve of loop {tag}.",
        f"Made for {', '.join(sized) if sized else 'stiction not told here'}, scan time {dt:g} s.",
        f"Written {(date or Date.today()).isoformat()} by stiction {_version()}.",
        "",
        "Before ENABLE:",
        *(f"{i}. {line}" for i, line in enumerate((*SETUP, *wires, *TRIAL), 1)),
        "",
        "Checked: the rules of this text, run on 1 000 random signals in the tests of stiction, gave in each scan what "
        "the simulated compensator gives. Not checked: compiler, scan time and wiring of this plant.",
        *(["", *notes] if notes else []),
    ]
    return template.render(header=[line for told in header for line in comment(told)], **given) + "\n"


def recommended_text(
    trial: CompensationTrial,
    op_limits: tuple[float, float] = (0.0, 100.0),
    *,
    dt: float | None = None,
    date: Date | None = None,
) -> str:
    """Write the compensator that a trial recommends, with what the trial predicts in the header.

    Parameters
    ----------
    trial : CompensationTrial
        What `compensate` found.
    op_limits : tuple of float
        Lowest and highest signal to the valve [% of span].
    dt : float, optional
        Scan time of the control system [s]; by default the sampling period of the trial.
    date : datetime.date, optional
        Date for the header; today by default.

    Returns
    -------
    str
        The text.

    Raises
    ------
    ParameterError
        When the trial recommends no compensator.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> "Predicted on the loop's twin" in recommended_text(st.compensate(loop, seeds=2))
    True
    """
    compensator = trial[trial.recommended].remedy.compensator if trial.recommended else None
    if compensator is None or trial.twin is None:
        raise ParameterError(
            f"{trial.tag}: the trial recommends {trial.recommended or 'nothing'}, which is no compensator; "
            f"there is no structured text to write. {trial.reason}"
        )
    tried = trial.twin.loop.dt
    notes = [f"Predicted on the loop's twin: {predicted(trial)}."]
    if dt is not None and abs(dt - tried) > 1e-9 * tried:
        notes.append(f"The trial sampled every {tried:g} s, not every {dt:g} s: the prediction may not hold.")
    return structured_text(
        compensator, dt or tried, op_limits, tag=trial.tag, S=trial.S, J=trial.J, date=date, notes=notes
    )


def _limits(op_limits: tuple[float, float]) -> tuple[float, float]:
    low, high = require_range("op_limits", op_limits)
    if math.isinf(low) or math.isinf(high):
        raise ParameterError(f"op_limits = ({low:g}, {high:g}) % are not finite; give finite limits.")
    return low, high


def _settings(compensator: Compensator, page: str, dt: float) -> dict[str, Any]:
    """Settings by the names that the compensator's step gives them."""
    step = getattr(sys.modules[type(compensator).__module__], f"{page}_step")
    values = compensator.parameters(dt)
    names = list(inspect.signature(step).parameters)[-len(values) :]
    return dict(zip(names, values, strict=True))


def _version() -> str:
    from stiction import __version__

    return __version__

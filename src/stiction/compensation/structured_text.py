"""Write a compensator as IEC 61131-3 structured text: one function block with settings, limits and an ENABLE input.

The templates are in ``iec/*.st``, one for each compensator, with the names of its Python page. The text uses only
what the second and third edition of the standard have in common: LREAL, DINT, INT and BOOL without implicit
conversion, comments in ``(* *)``, no vendor extensions. Times are counted in scans, as the Python step counts
samples.
"""

from __future__ import annotations

import inspect
import math
import sys
from datetime import date as Date
from typing import TYPE_CHECKING, Any

from stiction.compensation.iec_format import block_name, comment_lines, templates
from stiction.compensation.prediction_text import prediction_text
from stiction.errors import ParameterError, require_not_negative, require_positive, require_range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.compensation.result import CompensationTrial
    from stiction.models.compensators import Compensator

__all__ = ["recommended_text", "structured_text"]

SETUP_LINES = (
    "Scan time: call the block once in every scan, after the controller; the scan time must be the one above.",
    "Off: with ENABLE FALSE, move OP in manual; VALVE_SIGNAL must equal OP.",
    "Limits: OP_LOW and OP_HIGH are the limits of the signal to the valve.",
)
WIRING_LINES = {
    "HOLD_INTEGRAL": "Wiring: force HOLD_INTEGRAL; the controller must hold its integral and not jump.",
    "TRACK": "Wiring: force TRACK; the controller must track VALVE_SIGNAL as in manual, and take over without a bump.",
}
START_LINES = (
    "ENABLE only in automatic and with a good PV, at first with an operator present; watch PV and stem for 20 periods.",
    "Switch off if PV or stem travel is worse than predicted. Remove the block when the valve is repaired.",
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
        Stiction for which the settings were made, for the header [% of span].
    date : datetime.date, optional
        Date for the header; today by default.
    notes : sequence of str, optional
        Further lines of the header, such as the prediction of a trial.

    Returns
    -------
    str
        The text, in ASCII.

    Raises
    ------
    ParameterError
        When `dt` is not positive, `S` or `J` is negative or not finite, the limits are empty or not finite,
        or the compensator has no template.

    Notes ----- With ENABLE FALSE, and in the first scan, VALVE_SIGNAL equals OP and the block resets its state; so it
    starts like the simulated compensator at rest. Switching off ends a pulse at once, so the signal changes by at most
    its height. The move compensators open the loop; the controller tracks VALVE_SIGNAL meanwhile and takes over without
    a bump.

    References
    ----------
    iec61131_3: syntax and order of evaluation, recalled; the standard was not read.

    Examples
    --------
    >>> import stiction as st
    >>> text = st.structured_text(st.Knocker(1.5, 2.0, 5.0), dt=1.0, tag="FIC-101", S=3.0, J=1.0)
    >>> [line.strip() for line in text.splitlines() if "AMPLITUDE :" in line or "FUNCTION_BLOCK FIC" in line]
    ['FUNCTION_BLOCK FIC_101_KNOCKER', 'AMPLITUDE : LREAL := 1.5;  (* height of a pulse [% of span] *)']
    """
    dt = require_positive("dt", dt, "s")
    low, high = _limits(op_limits)
    page = type(compensator).__module__.rpartition(".")[2]
    if f"{page}.st" not in templates().list_templates():
        raise ParameterError(
            f"The compensator {type(compensator).__name__} has no structured text; give a compensator of stiction, "
            "such as Knocker."
        )
    template = templates().get_template(f"{page}.st")
    given = {**_settings(compensator, page, dt), "op_low": low, "op_high": high, "name": block_name(tag, page)}
    declared = template.render(header=(), **given)
    wires = [line for output, line in WIRING_LINES.items() if f"{output} : BOOL" in declared]
    sized = [
        f"{name} = {require_not_negative(name, value, '% of span'):.2f} % of span"
        for name, value in (("S", S), ("J", J))
        if value is not None
    ]
    header = [
        f"{type(compensator).__name__} for the sticky valve of loop {tag}.",
        f"Made for {', '.join(sized) if sized else 'an S and J that were not given'}, scan time {dt:g} s.",
        f"Written {(date or Date.today()).isoformat()} by stiction {_version()}.",
        "",
        "Before ENABLE:",
        *(f"{i}. {line}" for i, line in enumerate((*SETUP_LINES, *wires, *START_LINES), 1)),
        "",
        "Checked in the tests of stiction: on 1 000 random signals, this text gives the same output in each scan as "
        "the simulated compensator. Not checked: compiler, scan time and wiring of this plant.",
        *(["", *notes] if notes else []),
    ]
    return template.render(header=[line for text in header for line in comment_lines(text)], **given) + "\n"


def recommended_text(
    trial: CompensationTrial,
    op_limits: tuple[float, float] = (0.0, 100.0),
    *,
    dt: float | None = None,
    date: Date | None = None,
) -> str:
    """Write the compensator that a trial recommends, with the prediction in the header.

    `trial`: the result of `compensate`. `op_limits`: lowest and highest signal to the valve [% of span]. `dt`: scan
    time of the control system [s]; by default the sampling period of the trial. `date`: date for the header; today by
    default. Raises ParameterError when the trial recommends no compensator.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> "Predicted by simulation" in recommended_text(st.compensate(loop, seeds=2))
    True
    """
    compensator = trial[trial.recommended].remedy.compensator if trial.recommended else None
    if compensator is None or trial.twin is None:
        raise ParameterError(
            f"{trial.tag}: there is no structured text to write, because the recommendation is "
            f"'{trial.recommended or 'none'}' and not a compensator. {trial.reason}"
        )
    tried = trial.twin.loop.dt
    notes = [f"Predicted by simulation: {prediction_text(trial)}."]
    if dt is not None and abs(dt - tried) > 1e-9 * tried:
        notes.append(f"The trial used a scan time of {tried:g} s instead of {dt:g} s: the prediction may be wrong.")
    return structured_text(
        compensator, dt or tried, op_limits, tag=trial.tag, S=trial.S, J=trial.J, date=date, notes=notes
    )


def _limits(op_limits: tuple[float, float]) -> tuple[float, float]:
    low, high = require_range("op_limits", op_limits)
    if math.isinf(low) or math.isinf(high):
        raise ParameterError(f"op_limits = ({low:g}, {high:g}) % are not finite; give finite limits.")
    return low, high


def _settings(compensator: Compensator, page: str, dt: float) -> dict[str, Any]:
    """Return the settings by their names in the compensator's step function."""
    step = getattr(sys.modules[type(compensator).__module__], f"{page}_step")
    values = compensator.parameters(dt)
    names = list(inspect.signature(step).parameters)[-len(values) :]
    return dict(zip(names, values, strict=True))


def _version() -> str:
    from stiction import __version__

    return __version__

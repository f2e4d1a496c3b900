r"""Conversion between the parameters of the two-parameter valves: (S, J), (fs, fd) and (sb, sj).

.. math::

    fs = sb = \tfrac{1}{2}(S + J) \qquad fd = sb - sj = \tfrac{1}{2}(S - J)

    S = fs + fd = 2\,sb - sj \qquad J = fs - fd = sj

The parameters can always be converted. The valves differ in when the stem sticks again (see `convert_valve`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, require_not_negative, require_positive
from stiction.models.component import TIE_TOLERANCE
from stiction.models.valves import Choudhury, He, Ideal, Kano, Srinivasan, Stenman

if TYPE_CHECKING:
    from stiction.models.component import Valve

__all__ = [
    "SJ_to_friction_bands",
    "SJ_to_stick_bands",
    "convert_valve",
    "friction_bands_to_SJ",
    "friction_to_stick_bands",
    "stick_bands_to_SJ",
    "stick_to_friction_bands",
]

_CLASSES = {valve.__name__: valve for valve in (Choudhury, He, Ideal, Kano, Srinivasan, Stenman)}


def SJ_to_friction_bands(S: float, J: float) -> tuple[float, float]:
    """(fs, fd) of (S, J) [% of span].

    Raises
    ------
    ParameterError
        When a number is negative or J exceeds S: the lag fd = (S - J) / 2 would be negative.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import SJ_to_friction_bands
    >>> SJ_to_friction_bands(S=3.0, J=1.0)
    (2.0, 1.0)
    """
    S, J = _require_band("S", S), _require_band("J", J)
    if J > S:
        raise ParameterError(
            f"J = {J:g} % exceeds S = {S:g} %: fd = (S - J) / 2 would be negative. An overshooting valve has no "
            "(fs, fd); keep it as Kano(S, J) or Srinivasan(sb, sj, r=0)."
        )
    return (S + J) / 2.0, (S - J) / 2.0


def friction_bands_to_SJ(fs: float, fd: float) -> tuple[float, float]:
    """(S, J) of (fs, fd) [% of span].

    Raises
    ------
    ParameterError
        When a number is negative or fd exceeds fs.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import friction_bands_to_SJ
    >>> friction_bands_to_SJ(fs=2.0, fd=1.0)
    (3.0, 1.0)
    """
    fs, fd = _require_band("fs", fs), _require_band("fd", fd)
    if fd > fs:
        raise ParameterError(f"fd = {fd:g} % exceeds fs = {fs:g} %: J = fs - fd would be negative; give fd <= fs.")
    return fs + fd, fs - fd


def SJ_to_stick_bands(S: float, J: float) -> tuple[float, float]:
    """(sb, sj) of (S, J) [% of span]; J > S converts.

    Raises
    ------
    ParameterError
        When a number is negative.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import SJ_to_stick_bands
    >>> SJ_to_stick_bands(S=3.0, J=1.0)
    (2.0, 1.0)
    """
    S, J = _require_band("S", S), _require_band("J", J)
    return (S + J) / 2.0, J


def stick_bands_to_SJ(sb: float, sj: float) -> tuple[float, float]:
    """(S, J) of (sb, sj) [% of span].

    Raises
    ------
    ParameterError
        When a number is negative or sj exceeds 2 sb.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import stick_bands_to_SJ
    >>> stick_bands_to_SJ(sb=2.0, sj=1.0)
    (3.0, 1.0)
    """
    sb, sj = _require_band("sb", sb), _require_band("sj", sj)
    if sj > 2.0 * sb:
        raise ParameterError(f"sj = {sj:g} % exceeds 2 sb = {2.0 * sb:g} %: S would be negative; give sj <= 2 sb.")
    return 2.0 * sb - sj, sj


def friction_to_stick_bands(fs: float, fd: float) -> tuple[float, float]:
    """(sb, sj) of (fs, fd) [% of span].

    Raises
    ------
    ParameterError
        When a number is negative or fd exceeds fs.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import friction_to_stick_bands
    >>> friction_to_stick_bands(fs=2.0, fd=0.5)
    (2.0, 1.5)
    """
    return float(fs), friction_bands_to_SJ(fs, fd)[1]


def stick_to_friction_bands(sb: float, sj: float) -> tuple[float, float]:
    """(fs, fd) of (sb, sj) [% of span].

    Raises
    ------
    ParameterError
        When a number is negative or sj exceeds sb: the lag fd = sb - sj would be negative.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import stick_to_friction_bands
    >>> stick_to_friction_bands(sb=2.0, sj=1.5)
    (2.0, 0.5)
    """
    sb, sj = _require_band("sb", sb), _require_band("sj", sj)
    if sj > sb:
        raise ParameterError(
            f"sj = {sj:g} % exceeds sb = {sb:g} %: fd = sb - sj would be negative. An overshooting valve has no "
            "(fs, fd); keep (sb, sj)."
        )
    return sb, sb - sj


def convert_valve(valve: Valve, model: type[Valve] | str, *, r: float | None = None, dt: float | None = None) -> Valve:
    """Convert a valve to another model.

    Parameters
    ----------
    valve : Valve
        Ideal, Stenman, Kano, Choudhury, He or Srinivasan.
    model : type of Valve or str
        The model to convert to, as class or name.
    r : float, optional
        Rate of the Srinivasan valve to make [% of span / s]; by default the rate of the same valve.
    dt : float, optional
        Sampling period [s]; He's valve has a hidden rate threshold (fs - fd) / dt, so its way to and from
        Srinivasan's needs it.

    Returns
    -------
    Valve
        The valve, with the same travel.

    Raises
    ------
    ParameterError
        When the valve has no such form; the message says what to do.

    Notes
    -----
    These conversions give the identical valve, to the last bit if the bands are exact in binary:

    - Kano <-> Srinivasan with r = 0 (any J), both <-> Choudhury (J <= S only: beyond, they differ);
    - He <-> Srinivasan with r just above (fs - fd) / dt, at that dt only;
    - Stenman <-> Srinivasan with sj = sb and r infinite, both <-> He with fd = 0;
    - anything with bands of 0 <-> Ideal.

    These conversions keep the parameters, but the valve behaves differently:

    - Kano or Choudhury <-> He: positions differ by at most J at any instant, and not at all on held steps;
    - Kano or Choudhury <-> Stenman (S = J only);
    - any valve to Srinivasan with an `r` given here.

    A Srinivasan valve with r above 0 has no Kano or Choudhury form. A Srinivasan valve with tables or `as_printed`
    has no other form. These conversions raise a `ParameterError`.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.models.parameter_conversion import convert_valve
    >>> convert_valve(st.Kano(S=3.0, J=1.0), "Srinivasan").sb
    2.0
    """
    target = _CLASSES.get(model if isinstance(model, str) else model.__name__)
    source = type(valve)
    if target is None or source not in _CLASSES.values():
        wrong = source.__name__ if target else (model if isinstance(model, str) else model.__name__)
        raise ParameterError(f"{wrong} cannot be converted; use one of {', '.join(sorted(_CLASSES))}.")
    if r is not None and target is not Srinivasan:
        raise ParameterError(f"r = {r:g} %/s is not a parameter of {target.__name__}; leave it out.")
    if dt is not None:
        dt = require_positive("dt", dt, "s")
    if isinstance(valve, Srinivasan):
        _reject_different_valve(valve, target, dt)
    if source is target and r is None:
        return valve
    S, J = _SJ_of(valve)
    travel = valve.travel
    if target is Srinivasan:
        sb, sj = SJ_to_stick_bands(S, J)
        return Srinivasan(sb, sj, _equivalent_rate(valve, dt) if r is None else r, travel=travel)
    if target is He:
        return He(*SJ_to_friction_bands(S, J), travel=travel)
    if target is Kano:
        return Kano(S, J, travel=travel)
    if target is Choudhury:
        if J > S:
            raise ParameterError(
                f"J = {J:g} % exceeds S = {S:g} %: there Choudhury's model differs from Kano's; keep Kano."
            )
        return Choudhury(S, J, travel=travel)
    if target is Stenman:
        if not math.isclose(S, J, rel_tol=TIE_TOLERANCE):
            raise ParameterError(
                f"S = {S:g} % and J = {J:g} % differ: Stenman's valve has one band, S = J = d. Keep the valve, or "
                "decide on a d and write Stenman(d)."
            )
        return Stenman(J, travel=travel)
    if S + J > 0.0:
        raise ParameterError(
            f"S = {S:g} % and J = {J:g} % are not 0, but an ideal valve has no friction. Keep the valve, or write "
            "Ideal()."
        )
    return Ideal(travel=travel)


def _SJ_of(valve: Valve) -> tuple[float, float]:
    """(S, J) of a valve [% of span]."""
    if isinstance(valve, Kano | Choudhury):
        return valve.S, valve.J
    if isinstance(valve, He):
        return friction_bands_to_SJ(valve.fs, valve.fd)
    if isinstance(valve, Srinivasan):
        return stick_bands_to_SJ(valve.sb, valve.sj)  # type: ignore[arg-type]
    if isinstance(valve, Stenman):
        return valve.d, valve.d
    return 0.0, 0.0


def _equivalent_rate(valve: Valve, dt: float | None) -> float:
    """Rate of the equivalent Srinivasan valve [% of span / s]."""
    if isinstance(valve, Srinivasan):
        return valve.r
    if isinstance(valve, Stenman):
        return math.inf
    if isinstance(valve, Choudhury) and valve.J > valve.S:
        raise ParameterError(
            f"J = {valve.J:g} % exceeds S = {valve.S:g} %: there Choudhury's model has no Srinivasan form; use Kano."
        )
    if isinstance(valve, He):
        if dt is None:
            raise ParameterError(
                "He's valve follows only above (fs - fd) / dt [%/s], which changes with the sampling period; give dt "
                "in s, or give r."
            )
        # A move of exactly J moves neither the stem of He's valve nor that of the new valve.
        return (valve.fs - valve.fd + TIE_TOLERANCE * valve.fs) / (1.0 - TIE_TOLERANCE) / dt
    return 0.0


def _reject_different_valve(valve: Srinivasan, target: type[Valve], dt: float | None) -> None:
    """Raise when only a Srinivasan valve has this behaviour."""
    if target is Srinivasan:
        return
    if not isinstance(valve.sb, float) or not isinstance(valve.sj, float):
        raise ParameterError(
            f"sb or sj is a table: {target.__name__} has constant bands. Take the values at one position, "
            "Srinivasan(sb.at(x), sj.at(x), r), and convert that."
        )
    if valve.as_printed:
        raise ParameterError(
            f"eq. 5 as printed has no equivalent {target.__name__} valve; convert Srinivasan(sb, sj, r), the repaired "
            "form."
        )
    if valve.sb == 0.0:
        return
    if target in (Kano, Choudhury) and valve.r != 0.0:
        raise ParameterError(
            f"r = {valve.r:g} %/s: {target.__name__}'s valve follows at any rate. Set r = 0 first; on slow ramps that "
            "is a different valve."
        )
    if target is Stenman and not math.isinf(valve.r):
        raise ParameterError(
            f"r = {valve.r:g} %/s: Stenman's valve never follows. Set r to infinity first; on fast ramps that "
            "is a different valve."
        )
    if target is He and not (math.isinf(valve.r) and valve.sb == valve.sj):
        if dt is None:
            raise ParameterError("He's valve follows only above (fs - fd) / dt [%/s]; give dt in s, to compare with r.")
        if not math.isclose(valve.r * dt, valve.sj, rel_tol=1e-6, abs_tol=1e-8 * valve.sb):
            raise ParameterError(
                f"r = {valve.r:g} %/s is not the threshold sj / dt = {valve.sj / dt:g} %/s of He's valve; set r to it "
                "first, or convert the parameters alone with stick_to_friction_bands(sb, sj)."
            )


def _require_band(name: str, value: float) -> float:
    return require_not_negative(name, value, "% of span")

r"""Conversion between the parameters of the two-parameter valves: (S, J), (fs, fd) and (sb, sj).

.. math::

    fs = sb = \tfrac{1}{2}(S + J) \qquad fd = sb - sj = \tfrac{1}{2}(S - J)

    S = fs + fd = 2\,sb - sj \qquad J = fs - fd = sj

The valves differ in when the stem sticks again, so that equal parameters do not always make the same valve (see
`convert_valve`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.errors import ParameterError, require_not_negative, require_positive
from stiction.models.component import TIE_TOLERANCE
from stiction.models.valves import Choudhury, He, Ideal, Kano, Srinivasan, Stenman

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.models.component import Valve

__all__ = ["BANDS", "convert_bands", "convert_valve"]


class _Bands(NamedTuple):
    """A pair of parameters, and its relation to (S, J)."""

    to_SJ: Callable[[float, float], tuple[float, float]]
    from_SJ: Callable[[float, float], tuple[float, float]]


BANDS = {
    "S, J": _Bands(lambda S, J: (S, J), lambda S, J: (S, J)),
    "fs, fd": _Bands(lambda fs, fd: (fs + fd, fs - fd), lambda S, J: ((S + J) / 2.0, (S - J) / 2.0)),
    "sb, sj": _Bands(lambda sb, sj: (2.0 * sb - sj, sj), lambda S, J: ((S + J) / 2.0, J)),
}
"""Names of two parameters [% of span] -> their relation to S and J."""


_FIELDS: dict[type[Valve], tuple[str, ...]] = {
    Choudhury: ("S", "J"), Kano: ("S", "J"), He: ("fs", "fd"), Srinivasan: ("sb", "sj"), Stenman: ("d", "d"), Ideal: (),
}  # fmt: skip
"""Model -> its two parameters [% of span]. Stenman's one is both S and J; an ideal valve has S = J = 0."""


def convert_bands(first: float, second: float, source: str, target: str) -> tuple[float, float]:
    """Convert two parameters of a valve to two others.

    `first`, `second`: the parameters that `source` names [% of span]. `source`, `target`: "S, J", "fs, fd" or "sb, sj".
    Returns the parameters that `target` names [% of span]. Raises ParameterError when a number is negative, or a
    parameter of the target would be.

    Examples
    --------
    >>> from stiction.models.parameter_conversion import convert_bands
    >>> convert_bands(3.0, 1.0, "S, J", "fs, fd"), convert_bands(2.0, 1.0, "sb, sj", "S, J")
    ((2.0, 1.0), (3.0, 1.0))
    """
    given, names = source.split(", "), target.split(", ")
    values = [require_not_negative(name, x, "% of span") for name, x in zip(given, (first, second), strict=True)]
    SJ = BANDS[source].to_SJ(*values)
    converted = BANDS[target].from_SJ(*SJ)
    for name, x in (*zip(("S", "J"), SJ, strict=True), *zip(names, converted, strict=True)):
        if x < 0.0:
            raise ParameterError(
                f"{given[0]} = {values[0]:g} % and {given[1]} = {values[1]:g} % have no ({target}): {name} would be "
                f"{x:g} %. An overshooting valve (J > S) has the forms Kano(S, J) and Srinivasan(sb, sj, r=0); for it "
                "keep one of these."
            )
    return converted


def convert_valve(valve: Valve, model: type[Valve] | str, *, r: float | None = None, dt: float | None = None) -> Valve:
    """Convert a valve to another model.

    `valve`: ideal, Stenman, Kano, Choudhury, He or Srinivasan. `model`: the model to convert to, as class or name. `r`:
    rate of the Srinivasan valve to make [% of span / s]; by default the rate of the same valve. `dt`: sampling period
    [s]; He's valve has a hidden rate threshold (fs - fd) / dt, so its way to and from Srinivasan's needs it. Returns
    the valve, with the same travel. Raises ParameterError when the valve has no such form; the message says what to do.

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
    name = model if isinstance(model, str) else model.__name__
    target = next((kind for kind in _FIELDS if kind.__name__ == name), None)
    if target is None or type(valve) not in _FIELDS:
        wrong = type(valve).__name__ if target else name
        known = ", ".join(sorted(kind.__name__ for kind in _FIELDS))
        raise ParameterError(f"{wrong} cannot be converted; use one of {known}.")
    if r is not None and target is not Srinivasan:
        raise ParameterError(f"r = {r:g} %/s is not a parameter of {name}; leave it out.")
    if dt is not None:
        dt = require_positive("dt", dt, "s")
    if isinstance(valve, Srinivasan) and target is not Srinivasan:
        _reject(_only_srinivasan(valve, target, dt))
    if type(valve) is target and r is None:
        return valve
    first, second = [getattr(valve, field) for field in _FIELDS[type(valve)]] or (0.0, 0.0)
    S, J = convert_bands(first, second, _bands_of(type(valve)), "S, J")
    _reject(_no_such_form(valve, target, S, J))
    settings: dict[str, Any] = dict(zip(_FIELDS[target], convert_bands(S, J, "S, J", _bands_of(target)), strict=False))
    if target is Srinivasan:
        settings["r"] = _equivalent_rate(valve, dt) if r is None else r
    return target(**settings, travel=valve.travel)


def _bands_of(model: type[Valve]) -> str:
    """Key of `BANDS` for a model."""
    key = ", ".join(_FIELDS[model])
    return key if key in BANDS else "S, J"


def _reject(rules: list[tuple[bool, str]]) -> None:
    """Raise for the first rule that applies."""
    for applies, message in rules:
        if applies:
            raise ParameterError(message)


def _no_such_form(valve: Valve, target: type[Valve], S: float, J: float) -> list[tuple[bool, str]]:
    """Whether the target cannot have these bands, with what to do."""
    bands = f"S = {S:g} % and J = {J:g} %"
    overshoots = J > S and (target is Choudhury) != isinstance(valve, Choudhury)
    return [
        (overshoots and target in (Choudhury, Srinivasan),
         f"J = {J:g} % exceeds S = {S:g} %: there Choudhury's model differs from Kano's; use Kano."),
        (target is Stenman and not math.isclose(S, J, rel_tol=TIE_TOLERANCE),
         f"{bands} differ: Stenman's valve has one band, S = J = d. Keep the valve, or decide on a d and write "
         "Stenman(d)."),
        (target is Ideal and S + J > 0.0,
         f"{bands} are not 0, but an ideal valve has no friction. Keep the valve, or write Ideal()."),
    ]  # fmt: skip


def _equivalent_rate(valve: Valve, dt: float | None) -> float:
    """Rate of the equivalent Srinivasan valve [% of span / s]."""
    if isinstance(valve, Srinivasan):
        return valve.r
    if isinstance(valve, Stenman):
        return math.inf
    if not isinstance(valve, He):
        return 0.0
    if dt is None:
        raise ParameterError(
            "He's valve follows only above (fs - fd) / dt [%/s], which changes with the sampling period; give dt in s, "
            "or give r."
        )
    # A move of exactly J moves neither the stem of He's valve nor that of the new valve.
    return (valve.fs - valve.fd + TIE_TOLERANCE * valve.fs) / (1.0 - TIE_TOLERANCE) / dt


def _only_srinivasan(valve: Srinivasan, target: type[Valve], dt: float | None) -> list[tuple[bool, str]]:
    """Whether only a Srinivasan valve has this behaviour, with what to do."""
    name, sb, sj = target.__name__, valve.sb, valve.sj
    if not isinstance(sb, float) or not isinstance(sj, float):
        message = (
            f"sb or sj is a table: {name} has constant bands. Take the values at one position, "
            "Srinivasan(sb.at(x), sj.at(x), r), and convert that."
        )
        return [(True, message)]
    to_he = target is He and not (math.isinf(valve.r) and sb == sj)
    at_threshold = dt is not None and math.isclose(valve.r * dt, sj, rel_tol=1e-6, abs_tol=1e-8 * sb)
    return [
        (valve.as_printed,
         f"eq. 5 as printed has no equivalent {name} valve; convert Srinivasan(sb, sj, r), the repaired form."),
        (sb > 0.0 and target in (Kano, Choudhury) and valve.r != 0.0,
         f"r = {valve.r:g} %/s: {name}'s valve follows at any rate. Set r = 0 first; on slow ramps that is a different "
         "valve."),
        (sb > 0.0 and target is Stenman and not math.isinf(valve.r),
         f"r = {valve.r:g} %/s: Stenman's valve never follows. Set r to infinity first; on fast ramps that is a "
         "different valve."),
        (sb > 0.0 and to_he and dt is None,
         "He's valve follows only above (fs - fd) / dt [%/s]; give dt in s, to compare with r."),
        (sb > 0.0 and to_he and not at_threshold,
         f"r = {valve.r:g} %/s is not the threshold sj / dt = {sj / (dt or 1.0):g} %/s of He's valve; set r to it "
         'first, or convert the parameters alone with convert_bands(sb, sj, "sb, sj", "fs, fd").'),
    ]  # fmt: skip

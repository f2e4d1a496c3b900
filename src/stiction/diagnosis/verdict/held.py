"""Findings that are held at an end of their scale: what is beyond it is not told, and no number may hide that."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.display.number_format import format_number

if TYPE_CHECKING:
    from stiction.diagnosis.result import Counted

__all__ = ["HELD", "held", "value_of"]

HELD = {
    "band": 0.7,
    "floor": 0.5,
    "advantage": 0.7,
    "better": 1.0,
    "better_best": 1.0,
    "better_worst": 1.0,
    "better_with_jump": 3.0,
    "S_high": 1.0,
    "jump_high": 1.5,
    "likely_band": 1.5,
    "likely_S_high": 1.0,
    "likely_jump_high": 1.5,
    "time_constant": 1.0,
    "time_constant_linear": 1.0,
    "lag": 2.0,
    "dead_time": 2.0,
    "margin": 1.5,
    "regularity": 1.0,
    "cycles": 1.5,
    "samples": 1.0,
    "wander": 1.0,
    "decay": 2.0,
    "tails_pv": 1.0,
    "tails_op": 1.0,
    "coarse": 1.0,
    "spikes": 1.0,
}
"""Upper end at which a finding is held [-]. A share of a likelihood that is kept is not among them: it
is 1 as well where there is no rival to keep it over."""


def held(feature: str, value: float) -> float:
    """Return a finding, or the end of its scale where it is beyond that.

    Examples
    --------
    >>> held("band", 0.91), held("band", 0.42)
    (0.7, 0.42)
    """
    return min(value, HELD[feature])


def value_of(one: Counted) -> str:
    r"""Return the value of a finding as text, with what it may be where it is held.

    Parameters
    ----------
    one : Counted
        What counted.

    Returns
    -------
    str
        Two significant digits, and "or more" at the end of its scale.

    Examples
    --------
    >>> from stiction.diagnosis.result import Counted
    >>> value_of(Counted("band", 0.7, 0.31, 2.4)), value_of(Counted("band", 0.42, 0.31, 0.4))
    ('0.7 or more', '0.42')
    """
    text = format_number(one.value, significant=2)
    # A mean of values that are held is held itself but for rounding.
    return f"{text} or more" if one.value > HELD.get(one.feature, float("inf")) - 1e-9 else text

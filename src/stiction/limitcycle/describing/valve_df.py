"""The describing function of any valve."""

from __future__ import annotations

from reprlib import repr as brief
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, require_finite, require_numbers, require_positive
from stiction.limitcycle.continuous_form import continuous_form, is_frictionless
from stiction.limitcycle.describing.event_df import continuous_form_df
from stiction.limitcycle.describing.numeric_df import numeric_dfs
from stiction.limitcycle.describing.staircase import rest_level_offset, staircase_df, staircase_levels, stenman_printed
from stiction.limitcycle.describing.two_parameter import two_parameter_df
from stiction.models import Choudhury, Ideal, Kano, Srinivasan, Stenman

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from stiction.models import Valve

__all__ = ["describing_function", "is_rate_dependent"]


def is_rate_dependent(valve: Any) -> bool:
    """Whether N depends on the frequency: physical valves, and Srinivasan's with a finite rate other than 0."""
    if hasattr(valve, "describing_function"):
        return False
    if isinstance(valve, Srinivasan):
        return valve.as_printed or continuous_form(valve) is None or 0.0 < valve.r < float("inf")
    return continuous_form(valve) is None and not isinstance(valve, Ideal | Choudhury)


def describing_function(
    valve: Valve | Any,
    amplitude: ArrayLike,
    omega: ArrayLike | None = None,
    *,
    family: str | float = "half",
    as_printed: bool | str = False,
    method: str = "auto",
    tolerance: float = 1e-4,
    centre: float = 0.0,
) -> NDArray[np.complex128]:
    r"""Describing function of a valve: N = (fundamental of the stem) / (its sinusoidal input).

    Parameters
    ----------
    valve : Valve or Saturation, Relay, Deadband, Quantiser
        The nonlinearity.
    amplitude : array_like
        Amplitude of the input [% of span], any shape.
    omega : array_like, optional
        Frequency of the input [rad/s], broadcast against `amplitude`; needed where N depends on the rate.
    family : str or float
        Rest levels of a staircase (Stenman, He, Srinivasan with r infinite): "half" for +-d/2, +-3d/2, ...,
        "integer" for 0, +-d, ..., or one level [% of span].
    as_printed : bool or str
        Stenman only: eqs. 6-7 letter by letter; "roots repaired" corrects the first misprint only.
    method : str
        "auto" takes the closed form where there is one; "events" is exact between slips; "numeric" drives the
        compiled valve with a sampled sine until successive periods agree.
    tolerance : float
        Largest error of the numeric method [-].
    centre : float
        Mean of the sine [% of span]; it has an effect on valves with end stops, such as a physical valve.

    Returns
    -------
    ndarray of complex
        N, in the shape of `amplitude` and `omega` together; 0 where the stem does not move.

    Raises
    ------
    ParameterError
        When an amplitude, a frequency or `tolerance` is not positive, `omega` is missing or of another shape, `family`
        is unknown, `centre` is not finite, or the method does not fit the valve.
    ConvergenceError
        When the numeric method does not meet the tolerance.

    References
    ----------
    srinivasan2008, eqs. 6, 7 (corrected: the inner roots count twice); choudhury2005.

    Examples
    --------
    >>> import stiction as st
    >>> complex(st.describing_function(st.Stenman(0.5), 1.0)).__format__(".4f")
    '0.8269-0.2387j'
    """
    if not (hasattr(valve, "pack") or hasattr(valve, "describing_function")):
        raise ParameterError(f"valve is of type {type(valve).__name__}; give a valve model such as Kano(S, J).")
    size = _require_positive_values("amplitude", amplitude, "% of span")
    rest_level_offset(1.0, family)
    tolerance, centre = require_positive("tolerance", tolerance), require_finite("centre", centre, "% of span")
    if as_printed is not False:
        if not isinstance(valve, Stenman):
            raise ParameterError(f"eqs. 6-7 are for Stenman's valve, not {type(valve).__name__}; leave as_printed out.")
        if as_printed not in (True, "roots repaired"):
            raise ParameterError(f"as_printed = {as_printed!r} is unknown; use True, False or 'roots repaired'.")
        return stenman_printed(valve.d, size, roots_repaired=as_printed == "roots repaired")
    if method not in ("auto", "events", "numeric"):
        raise ParameterError(f"method = {method!r} is unknown; use 'auto', 'events' or 'numeric'.")
    if omega is None and is_rate_dependent(valve):
        raise ParameterError(f"{type(valve).__name__} depends on the rate of its input; give omega in rad/s.")
    speed = _require_positive_values("omega", 1.0 if omega is None else omega, "rad/s")
    try:
        size, speed = np.broadcast_arrays(size, speed)
    except ValueError:
        raise ParameterError(
            f"amplitude has shape {size.shape} and omega {speed.shape}, which do not match; give equal shapes."
        ) from None
    flat = _evaluate(valve, size.ravel(), speed.ravel(), family, method, tolerance, centre)
    return flat.reshape(size.shape)


def _require_positive_values(name: str, value: ArrayLike, unit: str) -> NDArray[np.float64]:
    array = require_numbers(name, value, unit)
    if np.any(array <= 0.0):
        raise ParameterError(f"{name} = {brief(value)} must be positive [{unit}]; give values above 0.")
    return array


def _evaluate(valve: Any, size, speed, family: str | float, method: str, tolerance: float, centre: float):
    """N over flat arrays of amplitude and frequency."""
    if hasattr(valve, "describing_function"):
        return valve.describing_function(size)
    free = bool(np.all(np.isinf(valve.travel)))
    if free and is_frictionless(valve):
        return np.ones(size.shape, dtype=complex)
    valve_form, start = continuous_form(valve) if free else None, None
    if valve_form is not None and valve_form.staircase:
        offset = rest_level_offset(valve_form.jump, family)
        if method == "auto":
            return staircase_df(valve_form.sb, valve_form.lag, offset, size)
        levels = [staircase_levels(valve_form.sb, valve_form.lag, offset, a) for a in size]
        start = np.array([x[0] if x else offset for x in levels])
    if method == "numeric" or valve_form is None:
        if method == "events":
            raise ParameterError(f"{valve!r} has no event-by-event form; use method = 'numeric'.")
        return numeric_dfs(valve, size, speed if is_rate_dependent(valve) else None, start, tolerance, centre)
    if method == "auto" and isinstance(valve, Kano | Choudhury):
        return two_parameter_df(valve.S, valve.J, size)
    if start is None:
        start = valve_form.lag - size
    value, turns = continuous_form_df(*valve_form, size, speed, start)
    if np.any(turns >= 64):
        value[turns >= 64] = numeric_dfs(valve, size[turns >= 64], speed[turns >= 64], None, tolerance, centre)
    return value

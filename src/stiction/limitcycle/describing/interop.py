"""Valves as describing-function nonlinearities of python-control (extra `control`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import MissingExtraError, ParameterError
from stiction.limitcycle.describing.valve_df import describing_function, is_rate_dependent

if TYPE_CHECKING:
    from stiction.models import Valve

__all__ = ["as_control_nonlinearity"]


def as_control_nonlinearity(valve: Valve, *, family: str | float = "half") -> Any:
    """Wrap a valve for `control.describing_function_response` and `describing_function_plot`.

    Parameters
    ----------
    valve : Valve
        A valve whose N does not depend on the rate of its input.
    family : str or float
        Family of rest levels, see `describing_function`.

    Returns
    -------
    control.DescribingFunctionNonlinearity
        Its `describing_function(A)` is exact; called as a function it is the valve itself, sample by sample,
        with memory.

    Raises
    ------
    MissingExtraError
        When python-control is not installed.
    ParameterError
        When N depends on the rate of the input.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import as_control_nonlinearity
    >>> complex(as_control_nonlinearity(st.Stenman(0.5)).describing_function(1.0)).real.__round__(4)
    0.8269
    """
    try:
        from control import DescribingFunctionNonlinearity
    except ImportError:
        raise MissingExtraError(
            'python-control is not installed; install it with: pip install "stiction[control]"'
        ) from None
    if is_rate_dependent(valve):
        raise ParameterError(
            f"{type(valve).__name__} depends on the rate of its input, which python-control cannot represent; use "
            "stiction.describing_function with omega."
        )

    class StickyValve(DescribingFunctionNonlinearity):
        """A sticky valve."""

        def __init__(self) -> None:
            self._state = None

        def __call__(self, A: float) -> float:
            """Stem position after this sample of the input, the valve at rest at 0 before the first."""
            from stiction.models.dispatch import valve_at_rest, valve_step

            packed = valve.pack(1.0)
            before = valve_at_rest(valve.code, 0.0, 0.0, packed) if self._state is None else self._state
            self._state = valve_step(valve.code, float(A), before, packed)
            return float(self._state.position)

        def describing_function(self, A: Any) -> Any:
            """N(A)."""
            value = describing_function(valve, np.abs(A), family=family)
            return complex(value) if value.ndim == 0 else value

        def _isstatic(self) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
            return False

        def _f(self, x: float) -> float:
            return self(x)

    return StickyValve()

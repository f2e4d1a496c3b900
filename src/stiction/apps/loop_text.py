"""A control loop from options or a TOML file: the process, the controller, the valve and the compensator in text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.apps import model_text
from stiction.errors import ParameterError, RecordError, require_finite

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.models import Loop
    from stiction.records import LoopRecord

__all__ = ["make_loop", "ran_away", "settings_of", "within"]

FAR = 1000.0
"""Distance from its start at which an OP has run away: ten spans [% of span]."""


def settings_of(path: str | None, typed: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was typed, over what the TOML file says, over the defaults.

    Parameters
    ----------
    path : str, optional
        TOML file whose keys are those of `defaults`.
    typed : mapping
        Options; None where not given.
    defaults : mapping
        Every setting there is.

    Raises
    ------
    RecordError
        When the file cannot be read or is no TOML.
    ParameterError
        When the file has a key that is not a setting.
    """
    from_file = {} if path is None else _toml(path)
    for key in from_file:
        if key not in defaults:
            raise ParameterError(f'{path}: "{key}" is not a setting of a loop; there are {", ".join(defaults)}.')
    return {**defaults, **from_file, **{key: value for key, value in typed.items() if value is not None}}


def make_loop(settings: Mapping[str, Any]) -> Loop:
    """Make the loop of ``process``, ``controller``, ``valve``, ``dt``, and if given ``noise`` and ``compensator``.

    Examples
    --------
    >>> loop = make_loop({"process": "3/(10s+1)", "controller": "pi:Kc=1,Ti=10", "valve": "ideal", "dt": 1.0})
    >>> loop.process.order
    1
    """
    from stiction.models import Loop

    compensator = settings.get("compensator")
    return Loop(
        model_text.controller(settings["controller"]),
        model_text.valve(settings["valve"]),
        model_text.process(settings["process"]),
        dt=require_finite("dt", settings["dt"], "s"),
        noise=settings.get("noise", 0.0),
        compensator=None if compensator in (None, "none") else model_text.compensator(compensator),
    )


def within(name: str, value: float, low: float = 0.0, high: float = 100.0) -> float:
    """Return a place of the stem [% of span], or say that the stem cannot be there.

    Examples
    --------
    >>> within("op_start", 50.0)
    50.0
    """
    number = require_finite(name, value, "% of span")
    if not low <= number <= high:
        raise ParameterError(
            f"{name} = {number:g} % of span is outside {low:g} to {high:g} % of span; give a value in between."
        )
    return number


def ran_away(loop: Loop, record: LoopRecord) -> str:
    """Say that a loop has run away, and why; empty where it has not."""
    import numpy as np

    from stiction.limitcycle.predict import UNSTABLE_TEXT, is_unstable

    assert record.pv is not None
    lost = not (np.isfinite(record.op).all() and np.isfinite(record.pv).all())
    if not lost and float(np.abs(record.op - record.op[0]).max()) < FAR:
        return ""
    why = "Turn or lower the gain of the controller, give it op_limits=0..100, or shorten dt."
    if is_unstable(loop):
        why = f"{UNSTABLE_TEXT}: turn or lower the gain of the controller."
    return f"The loop ran away: OP leaves its start by more than {FAR:g} % of span. {why}"


def _toml(path: str) -> dict[str, Any]:
    import tomllib

    try:
        with open(path, "rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror}); check the name and the rights.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RecordError(f"{path}: is no TOML file ({error}).") from None

"""Make a control loop from options or a TOML file: process, controller, valve and compensator as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.apps import parse_model
from stiction.errors import ParameterError, RecordError, require_finite

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.models import Loop
    from stiction.records import LoopRecord

__all__ = ["make_loop", "merge_settings", "require_position", "runaway_message"]

RUNAWAY_DISTANCE_PERCENT = 1000.0
"""Distance from its start at which OP counts as running away [% of span]."""


def merge_settings(path: str | None, typed: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Merge options, TOML file and defaults, in this order of priority.

    `path`: TOML file whose keys are those of `defaults`. `typed`: Options; None when not given. `defaults`: all
    settings with their defaults. Raises RecordError when the file cannot be read or is not TOML. Raises ParameterError
    when the file has a key that is not a setting.
    """
    from_file = {} if path is None else _toml(path)
    for key in from_file:
        if key not in defaults:
            raise ParameterError(f'"{key}" is not a setting of a loop; use {", ".join(defaults)}.', where=path or "")
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
        parse_model.parse_controller(settings["controller"]),
        parse_model.parse_valve(settings["valve"]),
        parse_model.parse_process(settings["process"]),
        dt=require_finite("dt", settings["dt"], "s"),
        noise=settings.get("noise", 0.0),
        compensator=None if compensator in (None, "none") else parse_model.parse_compensator(compensator),
    )


def require_position(name: str, value: float, low: float = 0.0, high: float = 100.0) -> float:
    """Return a stem position [% of span], or refuse one outside `low` to `high` [% of span].

    Examples
    --------
    >>> require_position("op_start", 50.0)
    50.0
    """
    number = require_finite(name, value, "% of span")
    if not low <= number <= high:
        raise ParameterError(
            f"{name} = {number:g} % of span is outside {low:g} to {high:g} %; give a value within these limits."
        )
    return number


def runaway_message(loop: Loop, record: LoopRecord) -> str:
    """Say that a simulated loop runs away, and why; empty when it does not."""
    import numpy as np

    from stiction.limitcycle.predict import UNSTABLE_TEXT, is_unstable

    assert record.pv is not None
    lost = not (np.isfinite(record.op).all() and np.isfinite(record.pv).all())
    if not lost and float(np.abs(record.op - record.op[0]).max()) < RUNAWAY_DISTANCE_PERCENT:
        return ""
    why = "Change the sign of the controller gain, lower it, add op_limits=0..100, or give a shorter dt."
    if is_unstable(loop):
        why = f"{UNSTABLE_TEXT}: change the sign of the controller gain, or lower it."
    return f"The loop runs away: OP moves more than {RUNAWAY_DISTANCE_PERCENT:g} % of span from its start. {why}"


def _toml(path: str) -> dict[str, Any]:
    import tomllib

    try:
        with open(path, "rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise RecordError(
            f"cannot be read ({error.strerror}); check the name and the access rights.", where=path
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RecordError(f"is not a TOML file ({error}); correct it.", where=path) from None

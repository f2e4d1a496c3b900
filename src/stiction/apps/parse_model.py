"""Make models from text: ``kano:S=3,J=1``, ``pi:Kc=0.2,Ti=10``, ``two-move:S=3,J=1,band=1``, or from a TOML table.

The text is a name and its parameters. A value is a number, ``yes`` or ``no``, ``LOW..HIGH``, several numbers separated
by spaces, ``POSITION:VALUE POSITION:VALUE`` for a parameter that varies over the travel, or text with a unit ("3 lbm").
"""

from __future__ import annotations

import difflib
import inspect
import math
import re
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, StictionError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stiction.models import PID, Compensator, TransferFunction, Valve

__all__ = [
    "build_model",
    "parse_compensator",
    "parse_controller",
    "parse_process",
    "parse_value",
    "parse_valve",
    "parse_valve_or_compensator",
    "split_spec",
]

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_PAIRS = re.compile(rf"{_NUMBER}:{_NUMBER}(?:\s+{_NUMBER}:{_NUMBER})+")
_SERIES = re.compile(rf"{_NUMBER}(?:\s+{_NUMBER})+")
_BOOLEANS = {"yes": True, "true": True, "no": False, "false": False}


def parse_valve(spec: str | Mapping[str, Any]) -> Valve:
    """Make a valve from the name of a model or of a published parameter set.

    `spec`: text, or a mapping with the key "model". Raises ParameterError when the name or a parameter is unknown,
    missing or outside its limits; the error lists the known ones.

    Examples
    --------
    >>> made = parse_valve("kano:S=3,J=1")
    >>> made.S, made.J
    (3.0, 1.0)
    """
    from stiction import models
    from stiction.models.model_properties import VALVE_PROPERTIES
    from stiction.models.parameter_sets import PUBLISHED_VALVES
    from stiction.models.positioner import Positioner

    makers: dict[str, Callable[..., Any]] = {
        name.lower().removesuffix("valve"): getattr(models, name) for name in VALVE_PROPERTIES
    }
    name, given = split_spec("valve", spec)
    parts = {key.partition(".")[2]: given.pop(key) for key in list(given) if key.startswith("positioner.")}
    parts |= given.pop("positioner", {})
    if parts:
        given["positioner"] = build_model("positioner", "positioner", {"positioner": Positioner}, parts)
    if name in PUBLISHED_VALVES:
        build_model("valve", name, {name: models.PhysicalValve}, given, complete=False)
        return PUBLISHED_VALVES[name](**{key: parse_value(text) for key, text in given.items()})
    return build_model("valve", name, makers, given, also=PUBLISHED_VALVES)


def parse_controller(spec: str | Mapping[str, Any]) -> PID:
    """Make a controller: ``p``, ``pi``, ``pid`` (standard form) or ``parallel``.

    `spec`: text, or a mapping with the key "model". Raises ParameterError when the name or a parameter is unknown,
    missing or outside its limits.

    Examples
    --------
    >>> parse_controller("pi:Kc=0.2,Ti=10").Ki
    0.02
    """
    from stiction.models import PID

    def p(Kc: float, b: float = 1.0, op_limits: Any = (-math.inf, math.inf)) -> PID:
        return PID(Kc, math.inf, b=b, op_limits=op_limits)

    def parallel(Kp: float, Ki: float, Kd: float = 0.0, Tf: float = 0.0, op_limits: Any = (-math.inf, math.inf)) -> PID:
        return PID.parallel(Kp, Ki, Kd, Tf=Tf, op_limits=op_limits)

    name, given = split_spec("controller", spec)
    return build_model("controller", name, {"pi": PID, "pid": PID, "p": p, "parallel": parallel}, given)


def parse_compensator(spec: str | Mapping[str, Any]) -> Compensator:
    """Make a compensator from its name, with or without hyphens.

    `spec`: text, or a mapping with the key "model". Raises ParameterError when the name or a parameter is unknown,
    missing or outside its limits.

    Examples
    --------
    >>> parse_compensator("constant-reinforcement:amplitude=1.5")
    ConstantReinforcement(amplitude=1.5)
    """
    from stiction.models import compensators

    classes = [name for name in compensators.__all__ if name != "Compensator"]
    makers = {re.sub(r"(?<!^)(?=[A-Z])", "-", name).lower(): getattr(compensators, name) for name in classes}
    name, given = split_spec("compensator", spec)
    return build_model("compensator", name, makers, given)


def parse_valve_or_compensator(spec: str) -> Valve | Compensator:
    """Make a valve, or a compensator where the name is that of one.

    Raises ParameterError when the name or a parameter is unknown, missing or outside its limits.

    Examples
    --------
    >>> parse_valve_or_compensator("stenman:d=2").d, parse_valve_or_compensator("integral-deadband:band=1").band
    (2.0, 1.0)
    """
    from stiction.models import compensators

    name = split_spec("model", spec)[0].replace("-", "")
    known = {one.lower() for one in compensators.__all__}
    return parse_compensator(spec) if name in known else parse_valve(spec)


def parse_process(spec: str | Mapping[str, Any]) -> TransferFunction:
    """Make a process from ``fopdt``, ``sopdt``, ``integrating``, ``tf``, or a transfer function in s.

    `spec`: text, or a mapping with the key "model". Raises ParameterError when the text cannot be read, or a parameter
    is unknown, missing or outside its limits.

    Examples
    --------
    >>> parse_process("3 exp(-10s)/(10s+1)").dead_time, parse_process("fopdt:K=3,tau=10").den.tolist()
    (10.0, [10.0, 1.0])
    """
    from stiction.models import FOPDT, SOPDT, Integrating, TransferFunction
    from stiction.models.parse_transfer_function import parse_transfer_function

    makers = {"fopdt": FOPDT, "sopdt": SOPDT, "integrating": Integrating, "tf": TransferFunction}
    written = isinstance(spec, str) and ":" not in spec and spec.strip().lower() not in makers
    if written and isinstance(spec, str):
        return TransferFunction(*parse_transfer_function(spec))
    name, given = split_spec("process", spec)
    return build_model("process", name, makers, given)


def split_spec(kind: str, spec: str | Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the name in lower case, and the parameters as text.

    Examples
    --------
    >>> split_spec("valve", "Kano: S=3, J=1")
    ('kano', {'S': '3', 'J': '1'})
    """
    if not isinstance(spec, str):
        given = dict(spec)
        name = given.pop("model", None)
        if not isinstance(name, str):
            raise ParameterError(f'{kind} has no model; add a line such as model = "kano".')
        return _normalise(name), given
    name, _, rest = spec.partition(":")
    given: dict[str, Any] = {}
    for part in filter(None, (part.strip() for part in re.split(r",(?![^(]*\))", rest))):
        key, equals, text = (piece.strip() for piece in part.partition("="))
        if not (key and equals and text):
            raise ParameterError(
                f'{kind} "{spec}": "{part}" is not of the form NAME=VALUE; write for example kano:S=3,J=1.'
            )
        if key in given:
            raise ParameterError(f'{kind} "{spec}" gives {key} twice; leave one of them out.')
        given[key] = text
    return _normalise(name), given


def _normalise(name: str) -> str:
    return name.strip().lower().replace("-", "")


def build_model(
    kind: str,
    name: str,
    makers: Mapping[str, Callable[..., Any]],
    given: Mapping[str, Any],
    *,
    also: Mapping[str, Any] | None = None,
    complete: bool = True,
) -> Any:
    """Call the function for a name with the given values, or list the known names and parameters."""
    name = next((known for known in makers if _normalise(known) == name), name)
    if name not in makers:
        known = [*makers, *(also or ())]
        close = difflib.get_close_matches(name, known, 1)
        hint = f' Did you mean "{close[0]}"?' if close else ""
        raise ParameterError(f'There is no {kind} "{name}"; use one of {", ".join(known)}.{hint}')
    known = [p for p in inspect.signature(makers[name]).parameters.values() if p.name != "_"]
    names = [p.name for p in known]
    accepted = ", ".join(p.name if p.default is p.empty else f"[{p.name}]" for p in known) or "no parameters"
    for key in given:
        if key not in names:
            close = difflib.get_close_matches(key, names, 1)
            hint = f' Did you mean "{close[0]}"?' if close else ""
            raise ParameterError(f'{kind} {name} has no parameter "{key}"; it takes {accepted}.{hint}')
    if not complete:
        return None
    missing = [p.name for p in known if p.default is p.empty and p.name not in given]
    if missing:
        raise ParameterError(f"{kind} {name} needs {', '.join(missing)}; it takes {accepted}.")
    try:
        return makers[name](**{key: parse_value(value) for key, value in given.items()})
    except StictionError as error:
        raise type(error)(f"{kind} {name}: {error}") from None
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{kind} {name} cannot be made ({error}); it takes {accepted}.") from None


def parse_value(text: Any) -> Any:
    """Convert the text of a value; a value that is not text, as in a TOML file, stays as it is.

    Examples
    --------
    >>> parse_value("3e-1"), parse_value("yes"), parse_value("0..100"), parse_value("10 1"), parse_value("3 lbm")
    (0.3, True, (0.0, 100.0), [10.0, 1.0], '3 lbm')
    """
    if isinstance(text, list) and len(text) > 1 and all(isinstance(pair, list) and len(pair) == 2 for pair in text):
        return _position_table(text)
    if not isinstance(text, str):
        return text
    try:
        return float(text)
    except ValueError:
        pass
    if text.lower() in _BOOLEANS:
        return _BOOLEANS[text.lower()]
    if _PAIRS.fullmatch(text):
        return _position_table([[float(x) for x in pair.split(":")] for pair in text.split()])
    if _SERIES.fullmatch(text):
        return [float(x) for x in text.split()]
    low, dots, high = text.partition("..")
    return (parse_value(low.strip()), parse_value(high.strip())) if dots else text


def _position_table(pairs: list[list[float]]) -> Any:
    import numpy as np

    from stiction.models import Table

    position, value = np.array(pairs, dtype=np.float64).T
    return Table(position, value)

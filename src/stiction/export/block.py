"""What is exported of a model: its variables, and its kernels in the target language."""

from __future__ import annotations

import dataclasses
import inspect
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, require_positive
from stiction.export.syntax import Array, CSyntax, Value
from stiction.export.translate import Translator, relations
from stiction.export.values import Fixed, Settings, TranslationError
from stiction.export.variables import Variable, settings_of
from stiction.models import Compensator, Valve, dispatch
from stiction.models.compensators.component import CompensatorState, compensator_at_rest
from stiction.models.component import ValveState

if TYPE_CHECKING:
    from collections.abc import Callable

    from stiction.export.syntax import Struct

__all__ = ["Block", "Packed", "block_of"]

OP = Variable("op", 0.0, "% of span", "Controller output.")
SP = Variable("sp", 0.0, "PV units", "Set point.")
PV = Variable("pv", 0.0, "PV units", "Process variable.")
POSITION = Variable("position", 0.0, "% of span", "Stem position.")
OFFSET = Variable("position_offset", 0.0, "% of span", "Stem position less OP before the first sample.")
COMPENSATED = (
    Variable("valve_signal", 0.0, "% of span", "Signal to the valve, before the output limits of the controller."),
    Variable("hold", 0.0, "-", "1 while the controller must hold its integral."),
    Variable("track", 0.0, "-", "1 while the controller must track the valve signal: the loop is open."),
)


@dataclass(frozen=True)
class Packed:
    """An array of numbers that a step takes: computed from the settings, or constant."""

    name: str
    """Its name in the exported record."""
    length: int
    """Numbers in it [-]."""
    function: str = ""
    """Function that computes it; empty where the numbers are constant."""
    constants: tuple[float, ...] = ()
    """The numbers, where they are constant."""


@dataclass
class Block:
    """A model as it is exported, in one target language."""

    name: str
    """Name of the exported model; functions and records begin with it."""
    title: str
    """What it is, one sentence."""
    source: str
    """The model in Python."""
    dt: float
    """Sampling period [s]."""
    syntax: CSyntax
    """Target language."""
    inputs: tuple[Variable, ...] = ()
    """Variables that each step takes."""
    outputs: tuple[Variable, ...] = ()
    """Variables that each step gives."""
    starts: tuple[Variable, ...] = ()
    """Settings of the start, besides those of the model."""
    start_arguments: tuple[tuple[str, str], ...] = ()
    """Argument of the function that starts the model, and the expression in variables that gives it."""
    settings: list[Variable] = field(default_factory=list)
    """Settings of the model that can be changed."""
    packed: list[Packed] = field(default_factory=list)
    """Arrays that a step takes."""
    state: Struct | None = None
    """The record that a step takes and gives."""
    arrays: tuple[tuple[str, int], ...] = ()
    """Arrays that a step changes, and their lengths."""
    at_rest: Value | None = None
    """The state before the first sample, in terms of the arguments of the start."""
    stepped: Value | None = None
    """The state after a sample, in terms of the inputs and of the state ``s``."""
    results: tuple[str, ...] = ()
    """The outputs, in terms of the state ``s``."""
    refusals: list[tuple[str, str]] = field(default_factory=list)
    """Conditions on the settings under which the model cannot start, and what each is about."""
    translator: Translator = field(init=False)
    """Its functions and records."""

    def __post_init__(self) -> None:
        self.translator = Translator(self.syntax)

    @property
    def parameters(self) -> list[Variable]:
        """All variables that are set before the start."""
        return [*self.settings, *self.starts]

    def pack(self, name: str, model: Any, prefix: str = "") -> Value:
        """Make the numbers of a model an array of the record; its settings become settings of the block.

        What the translator cannot compute from a setting keeps the value that it has now.
        """
        numbers = tuple(float(one) for one in model.pack(self.dt))
        names = [f.name for f in dataclasses.fields(model) if type(getattr(model, f.name)) is float]
        for adjustable in [names, *([n for n in names if n != one] for one in names)]:
            try:
                settings = Settings(model, frozenset(adjustable), "self", prefix)
                function, _ = self.translator.call_filling(type(model).pack, [settings, Value("double", "dt")])
            except TranslationError:
                continue
            self.packed.append(Packed(name, len(numbers), function))
            self.settings += settings_of(model, frozenset(adjustable), prefix)
            self.refusals += relations(self.translator, settings)
            break
        else:
            self.packed.append(Packed(name, len(numbers), "", numbers))
        return Value(Array(len(numbers)), self.syntax.member(name))

    def numbers(self, *names: str) -> list[Value]:
        """Variables as arguments of a kernel."""
        return [Value("double", name) for name in names]


def block_of(model: object, name: str | None, dt: float | None, syntax: Callable[[str], CSyntax] = CSyntax) -> Block:
    """Make the block of a valve, a compensator or a loop.

    Parameters
    ----------
    model : Valve, Compensator, Loop, Twin or Diagnosis
        The model.
    name : str, optional
        Name of the exported model; by default the name of its class in lower case.
    dt : float, optional
        Sampling period [s]; a loop has its own.
    syntax : callable
        Target language.

    Returns
    -------
    Block
        The model, translated.

    Raises
    ------
    ParameterError
        When the model is of another type, or the sampling period or the name is not allowed.
    """
    name = name or type(model).__name__.lower()
    make = _make_valve if isinstance(model, Valve) else _make_compensator if isinstance(model, Compensator) else None
    if make is None:
        raise ParameterError(
            f"model is of type {type(model).__name__}",
            remedy="give a valve such as Kano(5.0, 2.0), a compensator, a Loop, or a Diagnosis with an identified loop",
        )
    if dt is None:
        raise ParameterError("dt is missing", remedy="give the sampling period of the exported model in seconds")
    dt = require_positive("dt", dt, "s")
    title = (inspect.getdoc(type(model)) or "").split("\n\n")[0].replace("\n", " ")
    block = Block(name, title, repr(model), dt, syntax(name))
    make(block, model)
    return block


def _make_valve(block: Block, valve: Any) -> None:
    block.inputs, block.outputs, block.starts = (OP,), (POSITION,), (OFFSET,)
    block.start_arguments = (("op", "op"), ("position", "op + position_offset"))
    call, code = block.translator.call, Fixed(valve.code)
    p = block.pack("p", valve)
    block.state = block.translator.named_tuple(ValveState)
    s = Value(block.state, block.syntax.member("state"))
    block.at_rest = call(dispatch.valve_at_rest, [code, *block.numbers("op", "position"), p])
    block.stepped = call(dispatch.valve_step, [code, *block.numbers("op"), s, p])
    block.results = (call(dispatch.stem_position, [s, p]).text,)


def _make_compensator(block: Block, compensator: Any) -> None:
    block.inputs, block.outputs = (OP, SP, PV), COMPENSATED
    block.start_arguments = (("op", "op"), ("sp", "sp"))
    call, kind = block.translator.call, Fixed(compensator.code)
    p = block.pack("p", compensator)
    block.state = block.translator.named_tuple(CompensatorState)
    s = Value(block.state, block.syntax.member("state"))
    block.at_rest = call(compensator_at_rest, block.numbers("op", "sp"))
    block.stepped = call(dispatch.compensator_step, [kind, *block.numbers("op", "sp", "pv"), s, p])
    block.results = tuple(block.syntax.field(s.text, one.name) for one in block.outputs)


"""What is exported of a model: its variables, and its kernels in the target language."""

from __future__ import annotations

import dataclasses
import inspect
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.errors import ParameterError, require_positive
from stiction.export.relations import relations
from stiction.export.syntax import Syntax
from stiction.export.translate import Translator
from stiction.export.twin_remarks import twin_remarks
from stiction.export.values import Array, Settings, Struct, TranslationError, Value
from stiction.export.variables import Variable, settings_of
from stiction.models import Compensator, Loop, Valve, dispatch
from stiction.models.compensators.component import CompensatorState, compensator_at_rest
from stiction.models.component import ValveState
from stiction.simulation.loop_step import LoopState, loop_start, loop_step

if TYPE_CHECKING:
    from stiction.compensation.twin import Twin
    from stiction.diagnosis import Diagnosis

__all__ = ["Block", "Packed", "block_of"]

OP = Variable("op", 0.0, "% of span", "Controller output.")
SP = Variable("sp", 0.0, "PV units", "Set point.")
PV = Variable("pv", 0.0, "PV units", "Process variable.")
POSITION = Variable("position", 0.0, "% of span", "Stem position.")
OFFSET = Variable("position_offset", 0.0, "% of span", "Stem position less OP before the first sample.")
LOAD = Variable("load", 0.0, "% of span", "Load, added to the stem position at the inlet of the process.")
PV_LOAD = Variable("pv_disturbance", 0.0, "PV units", "Disturbance and noise, added to the output of the process.")
PV_START = Variable("pv_start", 0.0, "PV units", "Process variable at rest before the first sample.")
OP_START = Variable("op_start", 0.0, "% of span", "Controller output at rest before the first sample.")
COMPENSATED = (
    Variable("valve_signal", 0.0, "% of span", "Signal to the valve, before the output limits of the controller."),
    Variable("hold", 0.0, "-", "1 while the controller must hold its integral."),
    Variable("track", 0.0, "-", "1 while the controller must track the valve signal: the loop is open."),
)


class Packed(NamedTuple):
    """An array of numbers that a step takes: computed from the settings, or constant."""

    name: str
    """Its name in the exported record."""
    length: int
    """Numbers in it [-]."""
    function: str = ""
    """Function that computes a record of these numbers; empty where they are constant."""
    record: Struct | None = None
    """That record."""
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
    syntax: Syntax
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
    state: Struct = field(init=False)
    """The record that a step takes and gives."""
    arrays: tuple[tuple[str, int], ...] = ()
    """Arrays that a step changes, and their lengths."""
    at_rest: Value = field(init=False)
    """The state before the first sample, in terms of the arguments of the start."""
    stepped: Value = field(init=False)
    """The state after a sample, in terms of the inputs and of the state ``s``."""
    results: tuple[str, ...] = ()
    """The outputs, in terms of the state ``s``."""
    duration: float | None = None
    """Length of the record of an identified loop [s]."""
    remarks: tuple[str, ...] = ()
    """What a user must know of an identified loop, one sentence each; part of the title."""
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
            settings = Settings(model, frozenset(adjustable), "self", prefix)
            try:
                found = self.translator.call(type(model).pack, [settings, Value("double", "dt")])
            except TranslationError:
                continue
            if isinstance(found, Value) and isinstance(found.type, Struct):
                self.packed.append(Packed(name, len(numbers), found.text.partition("(")[0], found.type))
                self.settings += settings_of(model, settings.adjustable, prefix)
                self.refusals += relations(self.translator, settings)
                break
        else:
            self.packed.append(Packed(name, len(numbers), constants=numbers))
        return Value(Array(len(numbers)), self.member(name))

    def member(self, name: str) -> str:
        """A field of the exported model."""
        return self.syntax.write("member", name)

    def use_state(self, kind: Any) -> Value:
        """Make a named tuple the state of the block."""
        self.state = self.translator.named_tuple(kind)
        return Value(self.state, self.member("state"))

    def numbers(self, *names: str) -> list[Value]:
        """Variables as arguments of a kernel."""
        return [Value("double", name) for name in names]


def block_of(model: object, name: str | None, dt: float | None, language: str = "C") -> Block:
    """Make the block of a valve, a compensator or a loop.

    Parameters
    ----------
    model : Valve, Compensator, Loop, Twin or Diagnosis
        The model.
    name : str, optional
        Name of the exported model; by default the name of its class in lower case.
    dt : float, optional
        Sampling period [s]; a loop has its own.
    language : str
        "C" or "MATLAB".

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
    make = next((make for kind, make in MAKERS.items() if isinstance(model, kind)), None)
    if make is None:
        from stiction.compensation.twin import Twin
        from stiction.diagnosis import Diagnosis

        if isinstance(model, (Twin, Diagnosis)):
            return _block_of_twin(model, name, dt, language)
        raise ParameterError(
            f"model is of type {type(model).__name__}",
            remedy="give a valve such as Kano(5.0, 2.0), a compensator, a Loop, or a Diagnosis with an identified loop",
        )
    own = model.dt if isinstance(model, Loop) else dt
    if own is None:
        raise ParameterError("dt is missing", remedy="give the sampling period of the exported model in seconds")
    if dt not in (None, own):
        raise ParameterError(
            f"dt = {dt:g} s differs from the sampling period of the loop, {own:g} s",
            remedy="leave dt out, or make the loop with this dt", quantity="dt", value=dt, limit=own,
        )  # fmt: skip
    title = (inspect.getdoc(type(model)) or "").split("\n\n")[0].replace("\n", " ")
    source = " ".join(repr(model).split())
    block = Block(name, title, source, require_positive("dt", own, "s"), Syntax(language, name))
    make(block, model)
    return block


def _block_of_twin(model: Twin | Diagnosis, name: str, dt: float | None, language: str) -> Block:
    """The loop of a twin at its operating point; of a diagnosis with the intervals of S and J as ranges."""
    from stiction.compensation.twin import Twin, build_twin
    from stiction.diagnosis import Diagnosis

    twin = model if isinstance(model, Twin) else build_twin(model)
    block = block_of(twin.loop, name, dt, language)
    at = {"pv_start": twin.sp, "op_start": twin.op, "sp": twin.sp}
    if twin.start is not None:
        start = twin.start
        at |= {"pv_start": start.pv, "op_start": start.op, "position_offset": start.position - start.op}
        block.duration = start.duration
    block.starts = tuple(replace(one, value=at.get(one.name, one.value)) for one in block.starts)
    block.inputs = tuple(replace(one, value=at.get(one.name, one.value)) for one in block.inputs)
    block.remarks = twin_remarks(twin, model if isinstance(model, Diagnosis) else None)
    block.title = " ".join((f"Identified loop: {twin.reason}", *block.remarks))
    if not twin.fits:
        block.remarks = (twin.reason, *block.remarks)
    found = getattr(model, "identification", None)
    for name in ("S", "J"):
        low, high = (getattr(found, f"{name}_{end}", None) for end in ("low", "high"))
        if low is not None and high is not None and math.isfinite(low) and math.isfinite(high):
            block.settings = [
                replace(one, low=min(low, one.value), high=max(high, one.value)) if one.name == f"valve_{name}" else one
                for one in block.settings
            ]
    return block


def _make_loop(block: Block, loop: Any) -> None:
    if not block.syntax.is_c:
        raise ParameterError(
            "a loop cannot be written as a MATLAB function", remedy="write an FMU, which Simulink imports"
        )
    compensator, process = loop.compensator, loop.discrete
    block.inputs, block.outputs = (SP, LOAD, PV_LOAD), (PV, OP, POSITION)
    block.starts = (PV_START, OP_START, OFFSET)
    starts = {"sp": "sp", "pv": "pv_start", "op": "op_start", "position": "op_start + position_offset"}
    block.start_arguments = tuple(starts.items())
    call, kind = block.translator.call, dispatch.NO_COMPENSATOR if compensator is None else compensator.code
    pid = block.pack("pid", loop.controller, "controller_")
    p = block.pack("p", loop.valve, "valve_")
    h = pid if compensator is None else block.pack("h", compensator, "compensator_")
    order, length = max(process.c.size, 1), max(process.delay, process.direct_delay) + 1
    matrices = []
    for name in ("A", "b_new", "b_old", "c"):
        numbers = tuple(np.ravel(getattr(process, name)).tolist()) or (0.0,)  # pure dead time: a zero state
        block.packed.append(Packed(name, len(numbers), constants=numbers))
        matrices.append(Value(Array(len(numbers), columns=order if name == "A" else 0), block.member(name)))
    block.arrays = (("x", order), ("work", order), ("line", length))
    arrays = [Value(Array(size, writable=True), block.member(name)) for name, size in block.arrays]
    s = block.use_state(LoopState)
    block.at_rest = call(loop_start, [loop.valve.code, *block.numbers(*starts), pid, p])
    inputs = block.numbers(*(one.name for one in block.inputs))
    codes = (kind, loop.valve.code, process.delay, process.direct_delay)
    block.stepped = call(loop_step, [*codes, *inputs, s, pid, h, p, *matrices, process.d, *arrays])
    block.results = tuple(f"{s.text}.{one}" for one in ("pv", "controller.op", "position"))


def _make_valve(block: Block, valve: Any) -> None:
    block.inputs, block.outputs, block.starts = (OP,), (POSITION,), (OFFSET,)
    block.start_arguments = (("op", "op"), ("position", "op + position_offset"))
    call, p = block.translator.call, block.pack("p", valve)
    s = block.use_state(ValveState)
    block.at_rest = call(dispatch.valve_at_rest, [valve.code, *block.numbers("op", "position"), p])
    block.stepped = call(dispatch.valve_step, [valve.code, *block.numbers("op"), s, p])
    block.results = (call(dispatch.stem_position, [s, p]).text,)


def _make_compensator(block: Block, compensator: Any) -> None:
    block.inputs, block.outputs = (OP, SP, PV), COMPENSATED
    block.start_arguments = (("op", "op"), ("sp", "sp"))
    call, p = block.translator.call, block.pack("p", compensator)
    s = block.use_state(CompensatorState)
    block.at_rest = call(compensator_at_rest, block.numbers("op", "sp"))
    block.stepped = call(dispatch.compensator_step, [compensator.code, *block.numbers("op", "sp", "pv"), s, p])
    block.results = tuple(block.syntax.field(s.text, one.name) for one in block.outputs)


MAKERS = {Valve: _make_valve, Compensator: _make_compensator, Loop: _make_loop}
"""Kind of model -> how its block is filled."""

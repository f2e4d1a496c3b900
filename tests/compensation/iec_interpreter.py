"""Structured text of IEC 61131-3, third edition: one function block read from its text and run.

Written from the grammar of the standard, and knowing nothing of what writes the text. Text is read in one pass by
recursive descent, and each phrase becomes a function of the list of variables.
"""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass, field

from tests.compensation.iec_expressions import RANGE, RESERVED, TYPES, Expressions, RunError

START = {"BOOL": False, "LREAL": 0.0, **dict.fromkeys(RANGE, 0)}
ROUNDS = 100_000
"""Rounds after which a loop counts as endless."""


class Exit(Exception):
    """EXIT, on its way to the innermost loop."""


class Return(Exception):
    """RETURN, on its way to the end of the block."""


@dataclass
class Variable:
    """One declared variable."""

    place: int
    kind: str
    section: str
    constant: bool


@dataclass
class FunctionBlock:
    """A function block read from its text; `instance()` gives one that remembers."""

    text: str
    name: str = ""
    variables: dict[str, Variable] = field(default_factory=dict)
    start: list = field(default_factory=list)

    def __post_init__(self):
        Reader(self).function_block()

    def names(self, section):
        return tuple(name for name, v in self.variables.items() if v.section == section)

    def instance(self):
        """A function of the inputs in their order; gives the outputs in theirs. All variables keep their values."""
        values, body = list(self.start), self.body
        inputs = [(v.place, v.kind) for v in self.variables.values() if v.section == "VAR_INPUT"]
        outputs = [v.place for v in self.variables.values() if v.section == "VAR_OUTPUT"]
        scratch = [v.place for v in self.variables.values() if v.section == "VAR_TEMP"]

        def run(*given):
            for (place, kind), value in zip(inputs, given, strict=True):
                if isinstance(value, bool) is not (kind == "BOOL"):
                    raise RunError(f"{value!r} given for an input of type {kind}")
                values[place] = value
            for place in scratch:
                values[place] = self.start[place]
            with contextlib.suppress(Return):
                body(values)
            return [values[place] for place in outputs]

        return run


class Reader(Expressions):
    """Recursive descent over declarations and statements."""

    def __init__(self, block):
        super().__init__(block.text, block.variables)
        self.block, self.loops = block, 0

    def function_block(self):
        self.need("FUNCTION_BLOCK")
        self.block.name = self.new_name()
        while section := self.take("VAR_INPUT", "VAR_OUTPUT", "VAR_TEMP", "VAR"):
            constant = self.take("CONSTANT") is not None
            self.take("RETAIN", "NON_RETAIN")
            while not self.take("END_VAR"):
                self.declaration(section, constant)
        self.block.body = self.statements("END_FUNCTION_BLOCK")
        self.need("END_FUNCTION_BLOCK")
        if self.sort != "end":
            raise self.wrong("nothing expected after the block")

    def new_name(self):
        name = self.word
        if self.sort != "name" or name in RESERVED or re.search(r"_$|__|^_|^(END|VAR)_", name):
            raise self.wrong("a name expected that is neither reserved nor malformed")
        self.at += 1
        return name

    def declaration(self, section, constant):
        names = [self.new_name()]
        while self.take(","):
            names.append(self.new_name())
        self.need(":")
        kind = self.word
        if kind not in TYPES:
            raise self.wrong("a type expected")
        self.at += 1
        value = START[kind]
        if self.take(":="):
            given, initial = self.expression()
            self.fits(given, kind)
            value = initial(self.block.start)
            self.in_range(value, kind)
        self.need(";")
        for name in names:
            if name in self.block.variables or name == self.block.name:
                raise self.wrong(f"{name} is declared twice")
            self.block.variables[name] = Variable(len(self.block.start), kind, section, constant)
            self.block.start.append(value)

    def statements(self, *ends):
        body = []
        while not (self.sort == "name" and self.word in ends):
            if not self.take(";"):
                body.append(self.statement())
                self.need(";")

        def run(v):
            for step in body:
                step(v)

        return run

    def statement(self):
        if word := self.take("IF", "CASE", "FOR", "WHILE", "REPEAT", "EXIT", "RETURN"):
            return getattr(self, f"{word.lower()}_statement")()
        variable = self.written()
        self.need(":=")
        kind, value = self.expression()
        self.fits(kind, variable.kind)
        place, limits = variable.place, RANGE.get(variable.kind)

        def assign(v):
            v[place] = value(v)

        def assign_within(v):
            v[place] = result = value(v)
            if not limits[0] <= result <= limits[1]:
                raise RunError(f"{result} leaves {variable.kind}")

        return assign_within if limits else assign

    def written(self):
        """The variable on the left of an assignment."""
        variable = self.variables.get(self.word)
        if variable is None:
            raise self.wrong("a declared variable expected")
        if variable.section == "VAR_INPUT" or variable.constant:
            raise self.wrong("inputs and constants cannot be written")
        self.at += 1
        return variable

    def if_statement(self):
        arms = []
        while True:
            condition = self.boolean()
            self.need("THEN")
            arms.append((condition, self.statements("ELSIF", "ELSE", "END_IF")))
            if not self.take("ELSIF"):
                break
        otherwise = self.statements("END_IF") if self.take("ELSE") else None
        self.need("END_IF")

        def run(v):
            for condition, body in arms:
                if condition(v):
                    return body(v)
            return otherwise(v) if otherwise else None

        return run

    def case_statement(self):
        kind, selector = self.expression()
        if kind not in RANGE:
            raise self.wrong("CASE needs an integer")
        self.need("OF")
        arms = []
        while self.word not in ("ELSE", "END_CASE"):
            labels = [self.label(kind)]
            while self.take(","):
                labels.append(self.label(kind))
            self.need(":")
            body = []
            while not (self.word in ("ELSE", "END_CASE") or self.sort == "int" or self.word == "-"):
                body.append(self.statement())
                self.need(";")
            arms.append((labels, body))
        otherwise = self.statements("END_CASE") if self.take("ELSE") else None
        self.need("END_CASE")

        def run(v):
            value = selector(v)
            for labels, body in arms:
                if any(low <= value <= high for low, high in labels):
                    for step in body:
                        step(v)
                    return
            if otherwise:
                otherwise(v)

        return run

    def label(self, kind):
        low = high = self.signed(kind)
        if self.take(".."):
            high = self.signed(kind)
        return low, high

    def for_statement(self):
        control = self.written()
        if control.kind not in RANGE:
            raise self.wrong("FOR needs an integer variable")
        self.need(":=")
        first = self.integer(control.kind)
        self.need("TO")
        last = self.integer(control.kind)
        by = self.integer(control.kind) if self.take("BY") else lambda _: 1
        self.need("DO")
        body, place = self.loop_body("END_FOR"), control.place

        def run(v):
            step, end = by(v), last(v)
            v[place] = first(v)
            while v[place] <= end if step > 0 else v[place] >= end:
                yield body
                v[place] += step

        return looped(run)

    def while_statement(self):
        condition = self.boolean()
        self.need("DO")
        body = self.loop_body("END_WHILE")

        def run(v):
            while condition(v):
                yield body

        return looped(run)

    def repeat_statement(self):
        body = self.loop_body("UNTIL")
        condition = self.boolean()
        self.need("END_REPEAT")

        def run(v):
            yield body
            while not condition(v):
                yield body

        return looped(run)

    def loop_body(self, end):
        self.loops += 1
        body = self.statements(end)
        self.need(end)
        self.loops -= 1
        return body

    def exit_statement(self):
        if not self.loops:
            raise self.wrong("EXIT outside a loop")
        return jump(Exit)

    def return_statement(self):
        return jump(Return)


def looped(rounds):
    def run(v):
        with contextlib.suppress(Exit):
            for count, body in enumerate(rounds(v)):
                if count >= ROUNDS:
                    raise RunError("a loop without an end")
                body(v)

    return run


def jump(to):
    def run(v):
        raise to

    return run

"""The exported model as C99: one header, one source; no allocation, no global variables, only ``math.h``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.export.syntax import Struct

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stiction.export.block import Block
    from stiction.export.variables import Variable

__all__ = ["c_header", "c_source", "memory_length", "refusals", "written_by"]


def written_by(block: Block) -> list[str]:
    """Lines that say what a file holds and where it comes from."""
    from stiction import __version__

    return [
        block.title,
        f"Model: {block.source}",
        f"Sampling period: {block.dt:g} s. Written by stiction {__version__}.",
    ]


def memory_length(block: Block) -> int:
    """Numbers in the record of the exported model [-]."""
    return (
        1
        + max(len(block.settings), 1)
        + sum(one.length for one in block.packed)
        + sum(length for _, length in block.arrays)
        + len(block.outputs)
        + _numbers_in(block.state)
    )


def _numbers_in(struct: Struct | None) -> int:
    fields = struct.fields if struct else ()
    return sum(_numbers_in(kind) if isinstance(kind, Struct) else 1 for _, kind in fields)


def refusals(block: Block) -> list[tuple[str, str]]:
    """Conditions under which the model does not start, in its language, and what to say about each."""
    found = []
    unequal, either = block.syntax.operators["!="], block.syntax.operators["or"]
    for one in block.settings:
        name = block.syntax.member(f"parameters.{block.syntax.name(one.name)}")
        tests = [f"{name} {unequal} {name}"]
        if math.isfinite(one.low):
            tests.append(f"{name} {'<=' if one.above else '<'} {block.syntax.number(one.low)}")
        if math.isfinite(one.high):
            tests.append(f"{name} > {block.syntax.number(one.high)}")
        found.append((f" {either} ".join(tests), f"{one.name} is out of its range: {_range_text(one)}."))
    found += [
        (
            test.replace(block.syntax.parameter("self", ""), block.syntax.member("parameters.")),
            f"the parameters do not fit together: {text} is not allowed.",
        )
        for test, text in block.refusals
    ]
    return found


def c_header(block: Block) -> str:
    """The header: parameters, model and functions."""
    name, syntax = block.name, block.syntax
    lines = [_comment(written_by(block)), f"#ifndef {name.upper()}_H", f"#define {name.upper()}_H", ""]
    lines += ["#ifdef __cplusplus", 'extern "C" {', "#endif", ""]
    lines += [f"/* Parameters of {name}. */", "typedef struct {"]
    lines += [f"    double {syntax.name(one.name)}; /* {_meaning(one)} */" for one in block.settings]
    lines += [] if block.settings else ["    double unused;"]
    lines += [f"}} {name}_parameters;", ""]
    for struct in _inner_first(block.state):
        lines += [_typedef(block, struct), ""]
    lines += [f"/* One {name}: its parameters, its state and its outputs. */", "typedef struct {"]
    lines += ["    double dt; /* Sampling period [s] */", f"    {name}_parameters parameters;"]
    lines += [f"    double {one.name}[{one.length}];" for one in block.packed]
    lines += [f"    {syntax.type_name(block.state)} state;"] if block.state else []
    lines += [f"    double {array}[{length}];" for array, length in block.arrays]
    lines += [f"    double {one.name}; /* {_meaning(one)} */" for one in block.outputs]
    lines += [f"}} {name}_model;", ""]
    lines += [
        "/* Set the parameters and the sampling period of the export. */",
        f"void {name}_defaults({name}_model *m);",
        "",
        "/* Compute what depends on the parameters and come to rest. Returns 0, or the number of what is wrong. */",
        f"int {name}_start({name}_model *m, {_arguments(name for name, _ in block.start_arguments)});",
        "",
        "/* What is wrong, in words. */",
        f"const char *{name}_refusal(int number);",
        "",
        "/* One sample: read the inputs, set the outputs. */",
        f"void {name}_step({name}_model *m, {_arguments(one.name for one in block.inputs)});",
        "",
        f"#define {name.upper()}_MEMORY (sizeof({name}_model) / sizeof(double))",
        "",
        "/* The same without a record of its own: `memory` holds the model between two calls, `first` is 1 at the",
        "   start, `parameters` and `inputs` are in the order of the header; after the parameters of the model come",
        f"   {len(block.starts)} for the start only. Returns 0, or the number of what is wrong. */",
        f"int {name}_sample(int first, double dt, const double *parameters, const double *inputs,",
        "    const double *before,",
        "    double *memory, double *outputs);",
        "",
        *("#ifdef __cplusplus", "}", "#endif"),
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def c_source(block: Block) -> str:
    """The source: the kernels as C, and the functions of the header."""
    name, syntax, tr = block.name, block.syntax, block.translator
    in_header = {struct.name for struct in _inner_first(block.state)}
    lines = [_comment(written_by(block)), f'#include "{name}.h"', "#include <math.h>", ""]
    for helper in tr.helpers.values():
        lines += [helper, ""]
    for struct in tr.structs.values():
        if struct.name not in in_header:
            lines += [_typedef(block, struct), ""]
    for function in tr.functions.values():
        lines += [function, ""]
    lines += [f"void {name}_defaults({name}_model *m) {{", f"    m->dt = {syntax.number(block.dt)};"]
    values = [(syntax.name(one.name), syntax.number(one.value)) for one in block.settings] or [("unused", "0.0")]
    lines += [f"    m->parameters.{field} = {value};" for field, value in values]
    tests = refusals(block)
    lines += ["}", "", f"const char *{name}_refusal(int number) {{", "    switch (number) {"]
    lines += [f'    case {k}: return "{text}";' for k, (_, text) in enumerate(tests, 1)]
    lines += [
        f'    case {len(tests) + 1}: return "the parameters and the sampling period do not fit together.";',
        '    default: return "";', "    }", "}", "",
        f"int {name}_start({name}_model *m, {_arguments(argument for argument, _ in block.start_arguments)}) {{",
    ]  # fmt: skip
    lines += [f"    if ({test}) return {k};" for k, (test, _) in enumerate(tests, 1)]
    lines += [f"    if (!(m->dt > 0.0)) return {len(tests) + 1};"]
    for one in block.packed:
        if one.function:
            lines.append(f"    {one.function}(&m->parameters, m->dt, m->{one.name});")
        lines += [f"    m->{one.name}[{k}] = {syntax.number(c)};" for k, c in enumerate(one.constants)]
        nan = f"m->{one.name}[k] != m->{one.name}[k]"
        lines.append(f"    for (int k = 0; k < {one.length}; k++) if ({nan}) return {len(tests) + 1};")
    lines += [f"    for (int k = 0; k < {length}; k++) m->{array}[k] = 0.0;" for array, length in block.arrays]
    lines += [f"    m->state = {block.at_rest.text};"] if block.at_rest else []
    lines += _uses(block.at_rest, [argument for argument, _ in block.start_arguments], block.results)
    lines += [f"    m->{one.name} = {text};" for one, text in zip(block.outputs, block.results, strict=True)]
    lines += ["    return 0;", "}", ""]
    lines += [f"void {name}_step({name}_model *m, {_arguments(one.name for one in block.inputs)}) {{"]
    lines += _uses(block.stepped, [one.name for one in block.inputs], ())
    lines += [f"    m->state = {block.stepped.text};"] if block.stepped else []
    lines += [f"    m->{one.name} = {text};" for one, text in zip(block.outputs, block.results, strict=True)]
    return "\n".join([*lines, "}", "", *_sample(block)]) + "\n"


def _sample(block: Block) -> list[str]:
    """The function that keeps the model in an array of its caller."""
    name, n = block.name, len(block.settings)
    given = {one.name: f"inputs[{k}]" for k, one in enumerate(block.inputs)}
    given |= {one.name: f"parameters[{n + k}]" for k, one in enumerate(block.starts)}
    start = ", ".join(_substituted(text, given) for _, text in block.start_arguments)
    lines = [
        f"int {name}_sample(int first, double dt, const double *parameters, const double *inputs,",
        "    const double *before,",
        "    double *memory, double *outputs) {",
        f"    union {{ {name}_model model; double numbers[{name.upper()}_MEMORY]; }} u;",
        "    int wrong = 0;",
        "    if (first) {",
        "        u.model.dt = dt;",
    ]
    lines += [
        f"        u.model.parameters.{block.syntax.name(one.name)} = parameters[{k}];"
        for k, one in enumerate(block.settings)
    ]
    lines += [
        *([] if block.settings or block.starts else ["        (void)parameters;"]),
        f"        wrong = {name}_start(&u.model, {start});",
        "    } else {",
        f"        for (unsigned k = 0; k < {name.upper()}_MEMORY; k++) u.numbers[k] = before[k];",
        "    }",
        f"    if (wrong == 0) {name}_step(&u.model, {', '.join(given[one.name] for one in block.inputs)});",
        f"    for (unsigned k = 0; k < {name.upper()}_MEMORY; k++) memory[k] = wrong ? 0.0 : u.numbers[k];",
    ]
    lines += [f"    outputs[{k}] = wrong ? NAN : u.model.{one.name};" for k, one in enumerate(block.outputs)]
    return [*lines, "    return wrong;", "}"]


def _substituted(expression: str, given: dict[str, str]) -> str:
    return " ".join(given.get(word, word) for word in expression.split())


def _uses(value: object, names: list[str], results: tuple[str, ...]) -> list[str]:
    """Statements for arguments that the state does not depend on."""
    text = getattr(value, "text", "").replace("(", " ").replace(")", " ").replace(",", " ").split()
    return [f"    (void){name};" for name in names if name not in text and name not in " ".join(results).split()]


def _inner_first(struct: Struct | None) -> list[Struct]:
    """A record and the records in it, those first."""
    if struct is None:
        return []
    inner = [one for _, kind in struct.fields if isinstance(kind, Struct) for one in _inner_first(kind)]
    return [*dict.fromkeys(inner), struct]


def _typedef(block: Block, struct: Struct) -> str:
    fields = [f"    {block.syntax.type_name(kind)} {block.syntax.name(field)};" for field, kind in struct.fields]
    return "\n".join(["typedef struct {", *fields, f"}} {block.syntax.type_name(struct)};"])


def _arguments(names: Iterable[str]) -> str:
    return ", ".join(f"double {name}" for name in names)


def _meaning(one: Variable) -> str:
    return f"{one.description.replace('*/', '* /')} [{one.unit}]"


def _range_text(one: Variable) -> str:
    low = f"{'above' if one.above else 'at least'} {one.low:g}" if math.isfinite(one.low) else ""
    high = f"at most {one.high:g}" if math.isfinite(one.high) else ""
    return " and ".join(filter(None, (low, high))) or "a number"


def _comment(lines: list[str]) -> str:
    return "/* " + "\n   ".join(line.replace("*/", "* /") for line in lines) + " */"

"""The exported model as a MATLAB function with the same kernels and the same comments as the C source."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.export.c_source import refusals, written_by

if TYPE_CHECKING:
    from stiction.export.block import Block

__all__ = ["matlab_text"]


def matlab_text(block: Block) -> str:
    """Return the function file; `block` is translated to MATLAB."""
    name, syntax = block.name, block.syntax
    inputs, outputs = ([one.name for one in row] for row in (block.inputs, block.outputs))
    given = {one.name: f"parameters.{one.name}" for one in block.starts}
    values = ", ".join(f"'{syntax.name(one.name)}', {syntax.number(one.value)}" for one in block.parameters)
    lines = [
        f"function [{', '.join([*outputs, 'm'])}] = {name}({', '.join([*inputs, 'm', 'parameters'])})",
        *(f"% {line}" for line in written_by(block)),
        "%",
        f"% Call it once each sampling period: [{', '.join([*outputs, 'm'])}] = {name}({', '.join([*inputs, 'm'])});",
        "% begin with m = [], and hand m over from call to call.",
        "%",
        *(f"% {role} {one.name}: {one.description} [{one.unit}]" for role, row in
          (("Input", block.inputs), ("Output", block.outputs), ("Parameter", block.parameters)) for one in row),
        f"if nargin < {len(inputs) + 2}",
        f"    parameters = struct({values});",
        "end",
        f"if nargin < {len(inputs) + 1} || isempty(m)",
        f"    dt = {syntax.number(block.dt)};",
        "    m = struct('parameters', parameters);",
    ]  # fmt: skip
    for test, text in refusals(block):
        lines += [
            f"    if {test}",
            f"        error('{name}:parameters', '%s', '{text.replace(chr(39), '')}');",
            "    end",
        ]
    for one in block.packed:
        numbers = f"[{', '.join(syntax.number(c) for c in one.constants)}]"
        lines.append(f"    m.{one.name} = {f'{one.function}(parameters, dt)' if one.function else numbers};")
        lines += [f"    if any(isnan(m.{one.name}))", f"        error('{name}:parameters', '%s', "
                  "'the parameters and the sampling period do not fit together.');", "    end"]  # fmt: skip
    for argument, text in block.start_arguments:
        words = " ".join(given.get(word, word) for word in text.split())
        lines += [] if words == argument else [f"    {argument} = {words};"]
    lines += [f"    m.state = {block.at_rest.text};"] if block.at_rest else []
    lines += ["end", *([f"m.state = {block.stepped.text};"] if block.stepped else [])]
    lines += [f"{one.name} = {text};" for one, text in zip(block.outputs, block.results, strict=True)]
    lines += ["end", ""]
    for function in (*block.translator.functions.values(), *block.translator.helpers.values()):
        lines += [function, ""]
    return "\n".join(lines)

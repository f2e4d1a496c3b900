"""The exported model as a Modelica block that calls the C function, in one file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.export.c_source import c_header, c_source, memory_length, written_by

if TYPE_CHECKING:
    from stiction.export.block import Block
    from stiction.export.variables import Variable

__all__ = ["modelica_text"]


def modelica_text(block: Block) -> str:
    """Return the block, with its C source in the annotation of its function."""
    name, n = block.name, memory_length(block)
    source = c_source(block).replace(f'#include "{name}.h"\n', c_header(block))
    include = f"#ifndef {name.upper()}_C\n#define {name.upper()}_C\n{source}#endif\n"
    include = include.replace("\\", "\\\\").replace('"', '\\"')
    sizes = {"parameters": len(block.parameters), "inputs": len(block.inputs), "outputs": len(block.outputs)}
    title, model, written = (line.replace('"', "'") for line in written_by(block))
    lines = [
        f"// {model}", f"// {written}",
        f'block {name} "{title}"',
        *(f"  parameter Real {one.name}{_range(one)} = {_number(one.value)} {_text(one)};" for one in block.parameters),
        f'  constant Real dt(unit="s") = {_number(block.dt)} "Sampling period [s]";',
        *(f"  Modelica.Blocks.Interfaces.RealInput {one.name} {_text(one)};" for one in block.inputs),
        *(f"  Modelica.Blocks.Interfaces.RealOutput {one.name} {_text(one)};" for one in block.outputs),
        "protected",
        f'  discrete Real memory[{n}](each start = 0.0, each fixed = true) "State of the model";',
        f'  discrete Real y[{sizes["outputs"]}] "Outputs";',
        '  discrete Integer samples(start = 0, fixed = true) "Samples until now";',
        '  discrete Integer wrong(start = 0, fixed = true) "Number of what is wrong with the parameters";',
        "",
        '  function sample_model "One sample of the model"',
        '    input Integer first "1 at the start";',
        '    input Real dt "Sampling period [s]";',
        f"    input Real parameters[{max(sizes['parameters'], 1)}];",
        f"    input Real inputs[{sizes['inputs']}];",
        f"    input Real before[{n}];",
        "    output Integer wrong;",
        f"    output Real memory[{n}];",
        f"    output Real outputs[{sizes['outputs']}];",
        f'    external "C" wrong = {name}_sample(first, dt, parameters, inputs, before, memory, outputs)',
        f'      annotation(Include = "{include}");',
        "  end sample_model;",
        "",
        "equation",
        "  when sample(0, dt) then",
        "    samples = pre(samples) + 1;",
        "    (wrong, memory, y) = sample_model(if pre(samples) == 0 then 1 else 0, dt,",
        f"      {{{', '.join(one.name for one in block.parameters) or '0.0'}}},",
        f"      {{{', '.join(one.name for one in block.inputs)}}}, pre(memory));",
        "  end when;",
        f'  assert(wrong == 0, "{name}: a parameter is out of its range, or parameters do not fit together.");',
        *(f"  {one.name} = y[{k}];" for k, one in enumerate(block.outputs, 1)),
        f"end {name};",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _range(one: Variable) -> str:
    ends = [f"{word} = {_number(end)}" for word, end in (("min", one.low), ("max", one.high)) if math.isfinite(end)]
    return f"({', '.join(ends)})" if ends else ""


def _number(value: float) -> str:
    """A number as Modelica writes it: it has no infinity."""
    if math.isinf(value):
        return "1e300" if value > 0 else "-1e300"
    return repr(value)


def _text(one: Variable) -> str:
    return '"' + f"{one.description} [{one.unit}]".replace("\\", "\\\\").replace('"', "'") + '"'

"""The texts of an exported model, from the templates in ``templates/``."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from stiction.export.values import Struct

if TYPE_CHECKING:
    import jinja2

    from stiction.export.block import Block
    from stiction.export.variables import Variable

__all__ = ["render"]


@cache
def _templates() -> jinja2.Environment:
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.export"), autoescape=False, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    found.filters.update(meaning=_meaning, idle=_idle, finite=math.isfinite, quoted=quoteattr, zip=zip)
    found.filters.update(comment=lambda text: text.replace("*/", "* /"))
    found.filters.update(modelica=lambda text: text.replace("\\", "\\\\").replace('"', "'"))
    found.filters.update(real=lambda value: repr(math.copysign(min(abs(value), 1e300), value)))  # without infinity
    found.filters.update(xml=lambda value: repr(value).replace("inf", "INF").replace("nan", "NaN"))
    return found


def render(block: Block, template: str, **more: Any) -> str:
    """Return the text of a template for a block."""
    from stiction import __version__

    header = _inner_first(block.state)
    found = {
        **vars(block), **more, "version": __version__, "parameters": block.parameters, "in_header": header,
        "refusals": refusals(block), "misfit": len(refusals(block)) + 1, "memory_length": _memory_length(block),
        "named": [_named_in(text, block) for _, text in refusals(block)],
        "start_names": [name for name, _ in block.start_arguments],
        "written_by": [
            block.title, f"Model: {block.source}",
            f"Sampling period: {block.dt:g} s. Written by stiction {__version__}.",
        ],
    }  # fmt: skip

    def start_arguments(start: str, given: str, offset: int = 0) -> list[str]:
        """Arguments of the start, where `start` and `given` write a setting and an input by its place and name."""
        n = len(block.settings)
        texts = {one.name: start.format(n + k, one.name) for k, one in enumerate(block.starts)}
        texts |= {one.name: given.format(offset + k, one.name) for k, one in enumerate(block.inputs)}
        return [" ".join(texts.get(word, word) for word in text.split()) for _, text in block.start_arguments]

    return _templates().get_template(template).render(found, start_arguments=start_arguments)


def refusals(block: Block) -> list[tuple[str, str]]:
    """Conditions under which the model does not start, in its language, and what to say about each."""
    syntax, found = block.syntax, []
    for one in block.settings:
        name = syntax.write("member", f"parameters.{syntax.name(one.name)}")
        tests = [f"{name} {syntax.write('!=')} {name}"]
        limits = []
        if math.isfinite(one.low):
            tests.append(f"{name} {'<=' if one.above else '<'} {syntax.number(one.low)}")
            limits.append(f"{'above' if one.above else 'at least'} {one.low:g}")
        if math.isfinite(one.high):
            tests.append(f"{name} > {syntax.number(one.high)}")
            limits.append(f"at most {one.high:g}")
        text = f"{one.name} is out of its range: {' and '.join(limits) or 'a number'}."
        found.append((syntax.write("or").join(tests), text))
    own, given = syntax.write("parameter", "self", ""), syntax.write("member", "parameters.")
    return found + [
        (test.replace(own, given), f"the parameters do not fit together: {text}.") for test, text in block.refusals
    ]


def _named_in(text: str, block: Block) -> list[int]:
    """Places of the settings that a text names."""
    words = re.findall(r"\w+", text)
    return [k for k, one in enumerate(block.settings) if one.name in words]


def _memory_length(block: Block) -> int:
    """Numbers in the record of the exported model [-]."""
    arrays = sum(one.length for one in block.packed) + sum(length for _, length in block.arrays)
    return 1 + max(len(block.settings), 1) + arrays + len(block.outputs) + _numbers_in(block.state)


def _numbers_in(struct: Struct) -> int:
    return sum(_numbers_in(kind) if isinstance(kind, Struct) else 1 for _, kind in struct.fields)


def _inner_first(struct: Struct) -> list[Struct]:
    """A record and the records in it, those first."""
    inner = [one for _, kind in struct.fields if isinstance(kind, Struct) for one in _inner_first(kind)]
    return [*dict.fromkeys(inner), struct]


def _meaning(one: Variable) -> str:
    return f"{one.description} [{one.unit}]"


def _idle(names: list[str], *expressions: str) -> list[str]:
    """The names that none of the expressions contains."""
    words = re.findall(r"\w+", " ".join(expressions))
    return [name for name in names if name not in words]

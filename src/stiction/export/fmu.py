"""Write a functional mock-up unit: description, C source and, with a compiler, the binary for this platform."""

from __future__ import annotations

import io
import tempfile
import uuid
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.export.c_source import c_header, c_source
from stiction.export.compiler import BuildError, build_library, this_platform
from stiction.export.model_description import build_description, describe_model

if TYPE_CHECKING:
    from stiction.export.block import Block

__all__ = ["fmu_bytes"]


def fmu_bytes(block: Block, fmi: str) -> tuple[bytes, str]:
    """Return the content of an FMU, and what is said about its binary.

    Parameters
    ----------
    block : Block
        The model.
    fmi : str
        "2.0" or "3.0".
    """
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, f"{fmi} {c_source(block)}")) + "}"
    sources = {
        f"{block.name}.h": c_header(block),
        f"{block.name}.c": c_source(block),
        "fmu.c": _glue(block, fmi, token),
        "fmi_common.h": _template("fmi_common.h"),
        f"fmi{fmi[0]}.c": _template(f"fmi{fmi[0]}.c"),
    }
    content: dict[str, bytes] = {"modelDescription.xml": describe_model(block, fmi, token).encode()}
    content |= {f"sources/{name}": text.encode() for name, text in sources.items()}
    if fmi == "3.0":
        content["sources/buildDescription.xml"] = build_description(block).encode()
    found = this_platform()
    folder = found[int(fmi[0]) - 2] if found else ""
    if not found or not folder:
        note = f"FMI {fmi} has no name for this platform, so the FMU has its C source only."
    else:
        try:
            binary, compiler = _build(sources, found[2])
            content[f"binaries/{folder}/{block.name}{found[2]}"] = binary
            note = f"With a binary for {folder}, built by {compiler}, and its C source."
        except BuildError as error:
            note = f"With its C source only: {error}. Build it on the target, for example with `fmpy compile`."
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return packed.getvalue(), note


def _build(sources: dict[str, str], ending: str) -> tuple[bytes, str]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        compiler = build_library(folder / "fmu.c", folder / f"library{ending}")
        return (folder / f"library{ending}").read_bytes(), compiler


def _template(name: str) -> str:
    return (files("stiction.export") / "templates" / name).read_text(encoding="utf-8")


def _glue(block: Block, fmi: str, token: str) -> str:
    """The C that joins the model to the functions of FMI: its variables in one array."""
    name, n = block.name, len(block.settings)
    at = {one.name: f"v[{k}]" for k, one in enumerate([*block.parameters, *block.inputs])}
    start = ", ".join(" ".join(at.get(word, word) for word in text.split()) for _, text in block.start_arguments)
    fields = [block.syntax.name(one.name) for one in block.settings]
    first = [block.syntax.number(one.value) for one in (*block.starts, *block.inputs)]
    lines = [
        f'#include "{name}.c"', "",
        f"#define MODEL {name}_model",
        f'#define TOKEN "{token}"',
        f"enum {{ N_PARAMETERS = {len(block.parameters)}, N_INPUTS = {len(block.inputs)}, "
        f"N_OUTPUTS = {len(block.outputs)} }};", "",
        "static void glue_defaults(MODEL *m, double *v) {",
        f"    {name}_defaults(m);",
        *(f"    v[{k}] = m->parameters.{field};" for k, field in enumerate(fields)),
        *(f"    v[{n + k}] = {value};" for k, value in enumerate(first)),
        "}", "",
        "static int glue_start(MODEL *m, const double *v) {",
        *(f"    m->parameters.{field} = v[{k}];" for k, field in enumerate(fields)),
        f"    return {name}_start(m, {start});",
        "}", "",
        f"static const char *glue_refusal(int wrong) {{ return {name}_refusal(wrong); }}", "",
        "static void glue_step(MODEL *m, const double *u) { "
        f"{name}_step(m, {', '.join(f'u[{k}]' for k in range(len(block.inputs)))}); }}", "",
        "static void glue_outputs(const MODEL *m, double *y) {",
        *(f"    y[{k}] = m->{one.name};" for k, one in enumerate(block.outputs)),
        "}", "",
        f'#include "fmi{fmi[0]}.c"',
    ]  # fmt: skip
    return "\n".join(lines) + "\n"

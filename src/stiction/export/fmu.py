"""Write a functional mock-up unit: description, C source and, with a compiler, the binary for this platform."""

from __future__ import annotations

import io
import uuid
import zipfile
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from stiction.export.compiler import BuildError, build_library, this_platform
from stiction.export.render import render
from stiction.export.variables import Variable

if TYPE_CHECKING:
    from stiction.export.block import Block

__all__ = ["FMI_VERSIONS", "fmu_bytes"]

FMI_VERSIONS = ("2.0", "3.0")
BASE_UNITS = {
    "s": {"s": 1}, "kg": {"kg": 1}, "m": {"m": 1}, "m2": {"m": 2}, "m/s": {"m": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2}, "N/m": {"kg": 1, "s": -2}, "N s/m": {"kg": 1, "s": -1},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "% of span": {"factor": 0.01},
}  # fmt: skip
"""Unit -> exponents of the base units, and its factor; of others only the name is known."""


def fmu_bytes(block: Block, fmi: str) -> tuple[bytes, str]:
    """Return the content of an FMU, and what is said about its binary.

    Parameters
    ----------
    block : Block
        The model.
    fmi : str
        "2.0" or "3.0".
    """
    source = render(block, "model.c")
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, f"{fmi} {source}")) + "}"
    sources = {f"{block.name}.h": render(block, "model.h"), f"{block.name}.c": source}
    for name in ("fmu.c", "fmi_common.h", f"fmi{fmi[0]}.c"):
        sources[name] = render(block, name, fmi=fmi, token=token)
    texts = {"modelDescription.xml": _describe(block, fmi, token)}
    texts |= {f"sources/{name}": text for name, text in sources.items()}
    if fmi == "3.0":
        texts["sources/buildDescription.xml"] = render(block, "buildDescription.xml")
    content = {name: text.encode() for name, text in texts.items()}
    *folders, ending = this_platform()
    folder = folders[FMI_VERSIONS.index(fmi)]
    note = f"FMI {fmi} has no name for this platform, so the FMU has its C source only."
    if folder:
        try:
            content[f"binaries/{folder}/{block.name}{ending}"], compiler = build_library(sources, "fmu.c")
            note = f"With a binary for {folder}, built by {compiler}, and its C source."
        except BuildError as error:
            note = f"With its C source only: {error}. Build it on the target, for example with `fmpy compile`."
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return packed.getvalue(), note


def _describe(block: Block, fmi: str, token: str) -> str:
    """``modelDescription.xml``; the variables in the order of their value references."""
    known = [
        *((one, "parameter") for one in block.parameters),
        *((one, "input") for one in block.inputs),
        *((one, "output") for one in block.outputs),
        (Variable("dt", block.dt, "s", "Sampling period of the model."), "constant"),
        (Variable("time", 0.0, "s", "Time."), "independent"),
    ]
    units = [(unit, BASE_UNITS.get(unit)) for unit in sorted({one.unit for one, _ in known}) if unit != "-"]
    return render(
        block, "modelDescription.xml", fmi=fmi, token=token, variables=known, units=units,
        time=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        output_places=[k for k, (_, role) in enumerate(known) if role == "output"],
    )  # fmt: skip

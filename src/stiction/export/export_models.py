"""Write models for other simulators: C99, FMU, Modelica and MATLAB."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.atomic_write import output_path, require_new_file, write_files
from stiction.display.json_form import Result
from stiction.errors import ParameterError, RecordError
from stiction.export.block import block_of
from stiction.export.fmu import FMI_VERSIONS, fmu_bytes
from stiction.export.render import render
from stiction.export.syntax import RESERVED

if TYPE_CHECKING:
    import os

    from stiction.export.block import Block
    from stiction.export.variables import Variable

__all__ = ["ExportedModel", "export_c", "export_fmu", "export_matlab", "export_modelica"]

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,47}")
"""What C, Modelica, MATLAB and FMI take as the name of a model."""


@dataclass(frozen=True)
class ExportedModel(Result):
    """What an export has written.

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     st.export_c(st.Kano(5.0, 2.0), folder, dt=1.0).parameters
    ('S', 'J')
    """

    _json_keys = ("files", "name", "dt as dt_s", "parameters", "note")

    files: tuple[Path, ...]
    """Files written."""
    name: str
    """Name of the exported model."""
    dt: float
    """Its sampling period [s]."""
    parameters: tuple[str, ...]
    """Names of the parameters that can be changed after the export."""
    note: str = ""
    """What a user should know, such as the platform of a binary."""

    def summary(self) -> str:
        """Return what was written as text."""
        settings = f"Parameters: {', '.join(self.parameters)}." if self.parameters else "It has no parameters."
        files = ", ".join(str(file) for file in self.files)
        return " ".join(filter(None, (f"{files}: {self.name}, every {self.dt:g} s. {settings}", self.note)))


def export_fmu(
    model: Any, path: str | os.PathLike[str], *, dt: float | None = None, fmi: str = "2.0", name: str | None = None
) -> ExportedModel:
    """Write a valve, a compensator or a loop as a functional mock-up unit (FMU) for co-simulation.

    The FMU has a fixed step of its own, `dt`: it takes each sample once, at the start of the step of the importer in
    which it lies, with the inputs of that step. It supports reset, and saving and restoring its state.

    Parameters
    ----------
    model : Valve, Compensator, Loop, Twin or Diagnosis
        The model. Of a diagnosis its identified loop is written, of a twin its loop.
    path : path-like
        File to write; it must not exist.
    dt : float, optional
        Sampling period [s]; by default that of the loop.
    fmi : str
        Version of the standard, "2.0" or "3.0".
    name : str, optional
        Name of the model in the importer; by default the name of the file.

    Returns
    -------
    ExportedModel
        The file, and whether it has a binary for this platform: without a C compiler it has its C source only.

    Raises
    ------
    ParameterError
        When the model, `dt`, `fmi` or the name is not allowed.
    RecordError
        When the file exists, or cannot be written.

    Examples
    --------
    >>> import stiction as st
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     st.export_fmu(st.Kano(5.0, 2.0), f"{folder}/kano.fmu", dt=1.0).parameters
    ('S', 'J', 'position_offset')
    """
    if fmi not in FMI_VERSIONS:
        raise ParameterError(f"fmi = {fmi!r} is unknown", remedy=f"use {' or '.join(map(repr, FMI_VERSIONS))}")
    target = require_new_file(path)
    block = _named_block(model, name or target, dt)
    content, note = fmu_bytes(block, fmi)
    return _write(block, {target: content}, f"FMI {fmi}. {note}")


def export_c(
    model: Any, folder: str | os.PathLike[str], *, dt: float | None = None, name: str | None = None
) -> ExportedModel:
    """Write a valve, a compensator or a loop as C99: one header, one source.

    The source allocates nothing, has no global variables and needs only ``math.h``. Compile it without contraction of
    products and sums (``-ffp-contract=off``) to get the numbers of `stroke` bit for bit.

    Parameters
    ----------
    model : Valve, Compensator, Loop, Twin or Diagnosis
        The model.
    folder : path-like
        Folder for the two files; it is made if it does not exist.
    dt : float, optional
        Sampling period [s]; by default that of the loop.
    name : str, optional
        Name of the files, and of the functions and records in them; by default that of the model.

    Returns
    -------
    ExportedModel
        The files.

    Raises
    ------
    ParameterError
        When the model, `dt` or the name is not allowed.
    RecordError
        When a file exists, or cannot be written.

    Examples
    --------
    >>> import stiction as st
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in st.export_c(st.Stenman(2.0), folder, dt=1.0).files]
    ['stenman.h', 'stenman.c']
    """
    block = _named_block(model, name, dt)
    where = output_path(folder)
    if where.exists() and not where.is_dir():
        raise RecordError("is a file", remedy="give a folder for the header and the source", where=where)
    files = {ending: require_new_file(where / f"{block.name}{ending}", folder=False) for ending in (".h", ".c")}
    arguments = ", ".join(argument for argument, _ in block.start_arguments)
    contents = {file: render(block, f"model{ending}").encode() for ending, file in files.items()}
    return _write(block, contents, f"{block.name}_start takes {arguments}.", block.settings)


def export_modelica(
    model: Any, path: str | os.PathLike[str], *, dt: float | None = None, name: str | None = None
) -> ExportedModel:
    """Write a valve, a compensator or a loop as a Modelica block that calls its C source, which the file holds.

    Parameters
    ----------
    model : Valve, Compensator, Loop, Twin or Diagnosis
        The model.
    path : path-like
        File to write, named .mo; it must not exist.
    dt : float, optional
        Sampling period [s]; by default that of the loop.
    name : str, optional
        Name of the block; by default the name of the file.

    Returns
    -------
    ExportedModel
        The file.

    Raises
    ------
    ParameterError
        When the model, `dt` or the name is not allowed.
    RecordError
        When the file exists, or cannot be written.

    Examples
    --------
    >>> import stiction as st
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     st.export_modelica(st.He(2.0, 1.0), f"{folder}/Valve.mo", dt=1.0).name
    'Valve'
    """
    target = require_new_file(path)
    block = _named_block(model, name or target, dt)
    return _write(block, {target: render(block, "model.mo").encode()})


def export_matlab(
    model: Any, path: str | os.PathLike[str], *, dt: float | None = None, name: str | None = None
) -> ExportedModel:
    """Write a valve or a compensator as a MATLAB function.

    Parameters
    ----------
    model : Valve or Compensator
        The model.
    path : path-like
        File to write, named .m; it must not exist. MATLAB calls the function by the name of its file.
    dt : float, optional
        Sampling period [s].
    name : str, optional
        Name of the function; by default the name of the file.

    Returns
    -------
    ExportedModel
        The file.

    Raises
    ------
    ParameterError
        When the model, `dt` or the name is not allowed.
    RecordError
        When the file exists, or cannot be written.

    Examples
    --------
    >>> import stiction as st
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     st.export_matlab(st.Knocker(1.5, 2.0, 5.0), f"{folder}/knocker.m", dt=1.0).parameters
    ('amplitude', 'width', 'interval')
    """
    target = require_new_file(path)
    if not NAME.fullmatch(target.stem):
        fitting = re.sub(r"^(?=[^A-Za-z])", "valve_", re.sub(r"[^A-Za-z0-9_]", "_", target.stem))[:48]
        raise ParameterError(
            f"{target.name}: MATLAB calls a function by the name of its file, and {target.stem!r} is no name in MATLAB",
            remedy=f"name the file {fitting}.m",
        )
    block = _named_block(model, name or target, dt, "MATLAB")
    return _write(block, {target: render(block, "model.m").encode()})


def _named_block(model: Any, name: str | Path | None, dt: float | None, language: str = "C") -> Block:
    """The block of a model; a path gives it its name. Refuses a name that C, Modelica, MATLAB or FMI cannot use."""
    if isinstance(name, Path):
        name = re.sub(r"\W", "_", name.stem)
    if name is not None and not (isinstance(name, str) and NAME.fullmatch(name)):
        raise ParameterError(
            f"name = {name!r} is not a name for a model",
            remedy="give a letter and then letters, digits or _, 48 at most; a file's name must be one, or give `name`",
        )
    if name in frozenset().union(*RESERVED.values()) or (name or "").lower() in RESERVED["FMI"]:
        raise ParameterError(f"name = {name!r} is reserved in C, Modelica, MATLAB or FMI", remedy="give another name")
    return block_of(model, name, dt, language)


def _write(
    block: Block, contents: dict[Path, bytes], note: str = "", settings: list[Variable] | None = None
) -> ExportedModel:
    write_files(contents)
    settings = block.parameters if settings is None else settings
    note = " ".join(filter(None, (note, *block.remarks)))
    return ExportedModel(tuple(contents), block.name, block.dt, tuple(one.name for one in settings), note)

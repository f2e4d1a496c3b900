"""Write models for other simulators: C99, FMU, Modelica and MATLAB."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.display.json_form import Result
from stiction.errors import ParameterError, RecordError
from stiction.export.block import block_of
from stiction.export.c_source import c_header, c_source
from stiction.export.syntax import C_RESERVED, MATLAB_RESERVED, CSyntax, MatlabSyntax
from stiction.records.atomic_write import write_files

if TYPE_CHECKING:
    import os

    from stiction.export.block import Block

__all__ = ["ExportedModel", "check_new_file", "export_c", "export_fmu", "export_matlab", "export_modelica"]

FMI_VERSIONS = ("2.0", "3.0")
_MODELICA = (
    "algorithm and annotation assert block class connect connector constant constrainedby der discrete each elsewhen "
    "encapsulated end enumeration equation expandable extends external final flow function impure import in initial "
    "inner input loop model not operator or outer output package parameter partial protected public pure record "
    "redeclare replaceable stream then time type when within"
)
_OWN = "math stdio stdlib string stdint stdbool fmu fmi2 fmi3 fmi_common sample_model memory"
MODELICA_RESERVED, HEADERS = frozenset(_MODELICA.split()), frozenset(_OWN.split())
"""Words of Modelica; names of files and functions that an exported model uses itself."""


@dataclass(frozen=True)
class ExportedModel(Result):
    """What an export has written.

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     st.export_c(st.Kano(5.0, 2.0), folder, dt=1.0).parameters
    ('S', 'J', 'position_offset')
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
    from stiction.export.fmu import fmu_bytes

    if fmi not in FMI_VERSIONS:
        raise ParameterError(f"fmi = {fmi!r} is unknown", remedy=f"use {' or '.join(map(repr, FMI_VERSIONS))}")
    target = check_new_file(path)
    block = _block(model, name or _name_of(target), dt)
    content, note = fmu_bytes(block, fmi)
    write_files({target: content})
    return _exported(block, (target,), f"FMI {fmi}. {note}")


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
    block = _block(model, name, dt)
    where = Path(folder).expanduser()
    if where.exists() and not where.is_dir():
        raise RecordError("is a file", remedy="give a folder for the header and the source", where=where)
    files = [check_new_file(where / f"{block.name}{ending}", folder=False) for ending in (".h", ".c")]
    write_files(dict(zip(files, (c_header(block).encode(), c_source(block).encode()), strict=True)))
    return _exported(block, tuple(files))


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
    from stiction.export.modelica import modelica_text

    target = check_new_file(path)
    block = _block(model, name or _name_of(target), dt)
    write_files({target: modelica_text(block).encode()})
    return _exported(block, (target,))


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
    from stiction.export.matlab import matlab_text

    target = check_new_file(path)
    block = _block(model, name or _name_of(target), dt, MatlabSyntax)
    write_files({target: matlab_text(block).encode()})
    return _exported(block, (target,))


def _block(model: Any, name: str | None, dt: float | None, syntax: type[CSyntax] = CSyntax) -> Block:
    if name is not None:
        _require_name(name)
    return block_of(model, name, dt, syntax)


def _exported(block: Block, files: tuple[Path, ...], note: str = "") -> ExportedModel:
    return ExportedModel(files, block.name, block.dt, tuple(one.name for one in block.parameters), note)


def _name_of(target: Path) -> str:
    return re.sub(r"\W", "_", target.stem)


def _require_name(name: str) -> None:
    """Refuse a name that C, Modelica, MATLAB or FMI cannot use."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,47}", name):
        raise ParameterError(
            f"name = {name!r} is not a name for a model",
            remedy="give a letter and then letters, digits or _, 48 at most; a file's name must be one, or give `name`",
        )
    if name in C_RESERVED | MATLAB_RESERVED | MODELICA_RESERVED or name.lower() in HEADERS:
        raise ParameterError(f"name = {name!r} is reserved in C, Modelica, MATLAB or FMI", remedy="give another name")


def check_new_file(path: str | os.PathLike[str], *, folder: bool = True) -> Path:
    """Return the path of a file that does not exist yet.

    Raises
    ------
    RecordError
        When it exists, or its folder does not.
    """
    target = Path(path).expanduser()
    if target.exists():
        raise RecordError("exists and is not replaced", remedy="remove it, or give another path", where=target)
    if folder and not target.parent.is_dir():
        raise RecordError(
            f"cannot be written, because there is no folder {target.parent}",
            remedy="create it, or give another path", where=target,
        )  # fmt: skip
    return target

"""Find a C compiler and build a shared library."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

__all__ = ["BuildError", "Platform", "build_library", "find_compiler", "this_platform"]

FLAGS = ("-std=c99", "-O3", "-shared", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden")
"""Flags of the build; without contraction the numbers equal those of the kernels."""
BUILD_SECONDS = 120.0
"""Longest time for a build [s]."""
Platform = tuple[str, str, str]
"""Folder of binaries in FMI 2.0 and in FMI 3.0, and the ending of a shared library."""

_SYSTEMS = {
    "linux": ("linux", "linux", ".so"),
    "darwin": ("darwin", "darwin", ".dylib"),
    "win32": ("win", "windows", ".dll"),
}
_MACHINES = {
    "amd64": ("64", "x86_64"),
    "x86_64": ("64", "x86_64"),
    "arm64": ("", "aarch64"),
    "aarch64": ("", "aarch64"),
}


class BuildError(Exception):
    """The compiler is missing or did not accept the source."""


def find_compiler() -> str | None:
    """Return the C compiler: that of the environment variable CC, else cc, gcc or clang; None where there is none."""
    return next(
        (path for name in (os.environ.get("CC"), "cc", "gcc", "clang") if name and (path := shutil.which(name))), None
    )


def this_platform() -> Platform | None:
    """Return the names of this platform in FMI, or None where FMI has no name for it.

    Examples
    --------
    >>> this_platform() is None or len(this_platform()) == 3
    True
    """
    system, machine = _SYSTEMS.get(sys.platform), _MACHINES.get(platform.machine().lower())
    if system is None or machine is None:
        return None
    bits = machine[0] or ("64" if sys.platform == "darwin" else "")
    return (f"{system[0]}{bits}" if bits else "", f"{machine[1]}-{system[1]}", system[2])


def build_library(source: Path, library: Path) -> str:
    """Compile a source file to a shared library.

    Parameters
    ----------
    source, library : Path
        The file to compile and the file to write.

    Returns
    -------
    str
        Name of the compiler.

    Raises
    ------
    BuildError
        When there is no compiler, or it does not accept the source.
    """
    compiler = find_compiler()
    if compiler is None:
        raise BuildError("no C compiler (cc, gcc, clang) was found")
    command = [compiler, *FLAGS, "-o", str(library), str(source), "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=BUILD_SECONDS)
    except (OSError, subprocess.SubprocessError) as error:
        raise BuildError(f"{compiler} does not run ({error})") from None
    if done.returncode:
        first = next(iter(done.stderr.strip().splitlines()), "no message")
        raise BuildError(f"{compiler} refused the source ({first})")
    return Path(compiler).name

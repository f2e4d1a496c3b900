"""Find a C compiler and build a shared library."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

__all__ = ["BuildError", "build_library", "this_platform"]

FLAGS = ("-std=c99", "-O3", "-shared", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden")
"""Flags of the build; without contraction the numbers equal those of the kernels."""
BUILD_SECONDS = 120.0
"""Longest time for a build [s]."""
PLATFORMS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux", ".so"),
    ("linux", "aarch64"): ("", "aarch64-linux", ".so"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin", ".dylib"),
    ("darwin", "aarch64"): ("darwin64", "aarch64-darwin", ".dylib"),
    ("win32", "x86_64"): ("win64", "x86_64-windows", ".dll"),
    ("win32", "aarch64"): ("", "aarch64-windows", ".dll"),
}
"""System and machine -> folder of binaries in FMI 2.0, where it has one, and in FMI 3.0, and ending of a library."""


class BuildError(Exception):
    """The compiler is missing or did not accept the source."""


def this_platform() -> tuple[str, str, str]:
    """Return the names of this platform in FMI 2.0 and 3.0 and the ending of a library; empty where FMI has no name.

    Examples
    --------
    >>> len(this_platform())
    3
    """
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    return PLATFORMS.get((sys.platform, machine), ("", "", ""))


def build_library(sources: dict[str, str], main: str) -> tuple[bytes, str]:
    """Compile sources to a shared library with the compiler of the environment variable CC, or cc, gcc or clang.

    Parameters
    ----------
    sources : dict of str
        Texts by the names of their files.
    main : str
        The file to compile, which includes the others.

    Returns
    -------
    tuple of bytes and str
        The library, and the name of the compiler.

    Raises
    ------
    BuildError
        When there is no compiler, or it does not accept the source.
    """
    names = filter(None, (os.environ.get("CC"), "cc", "gcc", "clang"))
    compiler = next(filter(None, map(shutil.which, names)), None)
    if compiler is None:
        raise BuildError("no C compiler (cc, gcc, clang) was found")
    with tempfile.TemporaryDirectory() as name:
        folder, library = Path(name), Path(name) / "library"
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "-o", str(library), str(folder / main), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=BUILD_SECONDS)
        except (OSError, subprocess.SubprocessError) as error:
            raise BuildError(f"{compiler} does not run ({error})") from None
        if done.returncode:
            first = next(iter(done.stderr.strip().splitlines()), "no message")
            raise BuildError(f"{compiler} refused the source ({first})")
        return library.read_bytes(), Path(compiler).name

"""``stiction doctor``: what is installed, where the compiled kernels are stored, and what is missing."""

import sys
from typing import NamedTuple

from stiction.apps.options import JsonOption

__all__ = ["Check", "doctor"]

REQUIRED_PACKAGES = ("numpy", "scipy", "numba", "plotly", "jinja2", "tsdownsample", "pint", "cyclopts", "rich")
EXTRAS = {"control": "control"}
"""Package -> the extra that brings it."""


class Check(NamedTuple):
    """Result of one check."""

    name: str
    """What is checked."""
    ok: bool
    """Whether it is as expected."""
    found: str
    """Version, folder or error."""
    remedy: str
    """The command that corrects it; empty when there is nothing to correct."""


def doctor(*, as_json: JsonOption = False) -> int:
    """Show which versions are installed, whether compiled kernels can be stored, and what is missing.

    Exit code 1 when a required package is missing.

    Parameters
    ----------
    as_json
        Print a list of checks as JSON.
    """
    import platform

    from stiction import __version__
    from stiction.apps.output import print_json, print_table

    new_enough = sys.version_info >= (3, 11)
    checks = [
        Check("stiction", True, __version__, ""),
        Check("Python", new_enough, platform.python_version(), "" if new_enough else "install Python 3.11"),
        *(_package(name, f"pip install {name}") for name in REQUIRED_PACKAGES),
        *_extras(),
    ]
    if next(check for check in checks if check.name == "numba").ok:
        checks += _kernels()
    if as_json:
        print_json([check._asdict() for check in checks])
    else:
        print_table(["", "What", "Found", "Remedy"], [(_state(check), *check[:1], *check[2:]) for check in checks])
    return int(not all(check.ok for check in checks if check.name not in EXTRAS))


def _state(check: Check) -> str:
    return "ok" if check.ok else "optional" if check.name in EXTRAS else "MISSING"


def _package(name: str, remedy: str) -> Check:
    from importlib.metadata import PackageNotFoundError, version
    from importlib.util import find_spec

    try:
        installed = version(name)
    except PackageNotFoundError:
        return Check(name, False, "not installed", remedy)
    if find_spec(name) is None:
        return Check(name, False, f"{installed}, but cannot be imported", f"pip install --force-reinstall {name}")
    return Check(name, True, installed, "")


def _extras() -> list[Check]:
    return [_package(name, f'pip install "stiction[{extra}]"') for name, extra in EXTRAS.items()]


def _kernels() -> list[Check]:
    """Check the folder of the compiled kernels, and that a kernel runs."""
    import time

    from stiction.models.numba_compile import cache_folder

    folder = cache_folder()
    if folder is None:
        return [
            Check("kernel cache", False, "no folder can be written", "export NUMBA_CACHE_DIR=a folder you may write to")
        ]
    kept = sum(1 for _ in folder.rglob("*.nbi"))
    began = time.perf_counter()
    from stiction import Kano, stroke

    moved = stroke(Kano(S=3.0, J=1.0), [0.0, 2.5, 3.0], dt=1.0).mv
    seconds = time.perf_counter() - began
    right = moved is not None and moved.tolist() == [0.0, 1.5, 2.0]
    warm = f"{kept} kernels kept" if kept else "cold: the first run compiles for up to a minute"
    return [
        Check("kernel cache", True, f"{folder} ({warm})", ""),
        Check("kernel", right, f"ready in {seconds:.1f} s", "" if right else f"remove {folder}"),
    ]

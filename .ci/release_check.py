"""Check a release: build, metadata, contents, versions, installation with each extra, demo without a network.

``make release-check`` runs it. ``--extras plot,sql`` installs only these extras, ``--no-install`` none.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DEVELOPER_EXTRAS = {"test", "check", "docs", "release", "dev"}
"""Extras for work on the package; users install the others."""
FETCHED_AT_BUILD = re.compile("stiction/apps/web/static/vendor/")
"""Files of the wheel that are not in the repository: fetched when it is built."""
MIN_TYPED_PERCENT = 95.0
OFFLINE_DEMO = """
import socket, sys
def refuse(*_):
    raise OSError("the demo asked for a network")
socket.socket.connect = socket.create_connection = socket.getaddrinfo = refuse
from stiction.apps.cli import main
sys.exit(0 if main(["demo", "--no-open"]) in (0, 1) else 1)
"""


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """Run a command and return its output; stop with it when it fails."""
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"failed: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def check_versions() -> str:
    """Return the version on which package, changelog and citation agree."""
    version = re.search(r'__version__ = "(.+)"', (ROOT / "src/stiction/__init__.py").read_text(encoding="utf-8"))
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)
    listed = re.search(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    found = {match[1] if match else "none" for match in (version, cited, listed)}
    if len(found) > 1:
        raise SystemExit(f"package, CITATION.cff and CHANGELOG.md name the versions {', '.join(sorted(found))}")
    return found.pop()


def build(folder: Path) -> Path:
    """Build sdist and wheel, check their metadata, return the wheel."""
    run(sys.executable, "-m", "build", "--outdir", folder, ROOT)
    run(sys.executable, "-m", "twine", "check", "--strict", *folder.iterdir())
    return next(folder.glob("*.whl"))


def check_contents(wheel: Path) -> int:
    """Compare the wheel with the files of the repository: nothing missing, nothing more; return their number."""
    listed = run("git", "ls-files", "src/stiction").splitlines()
    expected = {name.removeprefix("src/") for name in listed if (ROOT / name).is_file()}
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    missing = expected - packed
    surplus = {name for name in packed - expected if not FETCHED_AT_BUILD.search(name)}
    if missing or surplus:
        raise SystemExit(f"wheel lacks {sorted(missing)} and has in addition {sorted(surplus)}")
    return len(packed)


def user_extras() -> list[str]:
    """Extras that a user may install, and none at all as an empty name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return ["", *sorted(set(project["optional-dependencies"]) - DEVELOPER_EXTRAS)]


def check_installation(wheel: Path, extra: str) -> None:
    """Install the wheel into an empty environment and run the demo in another folder, without a network."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        run(sys.executable, "-m", "venv", place / "env")
        python = place / "env" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
        run(python, "-m", "pip", "install", "--quiet", f"{wheel}[{extra}]" if extra else wheel)
        run(python, "-m", "pip", "check")
        run(python, "-c", OFFLINE_DEMO, cwd=place)
        if not (place / "stiction-demo.html").is_file():
            raise SystemExit(f"the demo of extra {extra or 'none'} wrote no report")


def check_types() -> float:
    """Return the share of public names with complete types [%]."""
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--verifytypes", "stiction", "--ignoreexternal"],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT / "src")}, capture_output=True, text=True,
    )  # fmt: skip
    score = re.search(r"Type completeness score: ([\d.]+)%", done.stdout)
    share = float(score[1]) if score else 0.0
    if share < MIN_TYPED_PERCENT:
        raise SystemExit(f"type completeness is {share} %, at least {MIN_TYPED_PERCENT} % is required")
    return share


def main() -> int:
    """Run all checks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extras", help="comma-separated extras to install; all when not given")
    parser.add_argument("--no-install", action="store_true")
    given = parser.parse_args()
    print("version", check_versions())
    print("types", check_types(), "%")
    with tempfile.TemporaryDirectory() as folder:
        wheel = build(Path(folder))
        print(wheel.name, check_contents(wheel), "files")
        extras = user_extras() if given.extras is None else given.extras.split(",")
        for extra in [] if given.no_install else extras:
            check_installation(wheel, extra)
            print("installed", extra or "without extras", "- the demo runs without a network")
    return 0


if __name__ == "__main__":
    sys.exit(main())

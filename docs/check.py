"""Check the documentation: Python blocks run, commands exist, links lead somewhere.

A block marked ``python`` runs, the blocks of a page one after the other in one namespace; one with ``>>>`` is a
doctest. In a block marked ``console`` each line after ``$`` names a command: `make` targets must be in the Makefile
and `stiction` verbs must answer ``--help``. After ``<!-- run -->`` the lines are run as they stand. The list of public
names must be what `reference.py` writes.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import subprocess
import sys
import tempfile
import traceback
from functools import cache
from pathlib import Path

import reference

ROOT = Path(__file__).resolve().parents[1]
BIN = Path(sys.executable).parent
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"(?P<run><!-- run -->\n+)?^```(?P<kind>python|console)\n(?P<text>.*?)^```$", re.M | re.S)
LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
TARGETS = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)


def check_python(text: str, namespace: dict[str, object]) -> str | None:
    """Run a block; say what went wrong."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        if ">>> " in text:
            test = doctest.DocTestParser().get_doctest(text, namespace, "block", None, 0)
            failed = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, clear_globs=False).failed
            namespace.update(test.globs)
            return out.getvalue() if failed else None
        try:
            exec(compile(text, "block", "exec"), namespace)
        except Exception:
            return traceback.format_exc(limit=-1)
    return None


@cache
def answers_help(verb: str) -> str | None:
    """Ask `stiction VERB --help`."""
    done = subprocess.run([BIN / "stiction", verb, "--help"], capture_output=True, text=True, timeout=60)
    return None if done.returncode == 0 else f"stiction {verb} --help: {(done.stderr or done.stdout)[-500:]}"


def check_command(line: str) -> str | None:
    """Ask whether a command exists, without running it."""
    words = line.split()
    if words[0] == "make":
        missing = [word for word in words[1:] if "=" not in word and not word.startswith("-") and word not in TARGETS]
        return f"make knows no {missing}" if missing else None
    if words[0] == "stiction":
        return answers_help(words[1]) if len(words) > 1 else None
    return None


def run_command(line: str, folder: str) -> str | None:
    """Run a command as it stands; findings (1) are no failure."""
    path = os.pathsep.join([str(BIN), os.environ.get("PATH", "")])
    done = subprocess.run(
        line, shell=True, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=300
    )
    return None if done.returncode in (0, 1) else f"{line}: exit code {done.returncode}\n{done.stderr[-1000:]}"


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as they are made for Markdown on the web."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def check_link(page: Path, target: str) -> str | None:
    """Ask whether a link inside the project leads somewhere; others are left alone."""
    if re.match(r"[a-z]+:", target):
        return None
    path, _, anchor = target.partition("#")
    end = (page.parent / path).resolve() if path else page
    if not end.exists():
        return f"link to {target}: no such file"
    if anchor and anchor not in anchors(end):
        return f"link to {target}: no such heading"
    return None


def check_page(page: Path) -> list[tuple[int, str]]:
    """Everything wrong with a page: line and finding."""
    text = page.read_text(encoding="utf-8")
    findings: list[tuple[int, str | None]] = []
    namespace: dict[str, object] = {"__name__": "docs"}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for block in BLOCK.finditer(text):
            line = text.count("\n", 0, block.start("text")) + 1
            if block["kind"] == "python":
                findings.append((line, check_python(block["text"], namespace)))
                continue
            for command in re.findall(r"^\$ ([^#\n]+)", block["text"], re.M):
                found = run_command(command, folder) if block["run"] else check_command(command)
                findings.append((line, found))
        prose = BLOCK.sub("", text)
        findings += [(0, check_link(page, link["target"])) for link in LINK.finditer(prose)]
    return [(line, found) for line, found in findings if found]


def main() -> int:
    """Check all pages; print what is wrong."""
    wrong = [(page, line, found) for page in PAGES for line, found in check_page(page)]
    if reference.PAGE.read_text(encoding="utf-8") != reference.page():
        wrong.append((reference.PAGE, 0, "the docstrings say something else; run make reference"))
    for page, line, found in wrong:
        print(f"{page.relative_to(ROOT)}:{line}: {found}")
    print(f"documentation: {len(PAGES)} pages, {len(wrong)} findings")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

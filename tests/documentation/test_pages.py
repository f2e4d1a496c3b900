"""Every Python and console block of every page runs, links lead somewhere, and examples of the gallery are complete."""

from __future__ import annotations

import contextlib
import doctest
import io
import re
import shlex
import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from documentation.page_blocks import GENERATED, ROOT, Block, blocks, pages, simulate_one_unit, write_example_files
from stiction.apps.cli import main

if TYPE_CHECKING:
    from pathlib import Path

MAX_NOT_RUN = 11
MIN_EXAMPLES = 25
PAGES = pages()
LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
EXAMPLES = sorted((ROOT / "examples").rglob("plot_*.py"))


def page_id(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    write_example_files(folder)
    return folder


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=page_id)
def test_blocks_of_page_run(page, files, tmp_path, monkeypatch, audit_in_process):
    """All blocks of a page in one folder and one namespace, from the first to the last; the demo plant is small."""
    monkeypatch.setattr("stiction.simulation.plant.simulate_plant", simulate_one_unit)
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.why_not:
            continue
        if block.kind == "python":
            run_python(block, namespace)
        for command in block.commands if block.kind == "console" else ():
            run_command(block, command, tmp_path)


def run_python(block: Block, namespace: dict[str, object]) -> None:
    if ">>> " in block.text:
        said: list[str] = []
        test = doctest.DocTestParser().get_doctest(block.text, namespace, block.page, block.page, block.line)
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
        runner.run(test, out=said.append, clear_globs=False)
        assert not runner.failures, "".join(said)
        namespace.update(test.globs)
        return
    code = "\n" * (block.line - 1) + block.text
    exec(compile(code, str(ROOT / block.page), "exec"), namespace)


def run_command(block: Block, command: str, folder: Path) -> None:
    """Run a line, `stiction` in this process, which is faster; exit codes 0 and 1 (findings) are what a page shows."""
    words = shlex.split(command)
    said = io.StringIO()
    if words[0] == "stiction":
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = main(words[1:])
    else:
        done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, timeout=300)
        code, _ = done.returncode, said.write(done.stdout + done.stderr)
    assert code in (0, 1), f"{block.page}:{block.line}: {command}\n{said.getvalue()}"


def test_few_blocks_do_not_run():
    skipped = [(block.page, block.line, block.why_not) for page in PAGES for block in blocks(page) if block.why_not]
    assert len(skipped) <= MAX_NOT_RUN, skipped


def test_every_make_target_exists():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    commands = [command for page in PAGES for block in blocks(page) for command in block.commands]
    named = {word for one in commands if one.startswith("make ") for word in one.split()[1:] if "=" not in word}
    assert named <= targets, named - targets


def anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_lead_somewhere(page):
    """Links are read in a checkout too: none leads to a page that exists in the built site only."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for match in LINK.finditer(text):
        target, _, anchor = match["target"].partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        end = (page.parent / target).resolve() if target else page
        assert end.exists(), f"{match['target']}: no such file"
        assert not GENERATED & set(end.relative_to(ROOT).parts), f"{match['target']}: exists in the built site only"
        assert not anchor or anchor in anchors(end), f"{match['target']}: no such heading"


def test_gallery_is_large_enough():
    assert len(EXAMPLES) >= MIN_EXAMPLES


@pytest.mark.parametrize("example", EXAMPLES, ids=page_id)
def test_example_has_a_title_and_a_figure(example):
    text = example.read_text(encoding="utf-8")
    title, line = text.splitlines()[1:3]
    assert set(line) == {"="}
    assert len(line) == len(title)
    assert "plt.show()" in text

"""The house: floors, sizes, names, and what must never be committed."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import stiction

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "stiction"
KEPT = ("src", "tests", "docs", "examples", "benchmarks", ".ci")
TEXT = {".py", ".md", ".toml", ".yaml", ".yml", ".cff", ".bib", ".html", ".css", ".js", ".csv", ".json", ".svg", ""}


def committed() -> list[Path]:
    """Files of the project: what git knows or would take, else what lies in the project's folders."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    if listed.returncode == 0:
        return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]
    inside = [p for folder in KEPT for p in (ROOT / folder).rglob("*") if "__pycache__" not in p.parts]
    return [p for p in (*ROOT.iterdir(), *inside) if p.is_file()]


FILES = committed()
PAGES = [p for p in FILES if p.suffix == ".py"]


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_floors_hold():
    """Run the import contracts of pyproject.toml."""
    run = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"]
    pytest.importorskip("importlinter", reason="import-linter is not installed; `make check` runs the contracts")
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_errors_import_no_other_module_of_the_package():
    assert "stiction" not in re.findall(r"^(?:from|import)\s+(\w+)", text_of(PACKAGE / "errors.py"), re.M)


def test_numba_is_touched_in_one_place():
    users = {name_of(p) for p in PACKAGE.rglob("*.py") if re.search(r"^\s*(import|from) numba", text_of(p), re.M)}
    assert users == {"src/stiction/models/numba_compile.py"}


MAX_POSITIONAL = 8


def kernels_and_callables() -> tuple[set[str], set[str]]:
    """Names of the kernels, and of all functions and classes of the package."""
    nodes = [node for p in PACKAGE.rglob("*.py") for node in ast.walk(ast.parse(text_of(p)))]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    kernels = {
        one.name for one in functions if {ast.unparse(d) for d in one.decorator_list} & {"kernel", "inline_kernel"}
    }
    return kernels, {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def test_calls_name_their_arguments_from_the_ninth_on():
    """But those of kernels and of their states, which numba wants by place."""
    kernels, callables = kernels_and_callables()
    states = {"ValveState", "CompensatorState", "PhysicalParameters", "LoopState", "RunSpace"}
    drivers = {"fast_closed_loop"}  # chooses among kernels
    named = callables - kernels - states - drivers
    assert len(named) > 1000
    long_calls = [
        f"{name_of(p)}:{node.lineno} {node.func.id}"
        for p in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(text_of(p)))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in named
        if len(node.args) > MAX_POSITIONAL
    ]
    assert not long_calls


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_page_is_short(path):
    assert len(text_of(path).splitlines()) <= 400


def test_no_folder_with_one_file():
    for folder in {p.parent for p in PACKAGE.rglob("*.py")}:
        modules = [p for p in folder.iterdir() if p.suffix == ".py" or (p / "__init__.py").exists()]
        assert len(modules) > 1, f"{name_of(folder)} holds one file: move it up or leave the room out"


def test_no_utils():
    vague = {"util", "utils", "helper", "helpers", "misc", "common"}
    assert not [name_of(p) for p in PACKAGE.rglob("*") if p.stem.strip("_") in vague]


def test_no_path_of_a_machine_and_no_package_host():
    hosts = ["py" + "pi.org", "python" + "hosted", "npm" + "js", "conda" + ".anaconda", "index" + "-url"]
    paths = ["/wo" + "rk/", "/ho" + "me/", "/Us" + "ers/", "/ro" + "ot/", "C:\\\\Us" + "ers"]
    wrong = re.compile("|".join(map(re.escape, hosts + paths)))
    found = {name_of(p): m.group() for p in FILES if p.suffix in TEXT and (m := wrong.search(text_of(p)))}
    assert not found


def test_no_lock_file():
    assert not [name_of(p) for p in FILES if p.name in {"uv.lock", "poetry.lock", "package-lock.json", "pdm.lock"}]


def test_no_retracted_source():
    """The open review of 2015 in `Processes` is marked retracted by its publisher."""
    retracted = re.compile(r"pr30" + r"20422|Review on Valve" + r"\s+Stiction", re.I)
    assert not [name_of(p) for p in FILES if p.suffix in TEXT and retracted.search(text_of(p))]


def test_no_real_record():
    """Records of real plants are not ours to pass on."""
    folder = ROOT.parent / "shared" / "data"
    names = {p.name for p in folder.rglob("*.csv")} if folder.is_dir() else set()
    assert not [name_of(p) for p in FILES if p.name in names and p.suffix == ".csv"]


def test_one_version():
    """The package's version is the one of the citation and of the newest heading of the changelog."""
    project = tomllib.loads(text_of(ROOT / "pyproject.toml"))["project"]
    assert "version" not in project
    assert f"version: {stiction.__version__}\n" in text_of(ROOT / "CITATION.cff")
    assert re.search(r"^## \[(.+?)\]", text_of(ROOT / "CHANGELOG.md"), re.M)[1] == stiction.__version__


POSIX_MODULES = re.compile("fcntl|grp|posix|pty|pwd|resource|syslog|termios|tty")
POSIX_NAMES = {
    "os": re.compile(
        "chroot|fchmod|l?f?chown|fork|forkpty|gete?[gu]id|get(loadavg|pgid|priority)|killpg|mkfifo|mknod|nice|openpty|"
        "posix_spawn|register_at_fork|sched_[gs]etaffinity|set(priority|sid|uid)|statvfs|sysconf|uname|wait[34]?"
    ),
    "signal": re.compile("SIG(ALRM|CHLD|CONT|HUP|KILL|PIPE|STOP|USR1|USR2)|alarm|pause|setitimer"),
    "asyncio": re.compile("add_signal_handler"),
}
NEVER = re.compile(r"(?!)")


def posix_calls(text: str) -> set[str]:
    """Names that Windows lacks and for which the code has no other branch there.

    A branch is `if os.name == ...`, `if hasattr(os, "name")`, also by a variable, or `try` with `except ImportError`.
    """
    found: set[str] = set()
    flags = re.findall(r"(\w+) = hasattr\(", text)
    branch = re.compile("|".join([r"os\.name", r"sys\.platform", r"hasattr\(", *(rf"\b{flag}\b" for flag in flags)]))

    def visit(node: ast.AST, guarded: bool) -> None:
        if isinstance(node, ast.If | ast.IfExp):
            guarded |= bool(branch.search(ast.unparse(node.test)))
        if isinstance(node, ast.Try):
            guarded |= any("ImportError" in ast.unparse(one.type or node) for one in node.handlers)
        names: list[tuple[str, bool]] = []
        if isinstance(node, ast.Import):
            names = [(one.name, bool(POSIX_MODULES.fullmatch(one.name))) for one in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            is_posix, posix = bool(POSIX_MODULES.fullmatch(module)), POSIX_NAMES.get(module, NEVER)
            names = [(one.name, is_posix or bool(posix.fullmatch(one.name))) for one in node.names]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            names = [(ast.unparse(node), bool(POSIX_NAMES.get(node.value.id, NEVER).fullmatch(node.attr)))]
        found.update(name for name, matches in names if matches and not guarded)
        for child in ast.iter_child_nodes(node):
            visit(child, guarded)

    visit(ast.parse(text), False)
    return found


def test_no_call_that_only_posix_has():
    """Tests and benchmarks may: they run on the machines of developers."""
    outside = [p for p in PAGES if p.relative_to(ROOT).parts[0] not in ("tests", "benchmarks")]
    assert len(outside) > 500
    assert not {name_of(p): names for p in outside if (names := posix_calls(text_of(p)))}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import os\nos.kill(os.getpid(), 9)\nos.killpg(1, 9)", {"os.killpg"}),
        (
            "import signal\nsignal.signal(signal.SIGINT, f)\nsignal.alarm(signal.SIGKILL)",
            {"signal.alarm", "signal.SIGKILL"},
        ),
        ("def f():\n    import fcntl", {"fcntl"}),
        ("from os import fork, getpid", {"fork"}),
        ("import os\nif os.name == 'nt':\n    pass\nelse:\n    import fcntl", set()),
        ("n = os.getloadavg() if hasattr(os, 'getloadavg') else 0", set()),
        ("import signal\ntimer = hasattr(signal, 'setitimer')\nif timer:\n    signal.setitimer(0, 1)", set()),
        ("try:\n    import resource\nexcept ImportError:\n    pass", set()),
    ],
)
def test_calls_that_only_posix_has_are_found(text, found):
    assert posix_calls(text) == found


def test_readme_has_the_numbers_of_the_validation():
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import trust_numbers
    finally:
        sys.path.pop(0)
    assert trust_numbers.readme_with_numbers() == text_of(ROOT / "README.md"), "run python docs/trust_numbers.py"


def test_news_fragments_have_a_kind():
    kinds = re.compile(r"^\+[a-z0-9-]+\.(added|changed|fixed|removed)\.md$")
    names = [p.name for p in (ROOT / "changes").iterdir() if p.name != "README.md"]
    assert not [name for name in names if not kinds.match(name)]

"""The command as a whole: verbs, help, wrong usage, what is imported and what becomes of faults."""

from __future__ import annotations

import json
import logging
import os
import re
import signal
import subprocess
import sys

import pytest

from stiction.apps.cli import VERBS, main

HEAVY = ("numpy", "numba", "scipy", "polars", "plotly", "jinja2", "pint", "control")


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_help_is_shown_and_loads_nothing_heavy(verb):
    code = (
        "import sys\nfrom stiction.apps.cli import main\n"
        f"code = main({[*verb.split(), '--help']!r})\n"
        f"print(code, [name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stderr.strip() == "0 []"
    assert f"Usage: stiction {verb}".strip() in done.stdout


def test_help_lists_every_verb_with_what_it_does(run):
    def shown(*words):
        return " ".join(run(*words, "--help").out.replace("│", " ").split())

    for verb, (_, _, does) in VERBS.items():
        word, *rest = verb.split()
        assert word in shown()
        assert does in shown(*([word] if rest else []))


@pytest.mark.parametrize("verb", VERBS)
def test_help_tells_every_option(verb, run):
    from stiction.apps import cli

    shown = run(*verb.split(), "--help").out
    app = cli._app(verb.split())
    for word in verb.split():
        app = app[word]
    arguments = [argument for argument in app.assemble_argument_collection() if argument.show]
    for argument in arguments:
        told = re.search(rf"{argument.name}(?:\.\.\.)?(?: (?:[A-Z]+(?:\.\.\.)?|--[a-z-]+))* {{2,}}\S", shown)
        assert told, f"{argument.name} is not told"


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["frob"], "Unknown command"),
        (["diagnos", "x.csv"], 'Did you mean "diagnose"'),
        (["diagnose"], "there is no file"),
        (["diagnose", "--jsn", "x.csv"], "Did you mean --json"),
        (["diagnose", "x.csv", "--dt", "fast"], "--dt"),
        (["diagnose", "x.csv", "--column", "op"], "SIGNAL=NAME"),
        (["diagnose", "x.csv", "--report", "a.html", "--no-report"], "cannot be used together"),
        (["simulate", "--frob"], "Unknown option"),
        (["simulate", "surplus"], "surplus"),
        (["simulate", "--valve", "kano:S=-3,J=1"], "negative"),
        (["stroke", "--valve", "kanno:S=3"], 'Did you mean "kano"'),
    ],
)
def test_wrong_usage_is_2_with_one_sentence(argv, says, run, folder):
    done = run(*argv)
    assert done.code == 2
    assert says in done.err
    assert done.err.startswith("stiction: ")
    assert done.err.count("\n") == 1
    assert done.out == ""
    assert list(folder.iterdir()) == []


def test_interrupt_is_quiet(monkeypatch, capsys):
    monkeypatch.setattr("stiction.apps.doctor._kernels", lambda: (_ for _ in ()).throw(KeyboardInterrupt))
    assert main(["doctor"]) == 130
    assert capsys.readouterr() == ("", "")


def test_ctrl_c_ends_a_running_command_quietly():
    running = subprocess.Popen(
        [sys.executable, "-m", "stiction.apps.cli", "diagnose", "-", "--no-report"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # A shell starts what it puts in the background with Ctrl-C ignored, and the tests may run there.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert running.stdin is not None
    # More than a pipe holds: what is written has gone only when the command reads.
    running.stdin.write(b"time_s,PV,OP\n" + b"0,1,2\n" * 50_000)
    running.stdin.flush()
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert b"Traceback" not in err
    assert out == b""


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_file_being_written_leaves_nothing_when_the_program_is_asked_to_end(name, folder, monkeypatch, capsys):
    number = getattr(signal, name)
    if signal.getsignal(number) == signal.SIG_IGN:
        pytest.skip(f"{name} is ignored here, as under nohup")

    def halfway(*_):
        assert [path.suffix for path in folder.iterdir()] == [".part"]
        signal.raise_signal(number)

    before = signal.getsignal(number)
    monkeypatch.setattr("stiction.atomic_write.os.replace", halfway)
    assert main(["simulate", "--duration", "100", "--out", "a.csv"]) == 128 + number
    assert list(folder.iterdir()) == []
    assert signal.getsignal(number) is before
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("argv", [["simulate", "--duration", "100"], ["--help"], ["diagnose", "--help"], ["--version"]])
def test_a_closed_pipe_is_quiet(argv):
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "wb") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "stiction.apps.cli", *argv],
            stdout=closed,
            stderr=subprocess.PIPE,
            timeout=120,
        )
    assert done.returncode == 141
    assert done.stderr == b""


def test_a_fault_of_ours_is_neither_a_finding_nor_silent(monkeypatch, capsys):
    monkeypatch.setattr("stiction.apps.doctor._package", lambda *_: 1 / 0)
    assert main(["doctor"]) == 70
    assert "error in the program" in capsys.readouterr().err


def test_version(run):
    import stiction

    assert run("--version").out.strip() == stiction.__version__


def test_the_package_can_be_run(run):
    told = subprocess.run([sys.executable, "-m", "stiction", "frobnicate"], capture_output=True, text=True, timeout=60)
    assert (told.returncode, told.stderr) == (2, run("frobnicate").err)


def test_doctor_finds_this_environment_whole(run):
    done = run("doctor", "--json")
    checks = {check["name"]: check for check in json.loads(done.out)}
    assert done.code == 0
    assert {"Python", "numpy", "numba", "scipy", "plotly", "kernel cache", "kernel"} <= checks.keys()
    assert all(check["ok"] for name, check in checks.items() if name != "control")


def test_doctor_names_the_command_that_mends(run, monkeypatch):
    from importlib import metadata

    real = metadata.version

    def version(name: str) -> str:
        if name in ("plotly", "control"):
            raise metadata.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(metadata, "version", version)
    done = run("doctor")
    assert done.code == 1
    lines = {line.split()[1]: line for line in done.out.splitlines()[1:]}
    assert lines["plotly"].startswith("MISSING")
    assert "pip install plotly" in lines["plotly"]
    assert lines["control"].startswith("optional")
    assert 'pip install "stiction[control]"' in lines["control"]


def test_doctor_without_a_writable_cache(run, monkeypatch):
    monkeypatch.setattr("stiction.models.numba_compile.cache_folder", lambda: None)
    done = run("doctor")
    assert done.code == 1
    assert "NUMBA_CACHE_DIR" in done.out


def test_a_terminal_shows_what_the_package_logs(monkeypatch, capsys):
    from stiction.apps import cli

    logger = logging.getLogger("stiction")
    monkeypatch.setattr(logger, "handlers", [])
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    before = logger.level
    cli._attach_logger()
    cli._attach_logger()
    logger.info("compiling")
    logger.setLevel(before)
    assert capsys.readouterr().err == "stiction: compiling\n"


@pytest.mark.parametrize("width", [40, 80, 100, 200])
def test_a_table_breaks_no_word(width, monkeypatch, capsys):
    from stiction.apps.output import print_table

    rows = [
        ["TIC-107", "No stiction", "<0.01", "Check range, resolution, filter and wiring of the transmitter."],
        ["PIC-102-NORTH", "Stiction", "0.99", "Check packing, actuator and positioner of the valve."],
    ]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("TERM", "dumb")
    print_table(["Loop", "Verdict", "Probability", "What to do"], rows)
    shown = capsys.readouterr().out
    assert {word for row in rows for text in row for word in text.split()} <= {*shown.split()}
    assert width == 40 or max(map(len, shown.splitlines())) <= width
    assert ("Probability: 0.99" in shown) == (width == 40)


def test_ctrl_c_while_the_program_is_being_loaded_is_quiet(monkeypatch, capsys):
    """What takes time to import is imported within `main`, where Ctrl-C is caught."""
    import builtins

    real = builtins.__import__

    def interrupted(name, *rest, **more):
        if name == "cyclopts":
            raise KeyboardInterrupt
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", interrupted)
    assert main(["doctor"]) == 130
    assert capsys.readouterr() == ("", "")
    code = "import sys, stiction.apps.cli; print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert not {"cyclopts", "numpy", "rich"} & set(told.stdout.split())

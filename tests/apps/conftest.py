"""Commands run in this process, in an empty folder of their own."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import pytest

import stiction as st
from stiction.apps.cli import main
from stiction.apps.output_files import csv_text


@dataclass
class Run:
    """What a command left behind."""

    code: int
    out: str
    err: str


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder, capsys, monkeypatch):
    """Run a command; bytes given as `stdin` are piped in."""

    def go(*argv: str, stdin: bytes | None = None) -> Run:
        if stdin is not None:
            monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        capsys.readouterr()
        code = main(list(argv))
        shown = capsys.readouterr()
        return Run(code, shown.out, shown.err)

    return go


def sticky(n=1200, S=5.0, J=2.0, tag="FIC-101"):
    """A flow loop that cycles because of its valve."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S, J), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    return st.simulate(loop, 150.0, float(n), seed=1, pv_start=148.0, op_start=50.0, tag=tag, loop_type="flow")


@pytest.fixture(scope="session")
def sticky_csv() -> str:
    """Its record, the stem position left out."""
    from dataclasses import replace

    header, rows = csv_text(replace(sticky(3000), mv=None)).split("\n", 1)
    return header.replace("SP", "FIC-101.SP").replace("PV", "FIC-101.PV").replace("OP", "FIC-101.OP") + "\n" + rows


@pytest.fixture(scope="session")
def healthy_csv() -> str:
    """A flow loop with a good valve, a moving load and set-point steps that show the valve to follow OP."""
    from dataclasses import replace

    from stiction.simulation.input_signals import random_walk

    loop = st.Loop(st.PID(0.35, 6.0), st.Ideal(), st.FOPDT(1.8, 5.0, 2.0), dt=1.0, noise=0.2)
    load = random_walk(0.0, 0.08, 900.0, 1.0, seed=2)
    sp = 88.0 + 3.0 * (np.arange(900) // 150 % 2)
    record = st.simulate(loop, sp, 900.0, load, 1, pv_start=88.0, op_start=50.0)
    return csv_text(replace(record, mv=None))

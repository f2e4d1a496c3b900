"""A fault of the program in one loop or file is a row of its own; the verdicts of the others are told."""

from __future__ import annotations

import json

import pytest

import stiction as st
import stiction.sources
from stiction.sources import find_loops


@pytest.fixture
def plant(folder, sticky_csv, healthy_csv):
    """Three files, of which the program stumbles over the second."""
    (folder / "sticky.csv").write_text(sticky_csv)
    (folder / "odd.csv").write_text(sticky_csv.replace("FIC-101", "ODD-1"))
    (folder / "healthy.csv").write_text(healthy_csv)
    return ("sticky.csv", "odd.csv", "healthy.csv")


@pytest.fixture(params=["reading", "judging"])
def stumbles(request, monkeypatch):
    """The program divides by zero while it reads or judges the odd loop."""
    assign, diagnose = find_loops.assign_roles, st.diagnose

    def reading(columns, options, rows, name):
        return 1 / 0 if name.startswith("odd") else assign(columns, options, rows, name)

    def judging(record, **settings):
        first = record[0] if isinstance(record, list) else record
        return 1 / 0 if first.tag == "ODD-1" else diagnose(record, **settings)

    if request.param == "reading":
        monkeypatch.setattr(find_loops, "assign_roles", reading)
    else:
        monkeypatch.setattr(st, "diagnose", judging)


def test_other_loops_are_diagnosed(run, plant, stumbles):
    done = run("diagnose", *plant, "--no-report")
    assert done.code == 1
    [row] = [line for line in done.out.splitlines() if "Not diagnosed" in line]
    assert "an error in the program (ZeroDivisionError: division by zero); please report it." in row
    assert "FIC-101" in done.out
    assert "healthy" in done.out
    assert done.err.count("Traceback") == 1
    assert run("diagnose", *plant[1:], "--no-report").code == 0


def test_json_stays_a_list_with_an_object_for_each(run, plant, stumbles):
    done = run("diagnose", *plant, "--json")
    found = json.loads(done.out)
    assert [entry["file"] for entry in found] == ["sticky.csv", "healthy.csv", "odd.csv"]
    assert [entry["verdict"] for entry in found] == ["stiction", "no_stiction", "undecided"]
    assert "ZeroDivisionError" in found[2]["error"]
    assert found[2]["action"] == "Report the error."


def test_a_fault_that_leaves_nothing_is_70(run, plant, stumbles):
    done = run("diagnose", "odd.csv", "--no-report")
    assert done.code == 70
    assert done.err.count("Traceback") == 1
    assert "an error in the program" in done.err
    assert len(json.loads(run("diagnose", "odd.csv", "--json").out)) == 1


def test_a_wrong_option_is_still_the_caller_s(run, plant, monkeypatch):
    def refusing(file, **options):
        raise st.ParameterError("dt = -1 s is not positive; give a value above 0.")

    monkeypatch.setattr(stiction.sources, "open_loops", refusing)
    assert run("diagnose", *plant, "--no-report").code == 2

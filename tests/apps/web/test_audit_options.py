"""Pages of an audit repeat its diagnoses with the prior and the costs of the audit, and "Go on" keeps its options."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import stiction as st
from apps.conftest import sticky
from fleet.in_process_audit import audits_in_this_process
from stiction.apps.web.audit_loop import prepare_audit_loop, write_audit_record
from stiction.apps.web.audit_process import main as go_on
from stiction.apps.web.loop_files import write_loop_report
from stiction.apps.web.simulation_answers import answer_start
from stiction.records.parquet_writer import to_parquet

PRIOR, COSTS = 0.3, (1000.0, 0.001, 0.5)
"""With these costs no valve is called sticky."""


@pytest.fixture(scope="module")
def audit_folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("audit")
    to_parquet([sticky(), sticky(tag="FIC-102")], folder / "plant.parquet")
    (folder / "links.csv").write_text("from,to\nFIC-101,FIC-102\n")
    options = {"prior": PRIOR, "costs": COSTS, "connections": folder / "links.csv"}
    with audits_in_this_process():
        found = st.audit(folder / "plant.parquet", folder / "audit", workers=1, **options)
    assert [row["verdict"] for row in found.rows] == ["no_stiction", "no_stiction"]
    assert st.diagnose(sticky()).verdict == "stiction"
    return folder / "audit"


@pytest.fixture(scope="module")
def page_folder(audit_folder, tmp_path_factory) -> Path:
    """What the page of the loop is made of."""
    folder = tmp_path_factory.mktemp("page")
    prepare_audit_loop(str(audit_folder), 1, str(folder))
    write_audit_record(str(audit_folder), 1, str(folder / "record.parquet"))
    return folder


def test_page_shows_the_verdict_of_the_audit(page_folder):
    content = json.loads((page_folder / "content.json").read_text())
    assert content["verdict"] == content["diagnosis"]["verdict"] == "no_stiction"
    assert content["diagnosis"]["prior"] == PRIOR
    assert "another verdict" not in content["headline"]["confidence"]


def test_what_if_starts_from_the_verdict_of_the_audit(page_folder):
    body = answer_start(str(page_folder / "record.parquet"))
    length = int.from_bytes(body[:4], "little")
    start = json.loads(body[4 : 4 + length])
    assert start["settings"]["model"] == "ideal"
    assert "The verdict is no stiction" in start["remarks"][0]


def test_report_gives_the_verdict_of_the_audit(page_folder):
    path, _ = write_loop_report(str(page_folder / "record.parquet"), str(page_folder))
    assert "With these costs the verdict is" in Path(path).read_text(encoding="utf-8")


def test_going_on_keeps_all_options(audit_folder):
    assert go_on(str(audit_folder)) == 0
    audit = st.open_audit(audit_folder)
    assert [row["verdict"] for row in audit.rows] == ["no_stiction", "no_stiction"]
    assert (audit.run["prior"], tuple(audit.run["costs"])) == (PRIOR, COSTS)
    assert audit.settings["connections"].endswith("links.csv")

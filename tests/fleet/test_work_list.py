"""The work list of an audit: who does what, in which order, and what a repair changed."""

from __future__ import annotations

from dataclasses import replace

import openpyxl
import pytest

from stiction.fleet import Audit, LoopRow, append_label, work_list
from stiction.fleet.rank import rank_row
from stiction.fleet.work_list_file import write_work_list_file
from stiction.report.work_list_page import write_work_list_page

DONE = {"status": "diagnosed", "loop_state": "in_control"}
ROWS = [
    LoopRow("PIC-1", "A", "Valve stiction", "Ramp OP.", finding="sticks", S=4.1, action="Check packing.", priority=3.0,
            priority_reason="It costs.", verdict="stiction", **DONE),
    LoopRow("FIC-2", "A", "Oscillates with PIC-1", "Look again after PIC-1 was put right.", finding="follows",
            follows="PIC-1", **DONE),
    LoopRow("TIC-3", "B", "Controller tuning", "Halve the gain.", finding="tuning", action="Lower the gain.", **DONE),
    LoopRow("LIC-4", "B", "Cannot tell", "Step OP.", finding="cannot_tell", **DONE),
    LoopRow("LIC-5", "B", "Cannot tell", "Put the controller in manual.", finding="cannot_tell", oscillating=True,
            test_time_s=900.0, **DONE),
    LoopRow("FIC-6", "B", "PV is frozen", "Check the transmitter.", finding="sensor", status="skipped",
            loop_state="pv_frozen"),
    LoopRow("FIC-7", "B", "No valve stiction found", "Nothing to do now.", finding="nothing_found", **DONE),
    LoopRow("FIC-8", "B", status="error", reason="The file is damaged."),
]  # fmt: skip


def audit_of(folder, rows=ROWS, history=None) -> Audit:
    class Told(Audit):
        def history(self, tag):
            return (history or {}).get(tag, [])

    run = {"started": "2026-04-02T06:00:00+00:00", "finished": None, "since": None, "until": None}
    return Told(folder, list(rows), [], {"sources": ["plant"]}, run)


def test_each_loop_goes_to_its_crew_and_followers_wait(tmp_path):
    items = work_list(audit_of(tmp_path))
    assert [(one.kind, one.tag) for one in items] == [
        ("repair", "PIC-1"), ("retune", "TIC-3"), ("test", "LIC-5"), ("instrument", "FIC-6"), ("instrument", "FIC-8"),
    ]  # fmt: skip
    first = items[0]
    assert (first.follow, first.S, first.task, first.check) == (("FIC-2",), "4.1 %", "Check packing.", "Ramp OP.")
    assert {one.state for one in items} == {"open"}
    assert items[-1].task == "The file is damaged."
    assert [one.test.replace("\u00a0", " ") for one in items] == ["", "", "15 min in manual", "", ""]


def test_one_rule_says_which_open_question_can_wait(tmp_path):
    """The loop of which the work list asks no test has no place in the table of the audit either."""
    quiet = rank_row(replace(ROWS[3], severity=0.5, confidence=0.5))
    assert (quiet.waits, quiet.priority, quiet.test) == (True, 0.0, "")
    swings = rank_row(replace(ROWS[4], severity=0.5, probability=0.4))
    assert (swings.waits, swings.priority) == (False, pytest.approx(0.2))
    assert not {one.tag for one in work_list(audit_of(tmp_path, [quiet]))}


def test_notes_give_the_state(tmp_path):
    append_label(tmp_path, "PIC-1", "planned", "shutdown in May", "Ana")
    append_label(tmp_path, "TIC-3", "rejected", "gain is needed")
    states = {one.tag: (one.state, one.note) for one in work_list(audit_of(tmp_path))}
    assert states["PIC-1"][0] == "planned"
    assert states["PIC-1"][1].startswith("planned 20")
    assert states["PIC-1"][1].endswith(", Ana: shutdown in May")
    assert states["TIC-3"][0] == "rejected"
    append_label(tmp_path, "PIC-1", "acknowledged")
    assert work_list(audit_of(tmp_path))[0].state == "open"


@pytest.mark.parametrize(
    ("after", "result"),
    [
        ({"S": 1.2}, "S 4.1 % to 1.2 %."),
        ({"S": None, "verdict": "no_stiction", "S_detectable": 0.5}, "S 4.1 % to below 0.5 %."),
        ({"S": None, "verdict": "undecided", "S_detectable": None}, "S was 4.1 %; now: Cannot tell."),
    ],
)
def test_next_audit_says_what_the_repair_did(tmp_path, after, result):
    append_label(tmp_path, "PIC-1", "done")
    before = {"end": "2026-04-01T00:00:00+00:00", "S": 4.1, "finding_text": "Valve stiction", "verdict": "stiction"}
    later = {"end": "2099-04-09T00:00:00+00:00", "finding_text": "Cannot tell", "verdict": "stiction"} | after
    repaired = [replace(ROWS[0], finding="nothing_found", finding_text="No valve stiction found"), *ROWS[1:]]
    [item] = [one for one in work_list(audit_of(tmp_path, repaired, {"PIC-1": [before, later]})) if one.tag == "PIC-1"]
    assert (item.state, item.result.replace("\u00a0", " ")) == ("done", result)
    [item] = [one for one in work_list(audit_of(tmp_path, ROWS, {"PIC-1": [before]})) if one.tag == "PIC-1"]
    assert item.result == "The records of this audit are from before it."
    assert item.state_text.startswith("done 20")


def test_list_is_written_as_page_and_file(tmp_path):
    follower = replace(ROWS[1], follows="=1+1")
    audit = audit_of(tmp_path, [replace(ROWS[0], tag="=1+1", area="<b>"), follower, *ROWS[2:]])
    items = work_list(audit)
    sheet = openpyxl.load_workbook(write_work_list_file(items, tmp_path / "list" / "worklist.xlsx")).active
    assert [cell.value for cell in sheet[1]][:4] == ["Work", "Area", "Loop", "Finding"]
    assert {row[2].value for row in sheet.iter_rows(min_row=2)} == {one.tag for one in items}
    assert sheet["C2"].data_type == "s"
    assert (sheet.page_setup.orientation, sheet.page_setup.fitToHeight) == ("landscape", 0)
    page = write_work_list_page(audit, items, {"=1+1": "orders/1.html"}, tmp_path / "list" / "index.html").read_text()
    for item in items:
        assert item.task in page
    assert "&lt;b&gt;" in page
    assert "<b>=1+1</b>" in page
    assert 'href="orders/1.html"' in page
    assert "FIC-2" in page  # to look at again after the repair
    assert "1 loop oscillates with another and needs no work before that one is put right." in page

"""The blocks of a loop's page hold the numbers of the diagnosis; a terminal prints the same blocks."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from datetime import UTC, datetime

import pytest

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.apps.print_blocks import print_blocks
from stiction.diagnosis.identification.result import ControllerFit, ProcessFit
from stiction.diagnosis.loop_state import LoopState, StateStretch
from stiction.diagnosis.verdict.features import FEATURES
from stiction.diagnosis.verdict.model import log_odds
from stiction.report import labels
from stiction.report.blocks import Collapsible, Definitions, Figure, SideBySide, Table, Text
from stiction.report.identification_text import describe_controller, describe_identification
from stiction.report.pages.loop import loop_blocks, loop_headline, loop_sections
from stiction.report.pages.overview import overview

TRENDS, REASONS, VALVE, OSCILLATION = "Trends", "Why this verdict", "Valve and process", "Oscillation"
METHODS, DATA, ORIGIN = "Published methods", "Data quality", "Origin"
SECTIONS = [TRENDS, REASONS, VALVE, OSCILLATION, METHODS, DATA, ORIGIN]


@pytest.fixture(scope="module")
def judged():
    return st.diagnose(record())


def figures_in(blocks):
    for block in blocks:
        if isinstance(block, SideBySide | Collapsible):
            yield from figures_in(block.blocks)
        elif isinstance(block, Figure):
            yield block


def table_of(diagnosis, section, title):
    [table] = [one.table for one in figures_in(loop_sections(diagnosis)[section]) if one.title == title]
    return table


def plain(text):
    return text.replace("\u00a0", " ")


def test_a_judged_loop_has_every_section_in_order(judged):
    assert list(loop_sections(judged)) == SECTIONS
    headline = loop_headline(judged)
    assert headline.line == labels.headline(judged)
    assert headline.reason == judged.reason
    assert headline.action == f"{judged.action} Next step: {judged.next_step}"
    assert ("Plan of the test", judged.valve_test.command) in headline.facts


def test_a_loop_that_follows_another_gets_no_action(judged):
    step = "Look again after PIC-1 was put right."
    told = replace(judged, settings={"follows": "Oscillates with PIC-1", "next_step": step})
    headline = loop_headline(told)
    assert (headline.line, headline.action, headline.mark) == ("Oscillates with PIC-1", step, "good")


def test_the_contributions_add_up_to_the_probability(judged):
    table = table_of(judged, REASONS, "What each feature contributes")
    assert len(table.rows) == len(FEATURES) + 1
    assert table.rows[-1][0] == "average of all loops"
    total = log_odds(judged.prior) + sum(float(row[3]) for row in table.rows)
    assert total == pytest.approx(log_odds(judged.probability), abs=0.005 * (len(FEATURES) + 1) + 1e-9)
    data = judged.to_dict()
    total = log_odds(data["prior"]) + data["average_log_odds"] + sum(one["log_odds"] for one in data["features"])
    assert total == pytest.approx(log_odds(judged.probability), abs=0.001)


def test_the_alternatives_are_those_of_the_identification(judged):
    title = "Sticky valve against other explanations"
    table, ratios = table_of(judged, REASONS, title), judged.identification.likelihood_ratios
    assert table.columns[1] == "2 ln(likelihood ratio) [-]"
    assert sorted(row[1] for row in table.rows) == sorted(map(labels.format_number, ratios.values()))
    assert table.rows[0][1] == labels.format_number(judged.strongest_alternative[1])
    assert [row[0] for row in table_of(diagnosis(), REASONS, title).rows] == [
        "periodic load", "switching load", "good valve", "apart: sticky valve without slip jump",
    ]  # fmt: skip


def test_a_loop_that_is_not_in_control_has_its_state_and_no_causes():
    state = LoopState("pv_frozen", 60.0, 600.0, 0.9, {"pv": 148.7, "op_start": 50.0, "op_end": 85.0})
    frozen = diagnosis(verdict="undecided", found=False, loop_state=state, evidence=())
    sections = loop_sections(frozen)
    assert sections[TRENDS][0].text.startswith("PV is frozen: it stays at 148.7")
    assert "Causes of the oscillation" not in [one.title for one in figures_in(sections[OSCILLATION])]
    assert loop_headline(frozen).line.startswith("PV is frozen")


def test_stretches_in_another_state_are_listed():
    stretch = StateStretch("manual", 0, 240, 0.0, 240.0)
    state = LoopState("in_control", 0.0, 2000.0, 0.88, stretches=(stretch,))
    first = loop_sections(diagnosis(loop_state=state))[TRENDS][0]
    assert first == Text("The controller is in manual from 0\u00a0s to 4\u00a0min.")


def test_causes_have_a_row_each(judged):
    rows = table_of(judged, OSCILLATION, "Causes of the oscillation").rows
    assert [row[0] for row in rows] == [labels.CAUSES[name] for name in judged.oscillation_cause.to_dict()]
    assert [float(row[1]) for row in rows] == pytest.approx(
        list(judged.oscillation_cause.to_dict().values()), abs=0.005
    )


def test_a_terminal_prints_the_texts_and_numbers_of_the_page(judged, capsys):
    print_blocks(loop_blocks(judged))
    out = capsys.readouterr().out
    assert out.startswith(f"{judged.record.tag}: {plain(labels.headline(judged))}.")
    assert re.findall(r"\n\n([A-Z][A-Za-z ]+)\n", out)[0] == REASONS  # the trends are a plot alone
    for section in SECTIONS[1:]:
        assert f"\n{section}\n" in out
    for block in loop_sections(judged)[DATA]:
        for row in block.rows if isinstance(block, Table) else ():
            assert row[0] in out
            assert plain(row[-1]) in out
    for one in judged.contributions:
        assert f"{one.log_odds:+.2f}" in out


def test_one_loop_and_a_table_of_loops_have_the_same_numbers(judged, capsys):
    print_blocks([overview([judged, judged])])
    out = capsys.readouterr().out
    assert "Trend of PV" not in out
    assert plain(labels.S_text(judged)) in out
    assert labels.S_text(judged).split(" ")[0] in loop_headline(judged).line
    assert labels.format_probability(judged.probability) in out


def test_counts_of_one_are_singular_and_times_have_their_zone():
    run = record()
    started = replace(run, start=datetime(2026, 11, 28, 9, 9, 28, tzinfo=UTC))
    [origin] = loop_sections(diagnosis(run=replace(started, provenance=replace(run.provenance, rows=1))))[ORIGIN]
    assert isinstance(origin, Definitions)
    values = dict(origin.given)
    assert values["Start"] == ["2026-11-28 09:09:28 UTC"]
    assert values["Rows"][0].startswith("1 row read")
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d(:\d\d)? \S+", values["Written"][0])


def test_both_processes_are_described():
    valve = identification(record())
    lines = dict(describe_identification(replace(valve, linear=ProcessFit(1.2, 5.0, 2.0, True)), "%"))
    sticky = "gain 3 PV units per %, time constant 10 s, dead time 10 s."
    assert lines["Process with the sticky valve"].replace("\u00a0", " ") == sticky
    good = "integrating process, gain 1.2 PV units per % and second, dead time 2 s."
    assert lines["Process with a good valve"].replace("\u00a0", " ") == good


@pytest.mark.parametrize(("drift", "error", "shown"), [(math.nan, math.nan, False), (-0.31, 0.12, True)])
def test_a_drift_is_described_where_it_was_estimated(drift, error, shown):
    lines = dict(describe_identification(identification(record(), drift=drift, drift_error=error), "%"))
    assert lines.get("Drift of S") == ("S changes by -0.31 % per hour (standard error 0.12)." if shown else None)


@pytest.mark.parametrize(("low", "high", "limits"), [(0.7, 1.4, None), (0.0, 3.3, "J cannot be determined")])
def test_limits_of_the_estimate_are_described(low, high, limits):
    valve = identification(record(), J_low=low, J_high=high)
    found = dict(describe_identification(valve, "%")).get("Limits")
    assert (found is None) if limits is None else found.startswith(limits)


def test_a_controller_is_described_with_its_settings():
    fit = ControllerFit(0.2, 10.0, 0.97, 1.0, "PI", Kc_error=0.01, Ti_error=0.5)
    text = describe_controller(fit, "%").replace("\u00a0", " ")
    assert text == "PI with Kc 0.2 ± 0.01 % per PV unit, Ti 10 ± 0.5 s: explains 97 % of OP."
    integral = describe_controller(ControllerFit(0.0, 0.0, 1.0, 1.0, "I", Ki=0.02, exact=True), "%")
    assert "I with Ki 0.02 % per PV unit and s" in integral
    assert "every move of the controller" in integral
    assert describe_controller(ControllerFit(math.nan, math.nan, 0.0, 0.0, why="OP rests."), "%").endswith("OP rests.")

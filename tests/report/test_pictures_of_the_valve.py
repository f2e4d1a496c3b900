"""What the figures of valve and process claim: whose valve is drawn, over which part of the record, and how sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stiction.diagnosis.identified import J_ROUGH, J_UNKNOWN

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.result import Window
from stiction.report import figures
from stiction.report.last_periods import last_periods
from stiction.report.loop_view import LoopView


def figure_of(make, found):
    figure = make(LoopView(found))
    assert figure is not None
    return figure


def named(figure):
    """Traces by name."""
    return {trace.get("name", trace["type"]): trace for trace in figure.plot["data"]}


def by_likelihood(**more):
    """A valve whose S and J come from the likelihood, the dense search beside it."""
    rough = identification(record())
    return replace(rough, rough=rough, **more)


@pytest.fixture(scope="module")
def told():
    """A verdict on a sticky loop whose record is longer than a piece that is searched by itself."""
    return st.diagnose(record(2300))


@pytest.fixture(scope="module")
def good():
    """A verdict on a loop with a good valve that follows a wandering set point."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Ideal(), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 0.4, 1500))
    found = st.diagnose(st.simulate(loop, sp=150.0 + walk, duration=1500.0, seed=3, op_start=50.0, pv_start=150.0))
    assert (found.verdict, found.cause) == ("no_stiction", "none")
    return found


def test_s_and_j_told_are_a_cross_of_their_intervals_and_the_map_has_no_region():
    figure = figure_of(figures.error_surface, diagnosis(identification=by_likelihood()))
    traces = named(figure)
    assert traces["95 % interval of S"]["x"] == [pytest.approx(2.7), pytest.approx(3.3)]
    assert traces["95 % interval of J"]["y"] == pytest.approx([0.7 / 3.0, 1.4 / 3.0])
    assert {traces[f"95 % interval of {name}"]["line"]["dash"] for name in "SJ"} == {"solid"}
    assert (traces["told"]["x"], traces["told"]["y"]) == ([3.0], [pytest.approx(1.0 / 3.0)])
    assert not [trace for trace in traces.values() if trace["type"] == "contour" or "region" in trace.get("name", "")]
    assert "S\u00a0=\u00a03.0\u00a0% of span (95\u00a0%: 2.7 to 3.3)" in figure.caption


def test_a_jump_that_is_open_is_a_dashed_bar_without_a_number():
    figure = figure_of(figures.error_surface, diagnosis(identification=by_likelihood(J_low=0.0, J_high=3.3)))
    traces = named(figure)
    assert traces["95 % interval of J"]["line"]["dash"] == "dash"
    assert "told, J open" in traces
    assert "J\u00a0open (0.0 to 3.3\u00a0%)" in figure.caption
    assert figure.plot["layout"]["yaxis"]["range"][1] >= 1.1


def test_the_map_says_where_s_and_j_come_from(told):
    by = {
        "from this search": identification(record()),
        "from the likelihood of the PV": by_likelihood(),
    }
    for said, valve in by.items():
        assert f"Both come {said}" in figure_of(figures.error_surface, diagnosis(identification=valve)).caption
    assert "Both come from the likelihood of the PV" in figure_of(figures.error_surface, told).caption
    assert "load" not in figure_of(figures.error_surface, told).caption
    by_position = st.diagnose(record(measured=True))
    assert "from the recorded valve position" in figure_of(figures.error_surface, by_position).caption


def test_a_good_valve_is_shown_in_place_of_a_sticky_one_that_was_not_believed(good):
    # The process that made the record, behind its OP: 3 PV units per %, a lag of 10 s, 10 s late.
    behind, late = np.zeros(1500), np.concatenate([np.full(10, good.record.op[0]), good.record.op[:-10]])
    for k in range(1, 1500):
        behind[k] = behind[k - 1] + (3.0 * (late[k - 1] - late[0]) - behind[k - 1]) * (1.0 - np.exp(-0.1))
    seen = slice(100, 1400)
    assert np.corrcoef(LoopView(good).model[seen], behind[seen])[0, 1] > 0.999
    assert np.array_equal(LoopView(good).model, good.identification.pv_linear, equal_nan=True)
    assert not np.array_equal(LoopView(good).model[seen], good.identification.pv[seen])
    fit = figure_of(figures.model_fit, good)
    assert "PV simulated from OP with the good valve" in named(fit)
    assert "a good valve and its best process explain" in fit.caption
    assert "was not believed" in fit.caption
    assert "good valve" in named(figure_of(figures.pv_op, good))
    surface = figure_of(figures.error_surface, good)
    assert surface.title.endswith("none believed")
    assert "it was not believed" in surface.caption
    assert "told" not in surface.caption
    assert "was believed" in figure_of(figures.dead_time, good).caption


def test_without_the_good_valves_pv_the_sticky_one_is_named_for_what_it_is():
    found = replace(diagnosis(), verdict="no_stiction", cause="none")
    fit = figure_of(figures.model_fit, found)
    assert "PV simulated from OP with the likeliest sticky valve" in named(fit)
    assert "which was not believed" in fit.caption


def test_play_is_believed_where_nothing_sticks():
    found = replace(diagnosis(), verdict="no_stiction", cause="deadband")
    for make in (figures.model_fit, figures.error_surface, figures.dead_time, figures.valve_position):
        assert "believed" not in figure_of(make, found).caption
    assert "the valve with play and process explain" in figure_of(figures.model_fit, found).caption


def quiet_from(n, at):
    """A record whose OP hardly moves from sample `at` on, and the valve over it."""
    run, k = record(n), np.arange(n)
    quiet = replace(run, op=np.where(k < at, run.op, run.op[at] + 0.5 * np.sin(k / 20.0)))
    return quiet, identification(quiet)


def test_the_latest_periods_that_slip_are_shown_where_the_last_do_not():
    run, valve = quiet_from(3000, 1200)
    found = diagnosis(run=run, identification=valve, oscillation=find_oscillation(record()))
    cut = last_periods(LoopView(found)).cut
    slips = np.flatnonzero(np.abs(np.diff(valve.mv)) > 0.9)
    assert ((slips > cut.start) & (slips < cut.stop)).sum() > 4
    assert slips[-1] < cut.stop < 1400
    figure = figure_of(figures.valve_position, found)
    assert "that show S in the estimated valve position" in figure.caption
    assert figure.plot["layout"]["shapes"]
    assert "that show S" in figure_of(figures.pv_op, found).caption
    usual = last_periods(LoopView(diagnosis()))
    assert usual.cut.stop == 2000
    assert usual.said.startswith("The last ")


def test_a_position_that_never_slips_has_no_dimensions():
    valve = identification(record())
    still = replace(valve, mv=np.full_like(valve.mv, 50.0))
    figure = figure_of(figures.valve_position, diagnosis(identification=still))
    assert not figure.plot["layout"]["shapes"]
    assert not figure.plot["layout"]["annotations"]
    assert "jump" not in figure.caption
    assert "nowhere in it" in figure.caption
    # One that moves, but after no travel of OP that could be S, shows none either.
    creeps = replace(valve, mv=50.0 + 1e-3 * np.repeat(np.arange(1000.0), 2))
    figure = figure_of(figures.valve_position, diagnosis(identification=creeps))
    assert not figure.plot["layout"]["shapes"]


@pytest.mark.parametrize(
    ("low", "high", "sentence", "said"),
    [
        (0.0, 3.3, J_UNKNOWN, "whether it then jumps is open (by 0.0 to 3.3\u00a0%)"),
        (0.6, 3.3, J_ROUGH, "then it jumps, how far is open (by 0.6 to 3.3\u00a0%)"),
        (0.7, 1.4, "", "then the valve jumps J = 1.0\u00a0%"),
    ],
)
def test_an_open_jump_is_no_dimension(low, high, sentence, said):
    valve = replace(identification(record()), J_low=low, J_high=high)
    assert valve.J_told == sentence
    figure = figure_of(figures.valve_position, diagnosis(identification=valve))
    assert said in figure.caption
    texts = [note["text"] for note in figure.plot["layout"]["annotations"]]
    assert texts == (["S = 3.0 %"] if sentence else ["S = 3.0 %", "J = 1.0 %"])


def windows(*verdicts, width=500):
    return tuple(Window(k * width, (k + 1) * width, one, 3.0, 1.0, 93.0, 41.0) for k, one in enumerate(verdicts))


def test_the_last_window_that_sticks_is_shown():
    parts = windows("stiction", "stiction", "no_stiction", "undecided")
    found = diagnosis(windows=parts)
    cut = last_periods(LoopView(found)).cut
    assert 500 <= cut.start < cut.stop == 1000
    for make in (figures.pv_op, figures.valve_position):
        assert "of the last window in which the valve sticks, " in figure_of(make, found).caption
    for all_alike in (windows(*["stiction"] * 4), windows(*["undecided"] * 4), ()):
        assert last_periods(LoopView(diagnosis(windows=all_alike))).cut.stop == 2000


def test_what_is_shown_of_a_window_was_simulated():
    valve = identification(record())
    pv = valve.pv.copy()
    pv[900:1600] = np.nan
    found = diagnosis(windows=windows("stiction", "stiction", "no_stiction"), identification=replace(valve, pv=pv))
    assert last_periods(LoopView(found)).cut.stop == 900
    assert "as far as it was simulated" not in figure_of(figures.pv_op, found).caption


def test_the_part_that_was_simulated_is_told(told):
    seen = np.flatnonzero(np.isfinite(told.identification.pv))
    assert seen[-1] < 0.9 * len(told.record)
    fit = figure_of(figures.model_fit, told)
    assert f"The simulation covers samples {seen[0]} to {seen[-1]} (" in fit.caption
    assert "12 periods long at most" in fit.caption
    assert "simulated over the part that Model over data tells" in figure_of(figures.trends, told).caption


def test_a_simulation_in_pieces_is_told_as_such():
    valve = by_likelihood()
    pv = valve.pv.copy()
    pv[:20] = pv[700:1200] = pv[1980:] = np.nan
    fit = figure_of(figures.model_fit, diagnosis(identification=replace(valve, pv=pv)))
    assert "The simulation covers 2 pieces of samples 20 to 1979 (" in fit.caption
    assert "73\u00a0% of the analysed stretch" in fit.caption
    whole = figure_of(figures.model_fit, diagnosis())
    assert "covers" not in whole.caption
    assert "likelihood that tells" not in whole.caption
    ends = valve.pv.copy()
    ends[:10] = ends[-10:] = np.nan
    found = diagnosis(identification=replace(valve, pv=ends))
    assert "half a period at either end" in figure_of(figures.model_fit, found).caption
    assert "12 periods" not in figure_of(figures.model_fit, found).caption
    assert "the whole record was analysed." in figure_of(figures.trends, found).caption.replace("; ", ". ")


def test_of_a_long_record_it_is_told_that_s_comes_from_its_middle():
    run = record(6000)
    rough = identification(run)
    found = diagnosis(run=run, identification=replace(rough, rough=rough))
    assert "at most 4000 samples from the middle" in figure_of(figures.model_fit, found).caption
    assert "from the middle" not in figure_of(figures.model_fit, diagnosis(run=run, identification=rough)).caption


def test_a_regularity_at_the_end_of_its_scale_is_not_shown_as_measured():
    found = diagnosis()
    for regularity, said in ((10.0, "regularity 10 or more ("), (3.2, "regularity 3.2 (")):
        oscillation = replace(found.oscillation, regularity=regularity)
        assert said in figure_of(figures.autocorrelation, replace(found, oscillation=oscillation)).caption

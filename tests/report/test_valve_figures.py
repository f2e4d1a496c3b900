"""What the figures of valve and process show: which valve is drawn, over which part of the record, and how sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from report.diagnoses import CONTRIBUTIONS, diagnosis, identification, record, segments
from stiction.diagnosis.oscillation import find_oscillation
from stiction.diagnosis.verdict.causes import CAUSES, OscillationCause
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


@pytest.fixture(scope="module")
def good():
    """A verdict on a loop with a good valve that follows a wandering set point."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Ideal(), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 0.4, 1500))
    found = st.diagnose(st.simulate(loop, sp=150.0 + walk, duration=1500.0, seed=3, op_start=50.0, pv_start=150.0))
    assert found.identification is not None
    return replace(found, verdict="no_stiction")


def test_s_and_j_are_a_cross_of_their_intervals_on_the_map():
    figure = figure_of(figures.likelihood_surface, diagnosis())
    traces = named(figure)
    assert traces["95 % interval of S"]["x"] == [pytest.approx(2.7), pytest.approx(3.3)]
    assert traces["95 % interval of J"]["y"] == pytest.approx([0.7 / 3.0, 1.4 / 3.0])
    assert {traces[f"95 % interval of {name}"]["line"]["dash"] for name in "SJ"} == {"solid"}
    assert (traces["estimate"]["x"], traces["estimate"]["y"]) == ([3.0], [pytest.approx(1.0 / 3.0)])
    assert "S\u00a0=\u00a03.0\u00a0% of span (95\u00a0%: 2.7 to 3.3)" in figure.caption


def test_the_map_shows_ratios_better_than_a_good_valve_and_their_maximum():
    figure = figure_of(figures.likelihood_surface, diagnosis())
    surface, traces = diagnosis().identification.surface, named(figure)
    heat, best = traces["heatmap"], traces["maximum of the map"]
    assert np.array_equal(heat["z"], surface.likelihood_ratio.T)
    assert (heat["zmin"], heat["zmax"]) == (0.0, surface.likelihood_ratio.max())
    i, j = np.argwhere(surface.likelihood_ratio == surface.likelihood_ratio.max())[0]
    assert (best["x"], best["y"]) == ([surface.S[i]], [surface.ratio[j]])


def test_an_undetermined_jump_is_a_dashed_bar_without_a_number():
    figure = figure_of(
        figures.likelihood_surface, diagnosis(identification=identification(record(), J_low=0.0, J_high=3.3))
    )
    traces = named(figure)
    assert traces["95 % interval of J"]["line"]["dash"] == "dash"
    assert "estimate, J undetermined" in traces
    assert "J\u00a0unknown (0.0 to 3.3\u00a0%)" in figure.caption
    assert figure.plot["layout"]["yaxis"]["range"][1] >= 1.1


@pytest.mark.parametrize("by_position", [False, True])
def test_the_map_says_where_s_and_j_come_from(by_position):
    valve = identification(record(), by_position=by_position)
    caption = figure_of(figures.likelihood_surface, diagnosis(identification=valve)).caption
    assert ("by the recorded valve position" in caption) is by_position


def test_a_good_valve_is_drawn_where_the_verdict_rejects_the_sticky_one(good):
    # The process that made the record, driven by its OP: 3 PV units per %, a lag of 10 s, a dead time of 10 s.
    process, late = np.zeros(1500), np.concatenate([np.full(10, good.record.op[0]), good.record.op[:-10]])
    for k in range(1, 1500):
        process[k] = process[k - 1] + (3.0 * (late[k - 1] - late[0]) - process[k - 1]) * (1.0 - np.exp(-0.1))
    view = LoopView(good)
    compared = np.flatnonzero(np.isfinite(view.model))
    assert compared.size > 1000
    assert np.corrcoef(view.model[compared], process[compared])[0, 1] > 0.99
    assert np.array_equal(view.model, good.identification.pv_linear, equal_nan=True)
    fit = figure_of(figures.model_fit, good)
    assert "PV simulated from OP with the good valve" in named(fit)
    assert "The good valve is drawn." in fit.caption
    assert "good valve" in named(figure_of(figures.pv_op, good))
    assert figure_of(figures.likelihood_surface, good).caption.endswith("The verdict does not rely on it.")


def test_features_that_contribute_have_bars_with_their_log_odds():
    figure = figure_of(figures.contributions, diagnosis())
    [bars] = figure.plot["data"]
    assert bars["x"].tolist() == [2.4, -1.2]
    assert bars["text"] == ["+2.40", "-1.20"]
    assert bars["y"][0].replace("<br>", " ") == "sticky valve against the closest other explanation"
    assert len(set(bars["marker"]["pattern"]["shape"])) == 2
    assert "1 feature without a contribution" in figure.caption
    assert "prior of 0.25" in figure.caption
    assert "stiction of 0.94" in figure.caption
    assert figures.contributions(LoopView(diagnosis(contributions=CONTRIBUTIONS[2:]))) is None
    assert figures.contributions(LoopView(diagnosis(found=False))) is None


def test_the_strongest_alternative_is_the_first_bar():
    [bars] = figure_of(figures.likelihood_ratios, diagnosis()).plot["data"]
    assert bars["y"][:2] == ["periodic load", "switching load"]
    assert bars["text"] == ["-7", "45", "310", "12.5"]
    assert bars["x"] == pytest.approx(np.arcsinh(np.array([-7.0, 45.0, 310.0, 12.5]) / 20.0))
    missing = identification(record(), likelihood_ratios={"good": float("nan")})
    assert figures.likelihood_ratios(LoopView(diagnosis(identification=missing))) is None


def test_every_alternative_of_a_diagnosis_has_a_name(good):
    [bars] = figure_of(figures.likelihood_ratios, good).plot["data"]
    assert len(bars["y"]) == len(good.identification.likelihood_ratios)
    assert not [name for name in bars["y"] if "_" in name]


def test_five_causes_have_their_scores():
    causes = OscillationCause(valve=0.9, tuning=0.62, external=0.2, sensor=0.1)
    figure = figure_of(figures.oscillation_causes, diagnosis(oscillation_cause=causes))
    [bars] = figure.plot["data"]
    assert bars["x"].tolist() == [getattr(causes, name) for name in CAUSES]
    assert "the main cause is valve stiction" in figure.caption
    quiet = diagnosis(oscillation_cause=OscillationCause(tuning=0.1))
    assert "no cause reaches 0.6" in figure_of(figures.oscillation_causes, quiet).caption


def test_parts_of_the_record_are_bars_at_their_times():
    run = record(3000)
    auto = np.arange(3000) >= 1000
    valve = identification(run.window(1000, 3000), segments=segments(2000, 50.0, 3.0), drift=-0.31, drift_error=0.12)
    view = LoopView(diagnosis(run=replace(run, auto=auto), identification=valve))
    figure = figures.segments(view)
    traces = named(figure)
    assert traces["sticky valve more likely"]["x"] == pytest.approx([1500.0 / view.unit[1]])
    assert traces["not clearly more likely"]["x"] == pytest.approx([2500.0 / view.unit[1]])
    assert figure.caption.startswith("In 1 of 2 parts")
    assert figure.caption.endswith("S changes by -0.31 % per hour (standard error 0.12).")
    alone = identification(run, segments=segments(3000, 50.0))
    assert figures.segments(LoopView(diagnosis(run=run, identification=alone))) is None


def quiet_from(n, at):
    """A record whose OP hardly moves from sample `at` on, and its valve."""
    run, k = record(n), np.arange(n)
    quiet = replace(run, op=np.where(k < at, run.op, run.op[at] + 0.5 * np.sin(k / 20.0)))
    return quiet, identification(quiet, segments=())


def test_the_latest_periods_that_slip_are_shown_where_the_last_do_not():
    run, valve = quiet_from(3000, 1200)
    found = diagnosis(run=run, identification=valve, oscillation=find_oscillation(record()))
    cut = last_periods(LoopView(found)).cut
    slips = np.flatnonzero(np.abs(np.diff(valve.mv)) > 0.9)
    assert ((slips > cut.start) & (slips < cut.stop)).sum() > 4
    assert slips[-1] < cut.stop < 1400
    figure = figure_of(figures.valve_position, found)
    assert "in which the valve sticks and slips" in figure.caption
    assert figure.plot["layout"]["shapes"]
    assert "sticks and slips" in figure_of(figures.pv_op, found).caption
    usual = last_periods(LoopView(diagnosis()))
    assert usual.cut.stop == 2000
    assert usual.text.startswith("The last ")


def test_a_position_that_never_slips_has_no_dimensions():
    valve = identification(record())
    still = replace(valve, mv=np.full_like(valve.mv, 50.0))
    figure = figure_of(figures.valve_position, diagnosis(identification=still))
    assert not figure.plot["layout"]["shapes"]
    assert not figure.plot["layout"]["annotations"]
    assert "jump" not in figure.caption
    assert "does not rest over S" in figure.caption
    # A position that moves without a travel of OP of about S has none either.
    creeps = replace(valve, mv=50.0 + 1e-3 * np.repeat(np.arange(1000.0), 2))
    figure = figure_of(figures.valve_position, diagnosis(identification=creeps))
    assert not figure.plot["layout"]["shapes"]


@pytest.mark.parametrize(
    ("low", "high", "undetermined", "text"),
    [
        (0.0, 3.3, True, "whether it then jumps is unknown (0.0 to 3.3\u00a0%)"),
        (0.6, 3.3, True, "then it jumps by an uncertain J (0.6 to 3.3\u00a0%)"),
        (0.7, 1.4, False, "then the valve jumps by J = 1.0\u00a0%"),
    ],
)
def test_an_undetermined_jump_is_no_dimension(low, high, undetermined, text):
    valve = replace(identification(record()), J_low=low, J_high=high)
    assert valve.J_undetermined is undetermined
    figure = figure_of(figures.valve_position, diagnosis(identification=valve))
    assert text in figure.caption
    texts = [note["text"] for note in figure.plot["layout"]["annotations"]]
    assert texts == (["S = 3.0 %"] if undetermined else ["S = 3.0 %", "J = 1.0 %"])


@pytest.mark.parametrize(
    ("ratios", "start", "stop"), [((90, 80, 2, 3), 500, 1000), ((90,) * 4, 0, 2000), ((1,) * 4, 0, 2000)]
)
def test_the_last_part_that_sticks_is_plotted(ratios, start, stop):
    found = diagnosis(identification=identification(record(), segments=segments(2000, *ratios)))
    plotted = last_periods(LoopView(found))
    assert start <= plotted.cut.start < plotted.cut.stop == stop
    for make in (figures.pv_op, figures.valve_position):
        caption = figure_of(make, found).caption
        assert ("of the last part of the record in which the valve sticks" in caption) is (stop == 1000)


def test_a_regularity_at_its_upper_limit_is_shown_as_a_limit():
    found = diagnosis()
    for regularity, text in ((10.0, "regularity 10 or more ("), (3.2, "regularity 3.2 (")):
        oscillation = replace(found.oscillation, regularity=regularity)
        assert text in figure_of(figures.autocorrelation, diagnosis(oscillation=oscillation)).caption

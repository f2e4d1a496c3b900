"""The loop report: its order, its words, and records that lack something."""

from __future__ import annotations

import json
import math
import re
import time
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.diagnosis.loop_state import LoopState, StateStretch
from stiction.diagnosis.verdict.causes import OscillationCause
from stiction.errors import ParameterError
from stiction.records.record import Provenance
from stiction.report import figures, labels, write_report
from stiction.report.loop_view import LoopView
from stiction.report.pages.overview import sort_worst_first

SECTIONS = ["Trends", "Valve and process", "Oscillation", "Published methods", "Data quality", "Origin"]
JUDGED = [SECTIONS[0], "Why this verdict", *SECTIONS[1:]]
"""Sections of a loop whose valve was judged."""


def without_code(text):
    """The page without its style, its script and the plot library."""
    return re.sub(r"<(script|style)(?: type=.text/plain. id=.plot-library.)?>.*?</\1>", "", text, flags=re.DOTALL)


class Page(HTMLParser):
    """Headings, figures with labels and captions, links, anchors and text of a page."""

    def __init__(self, path):
        super().__init__()
        self.headings, self.labels, self.captions, self.links, self.ids, self.text = [], [], [], [], [], []
        self.plots, self._at = [], ""
        self.feed(without_code(path.read_text(encoding="utf-8")))

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self._at = "json" if named.get("type") == "application/json" else tag
        if named.get("class") == "plot":
            self.labels.append(named["aria-label"])
        if tag == "a":
            self.links.append(named["href"])
        if "id" in named:
            self.ids.append(named["id"])

    def handle_data(self, data):
        if self._at == "h2":
            self.headings.append(data)
        elif self._at == "figcaption":
            self.captions.append(data)
        elif self._at == "json":
            self.plots.append(json.loads(data))
        self.text.append(data)
        self._at = ""


def written(tmp_path, *diagnoses, **settings):
    return Page(write_report(diagnoses, tmp_path / "report.html", **settings))


def test_sections_are_in_the_order_of_an_engineers_questions(tmp_path):
    page = written(tmp_path, diagnosis())
    assert page.headings == JUDGED
    text = " ".join(page.text)
    assert text.index("Valve stiction: S") < text.index("What to do") < text.index("Trends")


def test_every_figure_has_a_label_and_a_caption(tmp_path):
    page = written(tmp_path, diagnosis())
    assert len(page.labels) == len(page.captions) == len(page.plots) == 11
    for label, caption in zip(page.labels, page.captions, strict=True):
        assert label.endswith(caption)
        assert caption.endswith(".")


def test_headline_says_size_interval_and_confidence():
    found = diagnosis()
    assert (
        labels.headline(found).replace("\u00a0", " ")
        == "Valve stiction: S = 3.0 % of span (95 %: 2.7 to 3.3), J = 1.0 % (0.7 to 1.4)"
    )
    assert labels.confidence_text(found) == "High confidence (probability of stiction 0.94)"


def test_the_state_of_the_loop_comes_first_where_it_is_not_in_control(tmp_path):
    state = LoopState("pv_frozen", 0.0, 2000.0, 0.9, {"pv": 148.0})
    found = diagnosis(verdict="undecided", found=False, probability=0.25, loop_state=state, evidence=())
    assert labels.headline(found) == "PV is frozen: cannot tell whether the valve sticks"
    assert labels.confidence_text(found).startswith("No verdict on the valve: 0.25 is the share")
    page = written(tmp_path, found)
    text = " ".join(page.text)
    assert page.headings == SECTIONS
    assert text.index("PV is frozen") < text.index("Check the transmitter") < text.index("Trends")
    assert "The valve was not diagnosed." in text
    assert not any("Causes of the oscillation" in label for label in page.labels)
    assert "Cannot tell: PV is frozen" in " ".join(written(tmp_path, found, diagnosis()).text)


def test_a_small_valve_has_the_same_size_everywhere():
    small = {"S": 0.005668, "S_low": 0.004041, "S_high": 0.07918, "J": 0.002213, "J_low": 0.0, "J_high": 0.07905}
    found = diagnosis(200, identification=replace(identification(record(200)), **small))
    assert found.identification is not None
    size = "S = 0.0057 % of span (95 %: 0.0040 to 0.0792), J unknown (0.0000 to 0.0790 %)"
    assert labels.headline(found).replace("\u00a0", " ") == f"Valve stiction: {size}"
    plain = "S = 0.0057 % (95 % 0.0040 to 0.0792), J unknown (0.0000 to 0.0790 %); "
    assert found.identification.summary().startswith(plain)


@pytest.mark.parametrize(("p", "text"), [(0.9956, ">0.99"), (0.99, "0.99"), (0.9, "0.90")])
def test_no_verdict_is_shown_as_certain(tmp_path, p, text):
    found = diagnosis(200, probability=p)
    assert labels.confidence_text(found).endswith(f"(probability of stiction {text})")
    assert f"(probability {text})" in found.summary()
    assert text in " ".join(written(tmp_path, found, diagnosis(200)).text)


@pytest.mark.parametrize(
    ("verdict", "p", "word"),
    [
        ("stiction", 0.8, "Moderate"),
        ("stiction", 0.6, "Low"),
        ("no_stiction", 0.05, "High"),
        ("no_stiction", 0.4, "Low"),
        ("undecided", 0.5, "No verdict"),
    ],
)
def test_confidence_words(verdict, p, word):
    assert labels.confidence_text(diagnosis(200, verdict, found=False, probability=p)).startswith(word)


def test_a_sticky_valve_next_to_another_cause_has_both_in_the_table(tmp_path):
    causes = OscillationCause(valve=0.8, tuning=0.1, external=0.9)
    text = " ".join(written(tmp_path, diagnosis(oscillation_cause=causes), diagnosis()).text)
    table = " ".join(text.split()).partition("What to do FIC-101")[2].partition(" Loops FIC-101")[0]
    assert table.count("Check packing, actuator and positioner") == 2
    assert table.count("Look for loops and machines upstream") == 1


def test_text_from_files_is_escaped(tmp_path):
    evil = "</script><script>alert(1)</script><b>"
    origin = Provenance(evil, evil, {"op": evil}, (evil,), 5, 0, pv_unit=evil)
    evidence = tuple(replace(one, why=evil) for one in diagnosis().evidence)
    bad = diagnosis(run=replace(record(), tag=evil, provenance=origin), evidence=evidence)
    for some in ([bad], [bad, replace(bad, verdict="undecided")]):
        text = write_report(some, tmp_path / "r.html", title=evil, settings={evil: evil}).read_text(encoding="utf-8")
        assert "alert(1)</script>" not in text
        assert "&lt;script&gt;alert(1)" in text


def test_nothing_is_loaded_from_elsewhere(tmp_path):
    text = write_report([diagnosis()], tmp_path / "r.html").read_text(encoding="utf-8")
    own = without_code(text)
    assert "default-src 'none'" in own
    assert not re.search(r"""(?:src|href)=["'](?!#)""", own)
    assert "url(" not in own


def test_without_a_fit_the_page_says_so(tmp_path):
    page = written(tmp_path, diagnosis(found=False, verdict="undecided"))
    text = " ".join(page.text)
    assert "No valve was identified" in text
    assert "cannot tell whether the valve sticks" in text
    assert not any("estimated" in label for label in page.labels)
    assert page.headings == SECTIONS


def test_a_good_valve_shows_no_severity_bar(tmp_path):
    assert "severity" in write_report([diagnosis()], tmp_path / "a.html").read_text().split("<main>")[1]
    good = write_report([diagnosis(verdict="no_stiction")], tmp_path / "b.html").read_text().split("<main>")[1]
    assert 'class="severity"' not in good
    assert "Controller tuning; the valve does not stick" in good


def test_what_was_identified_is_on_the_page(tmp_path):
    record = st.simulate(
        st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1),
        70.0, 900.0, 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow",
    )  # fmt: skip
    found = st.diagnose(record)
    text = " ".join(written(tmp_path, found).text)
    for part in ("PI with Kc 0.4", "Process with a good valve", "average of all loops"):
        assert part in text
    rejected = "This is the best sticky-valve fit. The verdict does not rely on it."
    for verdict, shown in (("stiction", False), ("no_stiction", True)):
        assert (rejected in written(tmp_path, replace(found, verdict=verdict)).text) is shown


def test_measured_and_estimated_positions_have_different_lines():
    estimated = figures.valve_position(LoopView(diagnosis()))
    both = figures.valve_position(LoopView(diagnosis(run=record(measured=True))))
    assert estimated is not None
    assert both is not None
    assert [trace["name"] for trace in estimated.plot["data"]] == ["estimated"]
    assert "was not measured" in estimated.caption
    assert [trace["name"] for trace in both.plot["data"]] == ["measured", "estimated"]
    assert "was not measured" not in both.caption


def test_dimensions_are_as_long_as_s_and_j():
    figure = figures.valve_position(LoopView(diagnosis()))
    assert figure is not None
    across, down = figure.plot["layout"]["shapes"][0], figure.plot["layout"]["shapes"][3]
    assert abs(across["x1"] - across["x0"]) == pytest.approx(3.0)
    assert abs(down["y1"] - down["y0"]) == pytest.approx(1.0)
    op, mv = (np.asarray(figure.plot["data"][0][axis]) for axis in "xy")
    jumps = np.flatnonzero(np.abs(np.diff(mv)) > 0.9)
    assert np.abs(op[jumps + 1] - across["x1"]).min() < np.abs(np.diff(op)).max()


def test_spectrum_shows_amplitude_and_frequency_of_a_sine():
    n, period = 2000, 50.0
    k = np.arange(n)
    run = replace(record(n), pv=7.0 + 0.01 * k + 2.5 * np.sin(2.0 * np.pi * k / period), sp=None)
    figure = figures.spectrum(LoopView(diagnosis(run=run, found=False)))
    assert figure is not None
    x, y = (np.asarray(figure.plot["data"][0][axis]) for axis in "xy")
    assert y.max() == pytest.approx(2.5, rel=0.01)
    unit = {"Frequency [1/s]": 1.0, "Frequency [1/min]": 60.0}[figure.plot["layout"]["xaxis"]["title"]["text"]]
    assert x[y.argmax()] / unit == pytest.approx(1.0 / period, rel=1e-6)


def missing_values():
    run = record(3000)
    op, pv, auto = run.op.copy(), run.pv.copy(), np.ones(3000, dtype=bool)
    op[100:160] = pv[100:160] = pv[2000] = np.nan
    auto[2800:] = False
    return replace(run, op=op, pv=pv, auto=auto)


def test_left_out_stretches_are_hatched_and_the_analysed_part_is_shaded():
    run = missing_values()
    stretch = StateStretch("manual", 2800, 3000, 2800.0, 3000.0)
    state = LoopState("in_control", 0.0, 3000.0, 0.93, stretches=(stretch,))
    view = LoopView(diagnosis(run=run, found=False, loop_state=state))
    figure = figures.trends(view)
    hatched = {trace["name"]: trace for trace in figure.plot["data"] if "fillpattern" in trace}
    assert set(hatched) == {"missing", "manual"}
    ends = np.array([2799.5, 3000 - 0.5]) / view.unit[1]
    assert [np.nanmin(hatched["manual"]["x"]), np.nanmax(hatched["manual"]["x"])] == pytest.approx(ends)
    assert len(figure.plot["layout"]["shapes"]) == 1
    assert "(shaded) were analysed" in figure.caption
    assert "2 % missing, 6.7 % manual" in figure.caption.replace("\u00a0", " ")


def test_signals_of_the_analysed_part_are_at_its_samples():
    run = missing_values()
    bare = diagnosis(run=run, found=False)
    first, last = LoopView(bare).analysed
    assert (first, last) == (160, 2800)
    fit = identification(run.window(first, last))
    whole = LoopView(replace(bare, identification=fit)).on_record_samples(fit.pv)
    assert np.array_equal(whole[first:last], fit.pv, equal_nan=True)
    assert np.isnan(whole[:first]).all()
    assert np.isnan(whole[last:]).all()


@pytest.mark.parametrize("lack", ["sp", "pv", "samples", "values", "index", "start"])
def test_what_is_missing_does_not_break_the_page(tmp_path, lack):
    run = record()
    changed = {
        "sp": replace(run, sp=None),
        "pv": replace(run, pv=None),
        "samples": run.window(0, 3),
        "values": replace(run, op=np.full(2000, np.nan), pv=np.full(2000, np.nan)),
        "index": missing_values(),
        "start": replace(run, start=None),
    }[lack]
    found = lack in ("sp", "start")
    loop = diagnosis(run=changed, verdict="undecided", found=found)
    page = written(tmp_path, loop, loop)
    assert set(SECTIONS) <= set(page.headings)
    assert "nan" not in re.findall(r"[a-z]+", " ".join(page.text))


def test_a_fit_without_numbers_shows_dashes(tmp_path):
    found = diagnosis()
    fit = found.identification
    empty = replace(fit, S=math.nan, J=math.nan, S_low=math.nan, S_high=math.nan)
    surface = replace(fit.surface, likelihood_ratio=np.full_like(fit.surface.likelihood_ratio, np.nan))
    flat = replace(empty, surface=surface)
    page = written(tmp_path, replace(found, identification=flat))
    assert "nan" not in re.findall(r"[a-z]+", " ".join(page.text))
    assert not any("Likelihood of each S and J" in label for label in page.labels)
    assert any("Likelihood of each S and J" in label for label in written(tmp_path, found).labels)


def test_several_loops_come_as_a_table_worst_first(tmp_path):
    loops = [
        diagnosis(400, "no_stiction", run=record(400, tag="TIC-1")),
        diagnosis(400, "stiction", probability=0.7, run=record(400, tag="FIC-2")),
        diagnosis(400, "undecided", found=False, run=record(400, tag="LIC-3")),
        diagnosis(400, "stiction", probability=0.9, run=record(400, tag="PIC-4")),
    ]
    assert [loop.record.tag for loop in sort_worst_first(loops)] == ["PIC-4", "FIC-2", "LIC-3", "TIC-1"]
    page = written(tmp_path, *loops)
    assert page.links == ["#loop-1", "#loop-2", "#loop-3", "#loop-4"]
    assert {link[1:] for link in page.links} <= set(page.ids)
    assert page.headings == ["Loops", *JUDGED * 2, *SECTIONS, *JUDGED]


def test_what_was_not_diagnosed_stands_at_the_end_of_the_table(tmp_path):
    page = written(tmp_path, diagnosis(), failures=[("b.csv", "b.csv: no such file.")])
    text = " ".join(page.text)
    assert page.links == ["#loop-1"]
    assert "; 1 not diagnosed" in text
    assert re.search(r"FIC-101.*b\.csv\s+Not diagnosed.*b\.csv: no such file\.\s+Loops", text, re.DOTALL)


def test_long_records_stay_small(tmp_path):
    run = record(60_000)
    path = write_report([diagnosis(run=run)], tmp_path / "long.html")
    whole = write_report([diagnosis(run=run.window(0, 2000))], tmp_path / "short.html")
    assert path.stat().st_size - whole.stat().st_size < 150_000


def test_ten_loops_take_less_than_a_second(tmp_path):
    loops = [diagnosis(run=record(seed=k)) for k in range(10)]
    write_report(loops, tmp_path / "warm.html")
    start = time.process_time()
    write_report(loops, tmp_path / "ten.html")
    assert time.process_time() - start < 1.0


def test_no_diagnosis_is_an_error(tmp_path):
    with pytest.raises(ParameterError, match="no diagnosis"):
        write_report([], tmp_path / "r.html")


def test_no_bare_mv_on_screen(tmp_path):
    page = written(tmp_path, diagnosis(run=record(measured=True)))
    said = " ".join([*page.text, *page.labels])
    assert not re.search(r"\bMV\b", said)
    assert "OP (controller output)" in said


def test_a_rejected_valve_has_no_dimensions():
    good = figures.valve_position(LoopView(diagnosis(verdict="no_stiction")))
    assert good is not None
    assert "not accepted by the verdict" in good.caption
    assert [trace["name"] for trace in good.plot["data"]] == ["good valve", "sticky valve"]
    assert not good.plot["layout"]["shapes"]


def test_icon_and_headline_follow_the_finding_not_the_verdict_on_the_valve():
    causes = OscillationCause(tuning=0.95)
    tight = diagnosis(verdict="undecided", probability=0.01, oscillation_cause=causes)
    assert (tight.finding, labels.finding_icon(tight)) == ("tuning", "alert")
    assert labels.headline(tight) == "Controller tuning; a sticky valve would not show in this record"
    open_question = replace(tight, probability=0.5)
    assert labels.headline(open_question) == "Controller tuning; cannot tell whether the valve sticks"
    load = diagnosis(verdict="no_stiction", oscillation_cause=OscillationCause(external=0.95))
    assert (load.finding, labels.finding_icon(load)) == ("external", "unknown")

"""Notebook cards and plots of results, on results of a simulated loop."""

from __future__ import annotations

import sys
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

import stiction as st
from stiction.display.plots import plot_verdict
from stiction.fleet import Group
from stiction.fleet.group import Member, RootCandidate

VOID = {"rect", "path", "br"}
MAX_BYTES = 30_000


class Structure(HTMLParser):
    """Open tags, and everything that a notebook would have to load or run."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.active: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        names = [name for name, _ in attrs]
        self.active += [tag] if tag in {"script", "link", "img", "iframe"} else []
        self.active += [name for name in names if name.startswith("on") or name in {"src", "href"}]

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def loop():
    return st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)


@pytest.fixture(scope="module")
def results(loop):
    record = st.simulate(loop, sp=10.0, duration=2000.0, seed=1, loop_type="flow", tag="<b>FIC&1</b>")
    found = st.diagnose(record)
    members = tuple(Member(f"<i>{k}</i>", 60.0, 3.0, "op", 0.9, 10.0 * k) for k in range(40))
    roots = tuple(RootCandidate(one.tag, 0.0, 1 / 40, ()) for one in members)
    group = Group(60.0, members, (), roots, 0.5)
    return {
        "record": record,
        "diagnosis": found,
        "identification": found.identification,
        "group": group,
        "trial": st.compensate(loop, seeds=2),
    }


KINDS = ("record", "diagnosis", "identification", "group", "trial")


@pytest.mark.parametrize("kind", KINDS)
def test_card_is_small_closed_and_escaped(results, kind):
    text = results[kind]._repr_html_()
    page = Structure(text)
    assert len(text.encode()) < MAX_BYTES
    assert not page.open
    assert not page.active
    assert "http" not in text
    assert "light-dark(" in text


def test_text_of_the_plant_is_escaped(results):
    assert "<b>FIC&1</b>" in Structure(results["diagnosis"]._repr_html_()).text
    assert "<i>0</i>" in Structure(results["group"]._repr_html_()).text


def test_verdict_card_shows_the_size_of_the_stiction(results):
    page = Structure(results["diagnosis"]._repr_html_())
    assert "The valve sticks" in page.text
    assert "95 % interval" in page.text


def test_long_record_stays_small():
    rng = np.random.default_rng(1)
    op = rng.normal(50.0, 5.0, 86_400)
    op[1000:5000] = np.nan
    record = st.LoopRecord("LIC-1", 1.0, op=op, pv=rng.normal(size=86_400), sp=np.zeros(86_400), mv=op)
    assert len(record._repr_html_().encode()) < MAX_BYTES


@pytest.mark.parametrize("op", [[], [np.nan] * 3, [50.0]])
def test_record_without_values_has_an_empty_card(op):
    assert "LIC-1" in st.LoopRecord("LIC-1", 1.0, op=op)._repr_html_()


@pytest.mark.parametrize("kind", KINDS[1:])
def test_plot_draws_on_the_given_axes(results, kind):
    plt = pytest.importorskip("matplotlib.pyplot")
    _, ax = plt.subplots()
    try:
        assert results[kind].plot(ax) is ax
        assert ax.has_data()
        assert ax.get_xlabel()
        fresh = results[kind].plot()
        assert fresh is not ax
    finally:
        plt.close("all")


def test_a_long_title_is_not_cut(results):
    plt = pytest.importorskip("matplotlib.pyplot")
    long = "REFINERY-NORTH.UNIT-7.AREA-12.FIC-101/PID-A"
    found, record = results["diagnosis"], replace(results["record"], tag=long)
    shown = {name: getattr(found, name) for name in ("finding", "probability", "contributions")}
    try:
        for ax in (plot_verdict(SimpleNamespace(record=record, **shown)), record.plot()[0]):
            ax.figure.canvas.draw()
            title, picture = ax.title.get_window_extent(), ax.figure.bbox
            assert picture.x0 <= title.x0 < title.x1 <= picture.x1
            assert title.y1 <= picture.y1
            assert long in ax.get_title().replace("\n", "")
    finally:
        plt.close("all")


def test_plot_of_a_record_has_two_axes(results):
    plt = pytest.importorskip("matplotlib.pyplot")
    record = results["record"]
    try:
        pv, op = record.plot()
        lines = {line.get_label(): line.get_ydata() for ax in (pv, op) for line in ax.lines}
        assert np.array_equal(lines["PV"], record.pv)
        assert np.array_equal(lines["OP (controller output)"], record.op)
        with pytest.raises(st.ParameterError, match="two Axes"):
            record.plot(pv)
    finally:
        plt.close("all")


@pytest.mark.parametrize("kind", KINDS)
def test_plot_without_matplotlib_names_the_extra(results, kind, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(st.MissingExtraError, match=r"stiction\[plot\]"):
        results[kind].plot()

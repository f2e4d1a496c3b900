"""The scikit-learn transformer: rows of features, its place in a pipeline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st

sklearn = pytest.importorskip("sklearn")

LOOP = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)


def records(count=4):
    """Sticky loops and good ones in turn, the last two with an integrating process, and one whose OP rests."""
    level = st.Loop(st.PID(0.4, 120.0), LOOP.valve, st.Integrating(0.05, 3.0), dt=1.0, noise=0.1)
    start = {"sp": 50.0, "pv_start": 48.0, "op_start": 50.0, "loop_type": "level"}
    runs = []
    for k in range(count):
        loop, options = (LOOP, {"sp": 10.0, "loop_type": "flow"}) if k < count - 2 else (level, start)
        loop = loop if k % 2 else replace(loop, valve=st.Ideal())
        runs.append(st.simulate(loop, duration=1500.0, seed=k, **options))
    rest = np.full(600, 50.0)
    return [*runs, st.LoopRecord("FIC-9", 1.0, op=rest, pv=rest + np.sin(np.arange(600.0)))]


def test_rows_are_those_of_diagnose_and_a_record_that_cannot_be_judged_is_nan():
    given = records()
    transformer = st.StictionFeatures()
    rows = transformer.fit(given).transform(given)
    names = transformer.get_feature_names_out().tolist()
    assert rows.shape == (5, len(names))
    for record, row in zip(given[:-1], rows, strict=False):
        assert dict(zip(names, row, strict=True)) == pytest.approx(st.diagnose(record).features, nan_ok=True)
    assert np.isnan(rows[-1]).all()


def test_works_in_a_pipeline_and_is_cloned():
    from sklearn.base import clone
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.pipeline import make_pipeline

    given = records()
    model = make_pipeline(clone(st.StictionFeatures()), HistGradientBoostingClassifier(min_samples_leaf=1, max_iter=5))
    model.fit(given, [False, True, False, True, False])
    assert model.predict(given[:2]).tolist() == [False, True]


def test_no_records_give_no_rows_and_something_else_is_refused():
    names = st.StictionFeatures().get_feature_names_out()
    assert st.StictionFeatures().transform([]).shape == (0, len(names))
    with pytest.raises(st.RecordError):
        st.StictionFeatures().fit(["FIC-101.csv"])

"""Scores of the benchmark, by cases that can be counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.benchmark import OURS, score_index, score_methods, score_table
from calibration.feature_table import feature_row
from calibration.loop_sets import draw_chunk
from stiction.diagnosis.detection import FACTS

STICKY = np.array([True, True, True, False, False, False])
INDEX = np.array([2.0, -1.0, 3.0, 2.0, 0.0, np.nan])
WEIGHTS = np.array([0.5, 0.5, 1.0, 1.0, 1.0, 1.0])


def test_scores_count_the_weights_of_accepted_loops():
    scores = score_index(STICKY, INDEX, WEIGHTS)
    assert scores.accepted == pytest.approx(4 / 5)
    assert scores.found == pytest.approx(1.5 / 2)
    assert scores.alarms == pytest.approx(2 / 2)  # an index of 0 is at the threshold
    # Pairs: 2 against (2, 0), weight 0.5: 1.5 of 2; -1: none; 3, weight 1: both.
    assert scores.auc == pytest.approx((0.5 * 1.5 + 1.0 * 2.0) / (2.0 * 2.0))


def test_a_loop_that_is_not_accepted_is_not_called_sticky():
    """The highest threshold finds 1 of 2; the next also calls one of three good loops sticky."""
    scores = score_index(STICKY, INDEX, WEIGHTS)
    assert [scores.found_at(share) for share in (0.0, 0.33, 0.34, 1.0)] == pytest.approx([0.5, 0.5, 0.75, 1.0])
    none = score_index(STICKY, np.full(6, np.nan), WEIGHTS)
    assert np.isnan(none.auc)
    assert np.isnan(none.found)
    assert (none.accepted, none.found_at(1.0)) == (0.0, 0.0)


def test_feature_table_has_the_index_of_every_method():
    import polars as pl

    loops = [loop for k in range(2) for loop in draw_chunk("population", k, seed=3)]
    table = pl.DataFrame([feature_row(loop) for loop in loops], infer_schema_length=None)
    table = table.with_columns(pl.lit(None).alias(f"m_{name}") for name in FACTS if f"m_{name}" not in table.columns)
    scores = score_methods(table, table["probability"].to_numpy(), np.ones(table.height))
    assert list(scores) == [OURS, *FACTS]
    assert all(0.0 <= one.accepted <= 1.0 for one in scores.values())
    assert any(one.accepted > 0.0 for name, one in scores.items() if name != OURS)
    assert len(score_table(scores, {})) == 2 + len(scores)

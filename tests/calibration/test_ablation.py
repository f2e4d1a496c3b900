"""The ablation: parts go out of action and come back, rows survive packing, scores are those of closed forms."""

from __future__ import annotations

import csv
import math
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from calibration.ablation.model import Rows, feature_matrix, fit_model
from calibration.ablation.parts import SEARCH_PARTS, switch_off
from calibration.ablation.report import paired_interval, read_variants
from calibration.ablation.run import pack, plan_chunks, variant_rows
from calibration.features import diagnose_with_findings, feature_row
from calibration.loop_sets import FIRST_SIMULATOR, SETS, KnownLoop
from stiction.errors import StictionError


@pytest.fixture(scope="module")
def sticky() -> st.LoopRecord:
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    return replace(st.simulate(loop, sp=10.0, duration=1200.0, seed=1, loop_type="flow"), mv=None)


def test_a_row_holds_what_the_identification_found(sticky):
    row = feature_row(*diagnose_with_findings(sticky))
    found = st.diagnose(sticky).identification
    assert found is not None
    assert row["S"] == found.S
    assert abs(float(row["S"]) - 5.0) < 0.25
    assert row["likelier_good"] == found.over("good").likelier


@pytest.mark.parametrize("name", SEARCH_PARTS)
def test_each_part_can_be_switched_off_and_comes_back(sticky, name):
    before = st.diagnose(sticky).to_dict()
    with switch_off(name):
        try:
            feature_row(*diagnose_with_findings(sticky))
        except (StictionError, ValueError, IndexError) as error:
            pytest.fail(f"without {name}: {error}")
    assert st.diagnose(sticky).to_dict() == before


def test_rows_survive_packing(sticky, tmp_path):
    rows = variant_rows(KnownLoop(sticky, "one", True, {"cause": "stiction"}))
    assert [row["variant"] for row in rows][:2] == ["all parts", "lag search"]
    (tmp_path / "csv").mkdir()
    with (tmp_path / "csv" / "plant-0000.csv").open("w", newline="") as out:
        writer = csv.DictWriter(out, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    (tmp_path / "packed").mkdir()
    pack(tmp_path / "csv", tmp_path / "packed" / "all.json.gz")
    plain, packed = read_variants(tmp_path / "csv"), read_variants(tmp_path / "packed")
    assert plain.keys() == packed.keys() == {row["variant"] for row in rows}
    for variant, records in plain.items():
        for record, row in records.items():
            assert {name: value for name, value in row.items() if value != ""} == packed[variant][record]


def test_half_of_the_loops_come_from_a_historian():
    chunks = plan_chunks(2400, 0)
    loops = {name: sum(SETS[one] for one, _ in chunks if one == name) for name in set(FIRST_SIMULATOR)}
    total = sum(loops.values())
    assert total >= 2400
    assert abs((loops["stored"] + loops["plant"]) / total - 0.5) < 0.02
    assert len(set(chunks)) == len(chunks)


def test_the_interval_of_a_mean_is_that_of_the_normal_law():
    gain = np.random.default_rng(0).normal(0.3, 2.0, 4000)
    low, high = paired_interval(gain, 2000)
    half = 1.96 * 2.0 / math.sqrt(4000)
    np.testing.assert_allclose((high - low) / 2.0, half, rtol=0.1)
    np.testing.assert_allclose((high + low) / 2.0, gain.mean(), atol=0.01)


def test_the_model_is_monotone_and_learns_a_threshold():
    rng = np.random.default_rng(1)
    X = rng.uniform(-1.0, 1.0, (1500, 2))
    truth = X[:, 0] + 0.3 * rng.normal(size=1500) > 0.0
    predict = fit_model(X, truth, [1, 0])
    line = np.column_stack([np.linspace(-1.0, 1.0, 101), np.zeros(101)])
    p = predict(line)
    assert (np.diff(p) >= 0.0).all()
    assert p[0] < 0.05
    assert p[-1] > 0.95


def test_a_rival_that_is_dropped_no_longer_counts():
    from calibration.ablation.model import FEATURES

    rows = Rows([{"likelier_good": "50", "likelier_bent": "5", "likelier_gated": "30", "likelier_relaxation": "40"}])
    one = {"over rivals": FEATURES["likelihood over the best rival"]}
    assert feature_matrix(rows, one)[0, 0] == pytest.approx(math.asinh(5.0 / 20.0))
    assert feature_matrix(rows, one, ("bent",))[0, 0] == pytest.approx(math.asinh(30.0 / 20.0))

"""Exports that write a value only when it has changed: held until the next one, and what was not seen is said."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.records.assess import assess_quality
from stiction.records.provenance import Provenance
from stiction.records.quality.compression import is_stored_on_change

N = 1500
RNG = np.random.default_rng(9)
PV = np.round(10 + 3 * np.sin(np.arange(N) / 12) + RNG.normal(scale=0.15, size=N), 3)
OP = np.round(50 + 6 * np.sin(np.arange(N) / 25) + RNG.normal(scale=0.05, size=N), 3)


def stored(x, deviation, digits=3):
    """Mark the rows at which a value is written, and give the value that stands at each row."""
    x, kept, last = np.round(x, digits), [], np.nan
    for value in x:
        kept.append(not abs(value - last) <= deviation)
        last = value if kept[-1] else last
    kept = np.array(kept)
    return kept, x[np.maximum.accumulate(np.where(kept, np.arange(len(x)), 0))]


def read(tmp_path, *columns, full_rows=True):
    """Read a table of (values, rows written)."""
    rows = []
    for k in range(N):
        cells = [f"{x[k]:g}" if kept[k] else "" for x, kept in columns]
        rows += [",".join([f"2026-10-06 02:{k // 60:02d}:{k % 60:02d}", *cells])] if full_rows or any(cells) else []
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Time,FIC1.PV,FIC1.OP,FIC1.SP", *rows]))
    return st.read(path)[0]


@pytest.mark.parametrize("full_rows", [True, False])
@pytest.mark.parametrize(
    ("pv", "op"), [((0.15, 3), (0.5, 3)), ((-1, 3), (0.5, 3)), ((0.0, 1), (0.0, 1)), ((-1, 3), (0.0, 0))]
)
def test_a_value_is_held_until_the_next_one(pv, op, full_rows, tmp_path):
    (kept_pv, PV_held), (kept_op, OP_held) = stored(PV, *pv), stored(OP, *op)
    sp = (np.full(N, 10.0), np.arange(N) == 0)
    record = read(tmp_path, (PV_held, kept_pv), (OP_held, kept_op), sp, full_rows=full_rows)
    n = len(record)
    np.testing.assert_array_equal(record.pv, PV_held[:n])
    np.testing.assert_array_equal(record.op, OP_held[:n])
    np.testing.assert_array_equal(record.sp, np.full(n, 10.0))
    assert record.provenance.missing_samples == 0
    assert record.provenance.unchanged_samples == record.provenance.held_samples > 0
    assert any("only when it had changed" in note for note in record.provenance.assumptions)
    checks = {check.name: check.severity for check in assess_quality(record).checks}
    assert checks.get("resampled", "ok") == "ok"


def test_a_coarse_deviation_is_named_by_the_data_check(tmp_path):
    kept, held = stored(OP, 2.0)
    record = read(tmp_path, (PV, np.ones(N, dtype=bool)), (held, kept), (np.full(N, 10.0), np.arange(N) == 0))
    [check] = [check for check in assess_quality(record).checks if check.name == "exception reporting"]
    assert check.severity == "reject"


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_lost_values_are_missing(share, tmp_path):
    kept = RNG.random(N) > share
    record = read(tmp_path, (PV, kept), (OP, kept), (np.full(N, 10.0), np.ones(N, dtype=bool)))
    assert record.provenance.missing_samples == pytest.approx(share * N, rel=0.3)
    assert not is_stored_on_change(PV[kept], np.flatnonzero(kept).astype(float))
    assert not is_stored_on_change(OP[kept], np.flatnonzero(kept).astype(float))


def test_a_window_has_its_share_of_unchanged_samples():
    origin = Provenance(held_samples=300, unchanged_samples=150)
    part = st.LoopRecord("FIC1", 1.0, op=OP, pv=PV, provenance=origin).window(0, N // 3).provenance
    assert (part.held_samples, part.unchanged_samples) == (100, 50)

"""Real records, from a folder outside the project (``STICTION_RECORDS``, else ``../shared/data``)."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from stiction.records import assess_quality
from stiction.sources import read

FOLDER = Path(os.environ.get("STICTION_RECORDS", Path(__file__).resolve().parents[2].parent / "shared" / "data"))
LABELS = FOLDER / "labels.csv"
ROWS = list(csv.DictReader(LABELS.open(encoding="utf-8"))) if LABELS.is_file() else []
pytestmark = pytest.mark.skipif(not ROWS, reason="no real records: set STICTION_RECORDS to their folder")
# Normalised records, and one whose OP lies between 4 and 20 without a unit: it may be in mA.
OTHER_OP_SCALE = {"CHEM10", "CHEM12", "CHEM13", "2111PIC10201", "2111FIC10201"}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: Path(row["file"]).stem)
def test_labelled_record_is_read_and_usable(row):
    [record] = read(FOLDER / row["file"])
    raw = np.genfromtxt(FOLDER / row["file"], delimiter=",", names=True)
    assert record.dt == float(row["dt_s"])
    np.testing.assert_array_equal(record.op, raw["OP"])
    np.testing.assert_array_equal(record.pv, raw["PV"])
    if row["file"].startswith("plant"):
        assert record.loop_type == row["loop_type"]
        assert str(record.integrating).lower() == row["integrating"]
        np.testing.assert_array_equal(record.sp, raw["SP"])
    quality = assess_quality(record)
    assert quality.usable, quality.summary()
    assert (quality.first, quality.last) == (0, len(raw))
    assert ("op scale" in {gate.name for gate in quality.warnings}) == (row["loop"] in OTHER_OP_SCALE)


def test_actuator_with_measured_travel():
    files = list(FOLDER.glob("damadics/*.csv"))
    if not files:
        pytest.skip("no actuator record in the folder of real records")
    [record] = read(files[0])
    raw = np.genfromtxt(files[0], delimiter=",", names=True)
    assert (len(record), record.dt) == (3600, 1.0)
    np.testing.assert_array_equal(record.mv, raw["MV"])
    assert assess_quality(record).warnings == ()


def test_records_held_by_the_historian_are_distinguished():
    """Three records repeat a third or more of their rows; no other repeats more than a tenth."""
    held = {}
    for row in ROWS:
        [record] = read(FOLDER / row["file"])
        gate = next(g for g in assess_quality(record).checks if g.name == "held values")
        held[Path(row["file"]).stem] = gate
    lowered = {name for name, gate in held.items() if gate.severity == "warn"}
    assert lowered == {"2111FIC46005_20240613T2155", "2111LIC42502_20240619T2155", "2411FIC20102_20240609T0750"}

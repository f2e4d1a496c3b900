"""Loops that take longer than their time limit, in a worker process."""

from __future__ import annotations

import stiction as st
from fleet.small_plant import write_plant


def test_time_limit_is_a_row(tmp_path):
    source = write_plant(tmp_path / "plant.parquet", 2)
    found = st.audit(source, tmp_path / "audit", workers=1, time_limit=0.001)
    assert [row["status"] for row in found.rows] == ["timeout", "timeout"]
    assert "time_limit" in found.rows[0]["reason"]
    again = st.audit(source, tmp_path / "audit", workers=1, retry=True)
    assert [row["status"] for row in again.rows] == ["diagnosed", "diagnosed"]

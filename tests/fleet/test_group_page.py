"""The page of an audit with a large group."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

import stiction as st
from stiction.report import write_audit_page
from stiction.report.group_picture import picture_group

pytestmark = pytest.mark.usefixtures("audit_in_process")


def test_a_group_of_more_loops_than_are_drawn_has_its_page(tmp_path):
    rng = np.random.default_rng(0)
    phase = np.cumsum(2 * np.pi / 40 * (1.0 + 0.2 * rng.standard_normal(3000)))
    columns = {"t": np.arange(3000)}
    for k in range(14):
        pv = np.sin(phase) + rng.normal(0.0, 0.1, 3000)
        columns |= {f"FIC-{k}.OP": 50.0 - 2.0 * pv, f"FIC-{k}.PV": pv}
    pl.DataFrame(columns).write_csv(tmp_path / "plant.csv")
    found = st.audit(tmp_path / "plant.csv", tmp_path / "audit", workers=1)
    [group] = found.groups
    assert len(group["members"]) == 14
    assert write_audit_page(found).is_file()
    picture = picture_group(found, group)
    assert (len(picture.trends), picture.left_out) == (12, 2)
    assert picture.since.keys() == set(group["members"])

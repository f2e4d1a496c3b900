"""The recommended remedy stands first, and each cheaper one has its reason."""

from __future__ import annotations

import pytest

import stiction as st
from stiction.report.blocks import Table, Text
from stiction.report.pages.trial import trial_blocks, why_not_cheaper


@pytest.fixture(scope="module")
def trial():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    return st.compensate(loop, duration=1500.0, seeds=2)


def test_recommended_remedy_is_first_and_cheaper_ones_have_reasons(trial):
    blocks = trial_blocks(trial)
    table = next(block for block in blocks if isinstance(block, Table) and "cost" in block.columns[-1].lower())
    names = [row[0].value for row in table.rows]
    assert str(names[0]) == trial.recommended
    best = trial[trial.recommended]
    cheaper = {one.name for one in trial.remedies if one.cost < best.cost and one.name != "no action"}
    lines = why_not_cheaper(trial)
    assert len(lines) == len(cheaper)
    for name in cheaper:
        assert any(line.lower().startswith(f"{name.lower()} costs less but ") for line in lines)
    said = " ".join(block.text for block in blocks if isinstance(block, Text))
    assert all(line in said for line in lines)

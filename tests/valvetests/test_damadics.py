"""An hour of a real valve with positioner: a loop in automatic is no valve test, and that must be the answer."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st


def test_an_hour_in_automatic_is_refused_with_the_reason(records):
    table = np.genfromtxt(records / "damadics" / "A3_20011011_1h.csv", delimiter=",", names=True)
    record = st.LoopRecord("A3", 1.0, op=table["OP"], pv=table["PV"], mv=table["MV"])
    for analyse in (st.analyse_ramp, st.analyse_steps):
        with pytest.raises(st.RecordError, match=r"sample to sample.*automatic.*plan_"):
            analyse(record)

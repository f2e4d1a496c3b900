"""An hour of a real valve with positioner: a loop in automatic is no valve test, and that must be the answer."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import stiction as st

FOLDER = Path(os.environ.get("STICTION_RECORDS", Path(__file__).resolve().parents[4] / "shared" / "data"))
HOUR = FOLDER / "damadics" / "A3_20011011_1h.csv"


@pytest.mark.skipif(not HOUR.exists(), reason="real records are not at hand: set STICTION_RECORDS")
def test_an_hour_in_automatic_is_refused_with_the_reason():
    table = np.genfromtxt(HOUR, delimiter=",", names=True)
    record = st.LoopRecord("A3", 1.0, op=table["OP"], pv=table["PV"], mv=table["MV"])
    for analyse in (st.analyse_ramp, st.analyse_steps):
        with pytest.raises(st.RecordError, match=r"sample to sample.*automatic.*plan_"):
            analyse(record)

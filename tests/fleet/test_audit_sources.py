"""Which files of a folder an audit reads, and how."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.fleet import find_loop_places
from stiction.fleet.source_parts import read_loop


def test_given_codes_count_in_the_files_that_have_them_and_audits_are_no_sources(tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "audit.toml").write_text("format = 1")
    for name, good in (("a", 192), ("b", 77), ("old/c", 192)):
        rows = [f"{k},{k % 7},{0 if k % 50 > 40 else good},{k % 9}" for k in range(200)]
        (tmp_path / f"{name}.csv").write_text("\n".join([f"t,{name}.PV,{name}.PV.Quality,{name}.OP", *rows, ""]))
    places = find_loop_places([str(tmp_path)], {"good_codes": "77"})
    assert [place.tag for place in places] == ["a", "b"]
    known, given = map(read_loop, places)
    assert known.pv is not None
    assert given.pv is not None
    assert np.isnan(known.pv).sum() == np.isnan(given.pv).sum() == 36
    assert "None of the good codes 77" in " ".join(known.provenance.assumptions)
    with pytest.raises(RecordError, match="holds only an audit"):
        find_loop_places([str(tmp_path / "old")], {})

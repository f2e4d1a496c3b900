"""A work list never replaces another page, and its folder is a folder."""

from __future__ import annotations

import pytest

from stiction.apps.worklist import _require_own_folder
from stiction.errors import RecordError


def test_page_of_an_audit_is_not_replaced(tmp_path):
    (tmp_path / "index.html").write_text("<title>Audit</title>")
    with pytest.raises(RecordError, match="holds another page; give --out a folder of its own"):
        _require_own_folder(tmp_path)
    (tmp_path / "worklist.xlsx").write_bytes(b"")
    _require_own_folder(tmp_path)


def test_file_is_no_folder(tmp_path):
    (tmp_path / "a.csv").write_text("")
    with pytest.raises(RecordError, match="is a file; --out names a folder"):
        _require_own_folder(tmp_path / "a.csv")

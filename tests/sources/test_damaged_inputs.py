"""500 damaged inputs over all formats: no traceback, no hang, no record from a file that lost rows without a note."""

from __future__ import annotations

import pytest

import damaged_inputs


@pytest.mark.parametrize("first", range(0, 500, 50))
def test_damaged_inputs(first: int) -> None:
    for number in range(first, first + 50):
        try:
            damaged_inputs.check_one(number)
        except Exception as error:
            raise AssertionError(f"number {number}: {error}") from error

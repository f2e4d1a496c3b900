"""What the size of the diagnosis counts."""

from __future__ import annotations

from calibration.room_sizes import count_code, count_numbers

PAGE = '''"""Title.

More.
"""

import math  # a comment

# another
A = (
    3.5,
    1,
)
"""What A is."""


def f(x, width=4, *, shape=True, edge=7.0):
    """Do it.

    With 99 details.
    """
    y = 55 * x
    return y


class B:
    """A class."""

    size: float = 0.7
'''


def test_code_is_what_is_no_comment_docstring_or_blank():
    assert count_code(PAGE) == 1 + 4 + 3 + 2


def test_numbers_are_those_of_assignments_and_defaults():
    """3.5, 4, 7.0 and 0.7; 1 and True are none, nor is 55 inside a function."""
    assert count_numbers(PAGE) == 4

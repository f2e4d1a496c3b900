"""Failures: files and loops that could not be diagnosed, while the work on the others continues."""

from traceback import format_exception
from typing import NamedTuple

__all__ = ["Failure", "program_fault", "traceback_text"]


class Failure(NamedTuple):
    """A file or a loop that could not be diagnosed."""

    file: str
    """Name of the file."""
    tag: str | None
    """Tag of the loop; None when the file could not be read."""
    reason: str
    """What is wrong, and what to do about it."""
    fault: Exception | None = None
    """Unexpected error of the program; None when the data are the reason."""

    @property
    def remedy(self) -> str:
        """What to do, in one sentence."""
        return "Correct the file or say how to read it." if self.fault is None else "Report the error."


def program_fault(file: str, tag: str | None, error: Exception) -> Failure:
    """Return the failure for an unexpected error of the program.

    Examples
    --------
    >>> program_fault("a.csv", "FIC-101", ZeroDivisionError("division by zero")).reason
    'an error in the program (ZeroDivisionError: division by zero); please report it.'
    """
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return Failure(file, tag, f"an error in the program ({text}); please report it.", error)


def traceback_text(error: Exception) -> str:
    """Return the traceback of an error, for a report."""
    return "".join(format_exception(error)).rstrip()

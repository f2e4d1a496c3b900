"""What is said of a file or a loop that could not be judged, while the others go on."""

from traceback import format_exception
from typing import NamedTuple

__all__ = ["Failure", "fault", "traceback_of"]


class Failure(NamedTuple):
    """A file or a loop that could not be judged."""

    file: str
    """Name of the file."""
    tag: str | None
    """Loop, where it came so far."""
    reason: str
    """What was wrong, and what to do about it."""
    fault: Exception | None = None
    """What the program stumbled over, where file and loop may be in order."""

    @property
    def remedy(self) -> str:
        """What to do, in a word."""
        return "Mend the file or say how to read it." if self.fault is None else "Report the fault."


def fault(file: str, tag: str | None, error: Exception) -> Failure:
    """Return what is said where the program itself stumbled.

    Examples
    --------
    >>> fault("a.csv", "FIC-101", ZeroDivisionError("division by zero")).reason
    'a fault of the program, not yours (ZeroDivisionError: division by zero); please report it.'
    """
    told = " ".join(f"{type(error).__name__}: {error}".split())
    return Failure(file, tag, f"a fault of the program, not yours ({told}); please report it.", error)


def traceback_of(error: Exception) -> str:
    """Return what to send with a report of a fault."""
    return "".join(format_exception(error)).rstrip()

"""Failures: files and loops that could not be diagnosed, while the work on the others continues."""

from __future__ import annotations

from traceback import format_exception
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from stiction.errors import RecordError, StictionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


__all__ = ["Failure", "program_fault", "traceback_text", "try_each"]

Record = TypeVar("Record")
Result = TypeVar("Result")


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


def try_each(records: Iterable[Record], work: Callable[[Record], Result]) -> tuple[list[Result], list[Failure]]:
    """Do some work on each record, or on each diagnosis of one; what fails is a failure of its loop, the others go on.

    Raises
    ------
    StictionError
        When an option is wrong, not the data.
    """
    from stiction.apps.options import option_text

    results: list[Result] = []
    failures: list[Failure] = []
    for one in records:
        record: Any = getattr(one, "record", one)
        try:
            results.append(work(one))
        except RecordError as error:
            failures.append(Failure(record.provenance.source, record.tag, error.text(option_text)))
        except StictionError:
            raise
        except Exception as error:
            failures.append(program_fault(record.provenance.source, record.tag, error))
    return results, failures


def traceback_text(error: Exception) -> str:
    """Return the traceback of an error, for a report."""
    return "".join(format_exception(error)).rstrip()

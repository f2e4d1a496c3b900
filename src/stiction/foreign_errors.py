"""Errors of libraries and of the machine that data cause, as messages to their user."""

from __future__ import annotations

import errno
from contextlib import contextmanager
from typing import TYPE_CHECKING

from stiction.errors import RecordError, Setting, StictionError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["DISK_FULL_ERRNOS", "damage_refused", "damaged", "data_error", "failure_of"]

DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of a full disk or an exceeded quota."""


def damaged(where: str, error: BaseException, remedy: str = "copy or export it again") -> RecordError:
    """Make the error of a file that a library cannot read, by what the library says."""
    text = " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
    return RecordError(f"is damaged or cut off ({text}); {remedy}.", where=where)


@contextmanager
def damage_refused(where: str, remedy: str = "copy or export it again") -> Iterator[None]:
    """Say that a file is damaged, instead of any error or panic of the library that reads it."""
    try:
        yield
    except StictionError:
        raise
    except BaseException as error:
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        known = data_error(error, where) if isinstance(error, (OSError, MemoryError)) else None
        raise known or damaged(where, error, remedy) from None


def data_error(error: BaseException, where: str = "") -> StictionError | None:
    """Turn an error that the data or the machine caused into a message; None for a fault of the program.

    Parameters
    ----------
    error : BaseException
        Any error; also a panic of a library in Rust, which is no `Exception`.
    where : str
        File or loop that was worked on.

    Examples
    --------
    >>> str(data_error(MemoryError(), "a.csv")).split(";")[0], data_error(KeyError("x"))
    ('a.csv: there is not enough memory', None)
    """
    text = " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
    if isinstance(error, StictionError):
        return error
    if isinstance(error, MemoryError):
        remedy = ("give a shorter time, fewer loops or a longer sampling period, or less with ", Setting("max_memory"))
        return RecordError("there is not enough memory", remedy=remedy, where=where)
    if type(error).__name__ == "PanicException":
        return RecordError(f"is damaged, or holds what cannot be read ({text})", remedy="export it again", where=where)
    if isinstance(error, RecursionError):
        return RecordError("is nested too deeply", remedy="export it as a plain table", where=where)
    if isinstance(error, (OverflowError, FloatingPointError)):
        return RecordError(
            f"has a number that is too large or too small ({text})", remedy="scale it, or leave it out", where=where
        )
    if isinstance(error, UnicodeError):
        return RecordError(f"has characters that cannot be used ({text})", remedy="export it in UTF-8", where=where)
    if isinstance(error, OSError) and error.errno in DISK_FULL_ERRNOS:
        place = error.filename or "the folder for temporary files"
        return RecordError(
            f"the disk is full ({error.strerror}: {place})", remedy="free some space, or write elsewhere", where=where
        )
    return None


def failure_of(error: BaseException, where: str) -> StictionError:
    """Turn any error but a request to end into a message; that of a fault of the program, its cause, asks to report it.

    Examples
    --------
    >>> str(failure_of(KeyError("x"), "a.csv"))
    "a.csv: an error in the program (KeyError: 'x'); please report it."
    """
    known = data_error(error, where)
    if known is not None:
        return known
    if not isinstance(error, Exception):
        raise error
    if isinstance(error, OSError):
        return RecordError(
            f"cannot be read ({error.strerror or error}); check the name and the access rights.", where=where
        )
    text = " ".join(f"{type(error).__name__}: {error}".split())
    fault = RecordError(f"an error in the program ({text})", remedy="please report it", where=where)
    fault.__cause__ = error
    return fault

"""The exceptions of the package, and checks of parameters.

::

    StictionError
    |-- ParameterError      (ValueError)    a parameter outside its limits
    |-- RecordError         (ValueError)    a file or record that cannot be used
    |-- ConvergenceError    (RuntimeError)  a search that did not settle
    `-- MissingExtraError   (ImportError)   an optional dependency that is not installed

Errors are raised at the boundary (constructor, reader, command line), never in a kernel,
and name the quantity, the value, the limit and the remedy.
"""

from __future__ import annotations

import importlib
import math
import os
from dataclasses import dataclass
from reprlib import repr as brief
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "ConvergenceError",
    "MissingExtraError",
    "ParameterError",
    "RecordError",
    "Setting",
    "StictionError",
    "as_floats",
    "import_extra",
    "require_count",
    "require_finite",
    "require_kind",
    "require_not_negative",
    "require_number",
    "require_numbers",
    "require_positive",
    "require_probability",
    "require_range",
    "require_samples",
    "require_seed",
]

MAX_SAMPLES = 10_000_000
"""Largest number of samples that can be made [-]."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting that a message names: an argument in Python, an option of the command line, a field of a page.

    Examples
    --------
    >>> str(Setting("dt")), str(Setting("columns", {"pv": None, "op": 2}))
    ('dt', "columns={'pv': ..., 'op': 2}")
    """

    name: str
    """Name of the argument in Python."""
    value: Any = None
    """Value to give; None when only the setting is named. A column that is None stands for any name."""

    def __str__(self) -> str:
        if self.value is None:
            return self.name
        if isinstance(self.value, dict):
            pairs = (f"{key!r}: {'...' if item is None else repr(item)}" for key, item in self.value.items())
            return f"{self.name}={{{', '.join(pairs)}}}"
        return f"{self.name}={self.value!r}"


class StictionError(Exception):
    """Any error this package raises on purpose.

    Parameters
    ----------
    *problem : str or Setting
        What is wrong, in parts: text, and the settings that it names.
    remedy : str, Setting or sequence of both
        What to do, as an imperative clause.
    where : str or path-like
        File or loop that is concerned.
    quantity : str
        Name of the quantity.
    value, limit : object
        Its value and the limit that it exceeds, if there is one [unit of the quantity].

    Examples
    --------
    >>> from stiction.errors import RecordError, Setting
    >>> error = RecordError("no time column", remedy=("give ", Setting("dt"), " in seconds"), where="a.csv")
    >>> str(error), error.text(lambda setting: f"--{setting.name}")
    ('a.csv: no time column; give dt in seconds.', 'a.csv: no time column; give --dt in seconds.')
    """

    def __init__(
        self,
        *problem: str | Setting,
        remedy: str | Setting | Sequence[str | Setting] = (),
        where: str | os.PathLike[str] = "",
        quantity: str = "",
        value: object = None,
        limit: object = None,
    ) -> None:
        super().__init__(*problem)
        self.remedy = (remedy,) if isinstance(remedy, (str, Setting)) else tuple(remedy)
        self.where, self.quantity, self.value, self.limit = os.fspath(where), quantity, value, limit

    def __str__(self) -> str:
        return self.text()

    @property
    def reason(self) -> str:
        """The message without the file or loop, as a sentence."""
        text = self._sentence(str)
        return text[:1].upper() + text[1:]

    def text(self, write: Callable[[Setting], str] = str, where: str | None = None) -> str:
        """Return the message.

        Parameters
        ----------
        write : callable
            Turns a setting into text, by default into an argument in Python.
        where : str, optional
            Name to show for the file or loop, instead of its own.

        Returns
        -------
        str
            The message, with the file or loop in front.
        """
        shown = self.where if where is None else where
        return f"{shown}: {self._sentence(write)}" if shown else self._sentence(write)

    @property
    def file_name(self) -> str:
        """The file or loop that is concerned; a file with an absolute path without its folder."""
        return os.path.basename(self.where) if os.path.isabs(self.where) else self.where

    def _sentence(self, write: Callable[[Setting], str]) -> str:
        problem, remedy = (
            "".join(part if isinstance(part, str) else write(part) for part in parts)
            for parts in (self.args, self.remedy)
        )
        return f"{problem}; {remedy}." if remedy else problem


class ParameterError(StictionError, ValueError):
    """A parameter lies outside its limits.

    Examples
    --------
    >>> import stiction as st
    >>> st.Kano(S=-1.0, J=0.0)
    Traceback (most recent call last):
    stiction.errors.ParameterError: S = -1 % of span is negative; give a value of 0 or more.
    """


class RecordError(StictionError, ValueError):
    """A file or a record cannot be used as asked.

    Examples
    --------
    >>> import stiction as st
    >>> st.read("no-such-file.csv")
    Traceback (most recent call last):
    stiction.errors.RecordError: no-such-file.csv: no such file; check the name and the folder.
    """


class ConvergenceError(StictionError, RuntimeError):
    """An iterative search did not settle.

    Examples
    --------
    >>> import stiction as st
    >>> issubclass(st.ConvergenceError, RuntimeError)
    True
    """


class MissingExtraError(StictionError, ImportError):
    """An optional dependency is not installed.

    Examples
    --------
    >>> import stiction as st
    >>> issubclass(st.MissingExtraError, ImportError)
    True
    """


def import_extra(module: str, extra: str) -> Any:
    """Import a module of an optional dependency, or say how to install it.

    Raises
    ------
    MissingExtraError
        When it is not installed; the message has the pip line of the `extra` that brings it.

    Examples
    --------
    >>> import_extra("no_such_module", "plot")
    Traceback (most recent call last):
    stiction.errors.MissingExtraError: no_such_module is not installed; install it with: pip install "stiction[plot]"
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise MissingExtraError(
            f'{package} is not installed; install it with: pip install "stiction[{extra}]"', quantity=package
        ) from None


def require_kind(name: str, value: object, kind: type | tuple[type, ...], remedy: str) -> None:
    """Refuse a value that is not of a type; `remedy` says what to give.

    Examples
    --------
    >>> require_kind("tag", "FIC-101", str, "a text")
    """
    if not isinstance(value, kind):
        raise ParameterError(
            f"{name} is of type {type(value).__name__}", remedy=f"give {remedy}", quantity=name, value=value
        )


def require_number(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float, which may be infinite, or refuse it."""
    number = _to_float(name, value, unit)
    if math.isnan(number):
        raise ParameterError(f"{name} must be a number{_in_unit(unit)}, got {value!r}.")
    return number


def require_finite(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a finite float, or refuse it."""
    number = _to_float(name, value, unit)
    if not math.isfinite(number):
        raise ParameterError(f"{name} must be a finite number{_in_unit(unit)}, got {number}.")
    return number


def as_floats(value: ArrayLike) -> NDArray:
    """Return an array of floats, without a copy if possible; masked values become NaN.

    Raises
    ------
    TypeError, ValueError, OverflowError
        When it does not hold real numbers.
    """
    import numpy as np

    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(np.float64), np.nan)
    if getattr(getattr(value, "dtype", None), "kind", "") == "c":
        raise TypeError("complex numbers")
    return np.asarray(value, dtype=np.float64)


def require_numbers(name: str, value: ArrayLike, unit: str = "") -> NDArray:
    """Return `value`, a number or an array, as an array of finite floats, or refuse it."""
    import numpy as np

    try:
        array = as_floats(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be a number or an array of numbers{_in_unit(unit)}, got {brief(value)}."
        ) from None
    if not np.isfinite(array).all():
        raise ParameterError(
            f"{name} has entries that are not finite{_in_unit(unit)}", remedy="give finite numbers", quantity=name
        )
    return array


def require_not_negative(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float >= 0, or refuse it."""
    number = require_finite(name, value, unit)
    if number < 0.0:
        raise ParameterError(
            f"{name} = {number:g}{_with_unit(unit)} is negative",
            remedy="give a value of 0 or more", quantity=name, value=number, limit=0.0,
        )  # fmt: skip
    return number


def require_positive(name: str, value: float, unit: str = "", *, infinite: bool = False) -> float:
    """Return `value` as a float > 0, or refuse it; `infinite` allows infinity."""
    number = require_number(name, value, unit) if infinite else require_finite(name, value, unit)
    if number <= 0.0:
        raise ParameterError(
            f"{name} = {number:g}{_with_unit(unit)} is not positive",
            remedy="give a value above 0", quantity=name, value=number, limit=0.0,
        )  # fmt: skip
    return number


def require_probability(name: str, value: float) -> float:
    """Return `value` as a float above 0 and below 1, or refuse it."""
    number = _to_float(name, value, "")
    if not 0.0 < number < 1.0:
        raise ParameterError(
            Setting(name), f" = {number:g} is not a probability",
            remedy="give a number above 0 and below 1", quantity=name, value=number,
        )  # fmt: skip
    return number


def require_count(name: str, value: float) -> int:
    """Return `value` as a whole number > 0, or refuse it."""
    number = require_positive(name, value)
    if number != round(number):
        raise ParameterError(
            f"{name} = {number:g} is not a whole number", remedy="give 1 or more", quantity=name, value=number
        )
    return round(number)


def require_seed(seed: int | None) -> int | None:
    """Return `seed` as a whole number >= 0 or None, or refuse it."""
    if seed is None:
        return None
    number = require_not_negative("seed", seed)
    if number != round(number):
        raise ParameterError(
            f"seed = {number:g} is not a whole number", remedy="give 0 or more", quantity="seed", value=number
        )
    return int(seed)


def require_range(name: str, ends: tuple[float, float]) -> tuple[float, float]:
    """Return (lowest, highest) in % of span as floats, which may be infinite, or refuse them."""
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} = {brief(ends)} is not a pair of numbers; give (lowest, highest) in % of span."
        ) from None
    if not low < high:
        raise ParameterError(
            f"{name} = ({low:g}, {high:g}) % is an empty range",
            remedy="give lowest < highest", quantity=name, value=(low, high),
        )  # fmt: skip
    return low, high


def require_samples(name: str, seconds: float, dt: float) -> None:
    """Refuse a length of more than `MAX_SAMPLES` samples; length and sampling period in s."""
    if seconds > MAX_SAMPLES * dt:
        raise ParameterError(
            f"{name} = {seconds:g} s is {seconds / dt:.4g} samples of {dt:g} s (limit {MAX_SAMPLES:,})",
            remedy=f"give at most {MAX_SAMPLES * dt:g} s, or a longer dt",
            quantity=name, value=seconds, limit=MAX_SAMPLES * dt,
        )  # fmt: skip


def _to_float(name: str, value: float, unit: str) -> float:
    try:
        if not isinstance(value, bool) and getattr(value, "imag", 0.0) == 0.0:
            return float(value)
    except (TypeError, ValueError):
        pass
    except OverflowError:
        raise ParameterError(f"{name} is a number{_in_unit(unit)} beyond 1.8e308; give a smaller one.") from None
    raise ParameterError(f"{name} must be a number{_in_unit(unit)}, got {value!r}.")


def _with_unit(unit: str) -> str:
    return f" {unit}" if unit else ""


def _in_unit(unit: str) -> str:
    return f" in {unit}" if unit else ""

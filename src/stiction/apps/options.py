"""Options that several verbs share, each told once."""

import difflib
import inspect
from collections.abc import Callable, Sequence
from typing import Annotated

from cyclopts import Parameter

from stiction.errors import ParameterError

__all__ = ["Json", "Out", "Report", "refuse_options"]

Json = Annotated[bool, Parameter(name="--json", negative="", help="Print JSON and nothing else on the output.")]
Report = Annotated[str | None, Parameter(name="--report", help="HTML file to write; it opens without a network.")]
Out = Annotated[str | None, Parameter(name="--out", help="CSV file to write; without it the CSV goes to the output.")]


def refuse_options(files: Sequence[str], verb: Callable[..., int]) -> None:
    """Refuse what looks like an option among file names; only "-", the standard input, may begin so.

    Raises
    ------
    ParameterError
        When a name begins with a hyphen.
    """
    for file in files:
        if file.startswith("-") and file != "-":
            options = ["--json", *(f"--{name.replace('_', '-')}" for name in inspect.signature(verb).parameters)]
            close = difflib.get_close_matches(file, options, 1)
            hint = f" Did you mean {close[0]}?" if close else ""
            raise ParameterError(
                f"Unknown option: {file}.{hint} Try: stiction {verb.__name__} --help (a file of that name is ./{file})."
            )

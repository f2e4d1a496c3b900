"""Options that several commands share."""

import difflib
import inspect
import re
from collections.abc import Callable, Sequence
from typing import Annotated

from cyclopts import Parameter

from stiction.errors import ParameterError, Setting

__all__ = ["JsonOption", "OutOption", "ReportOption", "TextOption", "option_text", "reject_misplaced_options"]

JsonOption = Annotated[bool, Parameter(name="--json", negative="", help="Print only JSON on the standard output.")]
TextOption = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
ReportOption = Annotated[
    str | None,
    Parameter(name="--report", help="HTML file to write; it opens without a network. An older report is replaced."),
]
OutOption = Annotated[
    str | None,
    Parameter(name="--out", allow_leading_hyphen=True, help="CSV file to write instead of the output."),
]


COMMANDS = {
    "analyse_ramp": "stiction valve-test analyse ramp",
    "analyse_steps": "stiction valve-test analyse step",
    "plan_ramp_test": "stiction valve-test plan ramp",
    "plan_step_test": "stiction valve-test plan step",
}
"""Function that a message names -> its command."""
OPTION_NAMES = {"time": "time_column", "value": "value_column", "quality": "quality_column"}
"""Argument of the reader -> its option, where the names differ."""


def reject_misplaced_options(files: Sequence[str], verb: Callable[..., int], name: str = "") -> None:
    """Refuse unknown options among the file names; "-" is the standard input.

    `name` is the name of the command, by default that of its function.

    Raises
    ------
    ParameterError
        When a name begins with a hyphen.
    """
    for file in files:
        if file.startswith("-") and file != "-":
            options = ["--json", *(f"--{option.replace('_', '-')}" for option in inspect.signature(verb).parameters)]
            close = difflib.get_close_matches(file, options, 1)
            hint = f" Did you mean {close[0]}?" if close else ""
            tries = f"Try: stiction {name or verb.__name__} --help (a file of that name is ./{file})."
            raise ParameterError(f"Unknown option: {file}.{hint} {tries}")


def option_text(setting: Setting) -> str:
    """Return a setting of a message as an option of the command line.

    Examples
    --------
    >>> option_text(Setting("columns", {"pv": None, "op": 2})), option_text(Setting("op_range", (0, 4095)))
    ('--column pv=NAME --column op=2', '--op-range 0 4095')
    >>> option_text(Setting("dt")), option_text(Setting("decimal", ",")), option_text(Setting("day_first", False))
    ('--dt', '--decimal ","', '--no-day-first')
    """
    if setting.name in COMMANDS:
        return COMMANDS[setting.name]
    value = setting.value
    if setting.name == "columns":
        columns = value or {"SIGNAL": None}
        pairs = (f"{signal}={'NAME' if column is None else column}" for signal, column in columns.items())
        return " ".join(f"--column {_quote(pair)}" for pair in pairs)
    option = OPTION_NAMES.get(setting.name, setting.name).replace("_", "-")
    if value is None or value is True:
        return f"--{option}"
    if value is False:
        return f"--no-{option}"
    values = value if isinstance(value, tuple) else (value,)
    return " ".join([f"--{option}", *(_quote(str(part)) for part in values)])


def _quote(text: str) -> str:
    """Return an argument as one word for a shell."""
    return text if re.fullmatch(r"[\w./:=+-]+", text) else f'"{text}"'

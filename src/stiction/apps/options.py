"""Options that several commands share."""

import difflib
import inspect
import re
from collections.abc import Callable, Sequence
from typing import Annotated

from cyclopts import Parameter

from stiction.errors import ParameterError

__all__ = ["JsonOption", "OutOption", "ReportOption", "TextOption", "in_options", "reject_misplaced_options"]

JsonOption = Annotated[bool, Parameter(name="--json", negative="", help="Print only JSON on the standard output.")]
TextOption = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
ReportOption = Annotated[str | None, Parameter(name="--report", help="HTML file to write; it opens without a network.")]
OutOption = Annotated[
    str | None,
    Parameter(name="--out", allow_leading_hyphen=True, help="CSV file to write instead of the output."),
]


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


def in_options(sentence: str) -> str:
    """Return what the reader says with its arguments in the words of the command line.

    Examples
    --------
    >>> in_options("say which is which with columns={'pv': ..., 'op': 2}.")
    'say which is which with --column pv=NAME --column op=2.'
    >>> in_options("give op_range=(0, 4095) to convert, or day_first=False.")
    'give --op-range 0 4095 to convert, or --no-day-first.'
    >>> in_options("give time_format='...' (--time-format) or dt= (--dt).")
    'give --time-format "..." or --dt.'
    >>> in_options("give op_range (--op-range) to convert it.")
    'give --op-range to convert it.'
    >>> in_options("raise the limit with max_bytes= or --max-bytes.")
    'raise the limit with --max-bytes.'
    >>> in_options("give controller=PID(Kc, Ti).")
    'give --controller pi:Kc=..,Ti=...'
    """

    def columns(found: re.Match[str]) -> str:
        pairs = re.findall(r"'(\w+)': ('[^']*'|[^,}]+)", found[1])
        return " ".join(f"--column {_word(f'{signal}={_bare(name)}')}" for signal, name in pairs)

    sentence = re.sub(r"columns=\{((?:'[^']*'|[^}'])*)\}", columns, sentence)
    sentence = re.sub(r"time_format='([^']*)'(?: \(--time-format\))?", r'--time-format "\1"', sentence)
    sentence = re.sub(r"(?<![\w./'-])time_format(?!\w|\.\w)", "--time-format", sentence)
    sentence = re.sub(r"\b(give|or) dt\b(?!=)", r"\1 --dt", sentence)
    sentence = re.sub(r"\bgive loop_type\b(?!=)", "give --loop-type", sentence)
    sentence = re.sub(r"\b(op|mv)_range=\(([^,]+), ([^)]+)\)", r"--\1-range \2 \3", sentence)
    sentence = re.sub(r"\bgive (op|mv)_range\b(?!=)(?: \(--\1-range\))?", r"give --\1-range", sentence)
    sentence = re.sub(r"decimal='(.)'", r'--decimal "\1"', sentence)
    sentence = sentence.replace("day_first=True", "--day-first").replace("day_first=False", "--no-day-first")
    sentence = sentence.replace("controller=PID(Kc, Ti)", "--controller pi:Kc=..,Ti=..")
    sentence = sentence.replace("columns=", "--column SIGNAL=NAME").replace(" (--columns)", "")
    sentence = re.sub(r"\b\w+= or (--[a-z-]+)", r"\1", sentence)
    return sentence.replace("dt= (--dt)", "--dt")


def _bare(name: str) -> str:
    return "NAME" if name == "..." else name.strip("'")


def _word(text: str) -> str:
    """An argument as a shell takes it for one word."""
    return text if re.fullmatch(r"[\w./:=+-]+", text) else f'"{text}"'

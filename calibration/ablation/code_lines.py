"""Lines of code of a part: without blanks, comments and docstrings."""

from __future__ import annotations

import ast
import io
import tokenize
from importlib.util import find_spec
from pathlib import Path

__all__ = ["count_code_lines", "lines_of_part"]

SKIPPED = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def count_code_lines(source: str, first: int = 1, last: int | None = None) -> int:
    """Count the lines of code of a source, or of a part of it.

    Parameters
    ----------
    source : str
        Source of a module.
    first, last : int
        First and last line that count [-].

    Returns
    -------
    int
        Lines with code, strings that stand alone left out.

    Examples
    --------
    >>> lines = ["'Text.'", "", "x = 1  # one", "y = (", "    2", ")"]
    >>> count_code_lines(chr(10).join(lines))
    4
    """
    alone = [
        (node.lineno, node.end_lineno or node.lineno)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]
    skipped = {line for start, end in alone for line in range(start, end + 1)}
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in SKIPPED:
            lines.update(range(token.start[0], token.end[0] + 1))
    return sum(first <= line <= (last or line) for line in lines - skipped)


def lines_of_part(places: tuple[str, ...], package: str = "stiction.diagnosis") -> int:
    """Count the lines of code of some modules, packages and functions.

    Parameters
    ----------
    places : tuple of str
        Modules or packages below `package`, or module:function.
    package : str
        Package of them all.

    Returns
    -------
    int
        Lines of code; 0 where a place no longer exists.

    Examples
    --------
    >>> lines_of_part(("oscillation.no_such_module",)) == 0
    True
    """
    total = 0
    for place in places:
        module, _, function = place.partition(":")
        spec = find_spec(f"{package}.{module}")
        if spec is None or spec.origin is None:
            continue
        files = [Path(spec.origin)]
        if spec.submodule_search_locations:
            files = sorted(Path(spec.origin).parent.rglob("*.py"))
        for file in files:
            source = file.read_text(encoding="utf-8")
            if not function:
                total += count_code_lines(source)
                continue
            for node in ast.parse(source).body:
                if isinstance(node, ast.FunctionDef) and node.name == function:
                    total += count_code_lines(source, node.lineno, node.end_lineno)
    return total

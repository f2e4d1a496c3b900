"""Sizes of the package and of some of its rooms, and their limits. Part of `make check`.

A line of code holds more than a comment, a docstring or nothing. A number is a numeric literal other than 0, 1 and 2
in an assignment of a module or a class, or the default of a parameter or a field.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "stiction"
LIMITS = {
    ".": {"lines": 75000},
    "apps": {"lines": 9800},
    "compensation": {"lines": 3800},
    "diagnosis": {"code": 6000, "lines": 10500, "numbers": 280},
    "diagnosis/evidence": {"code": 780},
    "diagnosis/identification": {"code": 2500, "files": 26},
    "diagnosis/verdict": {"code": 1150},
    "export": {"code": 1410},
    "fleet": {"lines": 6600},
    "limitcycle": {"lines": 4000},
    "models": {"lines": 4700},
    "records": {"lines": 4600},
    "report": {"lines": 5300},
    "simulation": {"lines": 2800},
    "sources": {"lines": 12500},
    "valvetests": {"lines": 2850},
    "watch": {"lines": 2500},
}
"""Largest allowed size of each room: at most a tenth above what it was when the limit was set."""
APART = ("diagnosis/evidence",)
"""Rooms that are not counted in the room that holds them."""
ADVICE = """A limit is reached. In this order:
1. Delete what is done twice: repeated lines, and a second path to the same result.
2. Move what only training, validation or tests need to calibration/ or tests/.
3. Use a library for what is not the purpose of the package.
4. If the room now does more than before, raise its limit in calibration/room_sizes.py to a tenth above its size, in a
   commit whose message says what was added."""
NOT_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


class Size(NamedTuple):
    """Size of a file or a room."""

    files: int
    code: int
    lines: int
    numbers: int


def docstring_lines(tree: ast.AST) -> set[int]:
    """Lines of strings that stand alone: docstrings of modules, classes, functions and fields."""
    alone = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    texts = [node for node in alone if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return {line for node in texts for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)}


def count_code(text: str) -> int:
    """Lines with code."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    lines = {line for token in tokens if token.type not in NOT_CODE for line in range(token.start[0], token.end[0] + 1)}
    return len(lines - docstring_lines(ast.parse(text)))


def count_numbers(text: str) -> int:
    """Numbers in assignments of modules and classes, and in defaults of parameters."""
    tree = ast.parse(text)
    bodies = [tree.body, *(node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))]
    values = [node.value for body in bodies for node in body if isinstance(node, ast.Assign | ast.AnnAssign)]
    for node in ast.walk(tree):
        if isinstance(node, ast.arguments):
            values += [*node.defaults, *node.kw_defaults]
    literals = [node.value for value in values if value for node in ast.walk(value) if isinstance(node, ast.Constant)]
    return sum(type(value) in (int, float) and value not in (0, 1, 2) for value in literals)


def measure(room: str) -> Size:
    """Size of a room with all rooms in it, but for `APART`."""
    left_out = [PACKAGE / one for one in APART if room not in (".", one)]
    paths = [path for path in (PACKAGE / room).rglob("*.py") if not any(path.is_relative_to(one) for one in left_out)]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    code, numbers = sum(map(count_code, texts)), sum(map(count_numbers, texts))
    return Size(len(texts), code, sum(text.count("\n") for text in texts), numbers)


def main() -> int:
    """Print the sizes; 1 where a limit is exceeded."""
    exceeded: list[str] = []
    print(f"{'room':28}{'files':>7}{'code':>7}{'lines':>7}{'numbers':>9}")
    for room in LIMITS:
        size = measure(room)
        print(f"{room if room != '.' else 'src/stiction':28}{size.files:7}{size.code:7}{size.lines:7}{size.numbers:9}")
        for name, limit in LIMITS[room].items():
            measured = getattr(size, name)
            if measured > limit:
                exceeded.append(f"{'src/stiction' if room == '.' else room}: {measured} {name}, at most {limit}")
    print("\n".join([*exceeded, ADVICE]) if exceeded else "sizes: within the limits")
    return 1 if exceeded else 0


if __name__ == "__main__":
    sys.exit(main())

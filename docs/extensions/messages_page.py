"""The list of messages that a user can meet, collected from the code: errors, and what the data checks say."""

from __future__ import annotations

import ast
import re
from html import escape
from pathlib import Path

import stiction

ERRORS = {
    "ParameterError": "Wrong arguments (exit code 2)",
    "RecordError": "Problems with data or files (exit code 3)",
    "MissingExtraError": "Missing extras (exit code 3)",
    "ConvergenceError": "Searches without a result (exit code 3)",
    "HTTPException": "Refused requests of the web page",
}
"""Class of an error -> heading of its messages."""
SUBCLASSES = {"EmptySignalError": "RecordError"}
"""Class of an error -> class under whose heading its messages stand."""


def collect_errors() -> dict[str, list[tuple[str, str]]]:
    """Return for each class of error its messages, values replaced by an ellipsis, and where each is raised."""
    root = Path(stiction.__file__).parent
    found: dict[str, list[tuple[str, str]]] = {name: [] for name in ERRORS}
    for path in sorted(root.rglob("*.py")):
        place = path.relative_to(root).with_suffix("").as_posix()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
                continue
            name = SUBCLASSES.get(node.func.id, node.func.id)
            if name not in ERRORS:
                continue
            fields = {keyword.arg: _text(keyword.value) for keyword in node.keywords}
            parts = node.args[1:] if name == "HTTPException" else node.args
            text = "".join(map(_text, parts)) + (f"; {fields['remedy']}." if "remedy" in fields else "")
            if text.strip(" …"):
                where = f"{fields['where']}: " if "where" in fields else ""
                found[name].append((" ".join(f"{where}{text}".split()), place))
    return {name: sorted(set(rows)) for name, rows in found.items()}


def _text(node: ast.expr) -> str:
    """Literal parts of a text; an ellipsis stands for a value, and a setting for itself."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    if isinstance(node, ast.Tuple):
        return "".join(_text(part) for part in node.elts)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Setting":
        return _text(node.args[0])
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _text(node.left) + _text(node.right)
    return "…"


def collect_check_texts() -> list[tuple[str, str]]:
    """Return the findings and remedies of the data checks, values replaced by an ellipsis, and the page of each."""
    texts: set[tuple[str, str]] = set()
    for path in sorted((Path(stiction.__file__).parent / "records" / "quality").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Assign | ast.AugAssign):
                targets = node.targets[0] if isinstance(node, ast.Assign) else node.target
                names = targets.elts if isinstance(targets, ast.Tuple) else [targets]
                values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
                pairs = [(ast.unparse(name), value) for name, value in zip(names, values, strict=False)]
            elif isinstance(node, ast.keyword):
                pairs = [(str(node.arg), node.value)]
            else:
                continue
            found = [_text(value) for name, value in pairs if name in ("finding", "remedy")]
            texts |= {(re.sub(r"\{\w+\}", "…", text).strip(" ,:"), path.stem) for text in found}
    return sorted((text, page) for text, page in texts if text.strip(" …"))


def messages_page() -> str:
    """The page."""
    errors, checks = collect_errors(), collect_check_texts()
    count = sum(map(len, errors.values())) + len(checks)
    parts = [
        f"# Messages\n\nThe {count} messages of errors and data checks. An ellipsis stands for a name or a number.\n"
    ]
    for name, rows in errors.items():
        parts.append(f"\n## {ERRORS[name]}\n\n| message | from |\n|---|---|\n")
        parts += [f"| {_cell(text)} | {place} |\n" for text, place in rows]
    parts.append("\n## Data checks\n\n| finding or remedy | check |\n|---|---|\n")
    parts += [f"| {_cell(text)} | {page.replace('_', ' ')} |\n" for text, page in checks]
    return "".join(parts)


def _cell(text: str) -> str:
    """A text in a cell of a table, without its signs being taken for Markdown."""
    shown = escape(text, quote=False)
    for sign in "\\`*_[]$|":
        shown = shown.replace(sign, f"&#{ord(sign)};")
    return shown

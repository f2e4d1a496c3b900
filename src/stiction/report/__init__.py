"""Figures, tables and pages that open offline. Nothing scientific is computed here.

`write_page` and the blocks serve any page (see `stiction.report.page`); `write_report` writes the loop report.
"""

from stiction.report.blocks import Block, Cell, Collapsible, Figure, Heading, SideBySide, Table, Text, TrustedHtml
from stiction.report.page import render_page, write_page
from stiction.report.report import write_report

__all__ = [
    "Block",
    "Cell",
    "Collapsible",
    "Figure",
    "Heading",
    "SideBySide",
    "Table",
    "Text",
    "TrustedHtml",
    "render_page",
    "write_page",
    "write_report",
]

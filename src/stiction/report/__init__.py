"""Figures, tables and pages that open offline. Nothing scientific is computed here.

`write_page` and the blocks serve any page (see `stiction.report.page`); `write_report` writes the loop report.
"""

from stiction.report.blocks import Block, Cell, Collapsible, Figure, Heading, SideBySide, Table, Text, TrustedHtml
from stiction.report.fleet_page import loop_page_path, write_audit_page, write_loop_page
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
    "loop_page_path",
    "render_page",
    "write_audit_page",
    "write_loop_page",
    "write_page",
    "write_report",
]

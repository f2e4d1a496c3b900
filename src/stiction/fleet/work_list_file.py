"""The work list as an Excel file that prints on A4."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.fleet.work_list import KINDS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.fleet.work_list import WorkItem

__all__ = ["write_work_list_file"]

COLUMNS = (("Work", 24), ("Area", 9), ("Loop", 15), ("Finding", 24), ("S", 7), ("What to do", 44), ("Check first", 34),
           ("Test", 16), ("Why here", 38), ("Look at again after it", 24), ("Crew", 18), ("State", 9), ("Note", 26),
           ("Result", 22), ("Done by, date", 16))  # fmt: skip
"""Heading and width of each column [characters]."""


def write_work_list_file(items: Sequence[WorkItem], path: Path) -> Path:
    """Write the work list as an Excel file: one row for each item, landscape, one page wide, headings on each page.

    Raises
    ------
    RecordError
        When it cannot be written; the old file stays.
    """
    import xlsxwriter
    from xlsxwriter.exceptions import FileCreateError

    part = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with xlsxwriter.Workbook(str(part), {"strings_to_formulas": False, "strings_to_urls": False}) as book:
            sheet = book.add_worksheet("Work list")
            text = book.add_format({"text_wrap": True, "valign": "top", "border": 1, "border_color": "#D5DAE0"})
            head = book.add_format({"bold": True, "text_wrap": True, "bg_color": "#E4E8EB", "border": 1})
            for k, (name, width) in enumerate(COLUMNS):
                sheet.set_column(k, k, width, text)
                sheet.write_string(0, k, name, head)
            for row, item in enumerate(items, 1):
                cells = (
                    KINDS[item.kind][0], item.area, item.tag, item.finding_text, item.S, item.task, item.check,
                    item.test, item.why, ", ".join(item.follow), item.crew, item.state, item.note, item.result, "",
                )  # fmt: skip
                for k, cell in enumerate(cells):
                    sheet.write_string(row, k, cell, text)
            sheet.autofilter(0, 0, len(items), len(COLUMNS) - 1)
            sheet.freeze_panes(1, 3)
            sheet.set_landscape()
            sheet.set_paper(9)
            sheet.fit_to_pages(1, 0)
            sheet.repeat_rows(0)
            sheet.set_footer("&L&F&RPage &P of &N")
        os.replace(part, path)
    except (OSError, FileCreateError) as error:
        raise RecordError(f"cannot be written ({error}); close it in other programs.", where=path) from None
    finally:
        part.unlink(missing_ok=True)
    return path

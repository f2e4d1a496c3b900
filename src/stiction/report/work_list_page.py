"""Pages of a work list: the list itself, and a work order for each of the worst valves; both print on A4."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from stiction.atomic_write import write_atomically
from stiction.fleet.work_list import KINDS
from stiction.report.page import _asset
from stiction.report.rendering import environment

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.compensation.work_order import WorkOrder
    from stiction.fleet import Audit
    from stiction.fleet.work_list import WorkItem

__all__ = ["write_order_page", "write_work_list_page"]


def write_work_list_page(audit: Audit, items: Sequence[WorkItem], orders: dict[str, str], path: Path) -> Path:
    """Write the page of a work list.

    Parameters
    ----------
    audit : Audit
        The audit.
    items : sequence of WorkItem
        Its work list.
    orders : dict of str to str
        Tag -> file of its work order, relative to the page.
    path : Path
        File to write.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    RecordError
        When it cannot be written.
    """
    from markupsafe import Markup

    from stiction import __version__

    sections = [
        {
            "kind": kind,
            "title": KINDS[kind][0],
            "crew": KINDS[kind][1],
            "areas": [(area, list(chosen)) for area, chosen in groupby(of_kind, key=lambda one: one.area)],
            "count": len(of_kind),
        }
        for kind in KINDS
        if (of_kind := [one for one in items if one.kind == kind])
    ]
    listed = {item.tag for item in items}
    left = [row for row in audit.rows if row.tag not in listed]
    following = [row for row in left if row.follows is not None]
    alone = [row for row in left if row.follows is None]
    fine = sum(row.finding == "nothing_found" for row in alone)
    waiting = sum(row.waits for row in alone)
    page = (
        environment()
        .get_template("worklist.html")
        .render(
            audit=audit,
            counts=audit.counts,
            sections=sections,
            orders=orders,
            waiting=waiting,
            following=len(following),
            fine=fine,
            elsewhere=len(alone) - fine - waiting,
            style=Markup(_asset("page.css") + _asset("worklist.css")),
            version=__version__,
        )
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_atomically(page, path)


def write_order_page(order: WorkOrder, item: WorkItem, path: Path) -> Path:
    """Write the work order of one valve as a page that prints on A4."""
    from markupsafe import Markup

    style = Markup(_asset("page.css") + _asset("worklist.css"))
    page = environment().get_template("workorder.html").render(order=order, item=item, style=style)
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_atomically(page, path)

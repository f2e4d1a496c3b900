"""``stiction worklist``: what a plant has to do after an audit, as table, page, Excel file and work orders."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stiction.apps.options import JsonOption
from stiction.errors import ParameterError, RecordError, StictionError

if TYPE_CHECKING:
    from stiction.fleet import Audit
    from stiction.fleet.work_list import WorkItem

__all__ = ["worklist"]


@Parameter(name="*")
@dataclass(frozen=True)
class MarkOptions:
    """The state of one item.

    Parameters
    ----------
    mark
        Note a state first, such as FIC-101=done: planned, done, rejected, or open to open it again.
    note
        Text of the note of --mark.
    author
        Who writes the note of --mark.
    """

    mark: str | None = None
    note: str = ""
    author: str = ""


def worklist(
    audit: Annotated[str, Parameter(name="AUDIT", help="Folder of an audit.")],
    /,
    *,
    out: str | None = None,
    orders: int = 5,
    earlier: str | None = None,
    as_json: JsonOption = False,
    state: MarkOptions = MarkOptions(),
) -> int:
    """List what to repair, retune, test and look at after an audit, by area and crew.

    Writes a page and an Excel file, both to print, and a work order for each of the worst valves. Loops that oscillate
    with another are not on the list. Exit code 1 when there is an open item, else 0.

    Parameters
    ----------
    out
        Folder to write to; worklist in the folder of the audit when not given.
    orders
        Work orders to write, for the worst valves; 5 when not given.
    earlier
        Folder of an earlier audit: its notes count, and its sizes are those before the work.
    as_json
        Print the items as JSON, and nothing else, on the output.
    """
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.atomic_write import may_write
    from stiction.fleet import open_audit, work_list
    from stiction.fleet.work_list_file import write_work_list_file
    from stiction.report.work_list_page import write_work_list_page

    if orders < 0:
        raise ParameterError(f"--orders {orders} is negative; give 0 or more.")
    found, other = open_audit(audit), None if earlier is None else open_audit(earlier)
    if state.mark is not None:
        _mark(found, state)
    elif state.note or state.author:
        raise ParameterError(f"{'--note' if state.note else '--author'} belongs to --mark; add --mark TAG=STATE.")
    folder = Path(out) if out else found.folder / "worklist"
    _require_own_folder(folder)
    items = work_list(found, other)
    shown = [f"\n{folder} cannot be written to: page, Excel file and work orders were not written. Give --out FOLDER."]
    if may_write(folder):
        written = _write_orders(found, items, orders, folder)
        table = write_work_list_file(items, folder / "worklist.xlsx")
        page = write_work_list_page(found, items, written, folder / "index.html")
        shown = [f"\nPage:   {page}\nExcel:  {table}"]
        shown += [f"Orders: {folder / 'orders'} ({len(written)}, linked in the page)"] if written else []
    if as_json:
        print_json([item.to_dict() for item in items])
    else:
        _print_items(items)
    for text in shown:
        (print_err if as_json else print_out)(text)
    return int(any(item.state == "open" for item in items))


def _require_own_folder(folder: Path) -> None:
    """Refuse a folder whose page is not a work list."""
    if folder.exists() and not folder.is_dir():
        raise RecordError("is a file; --out names a folder, give another one.", where=folder)
    if (folder / "index.html").exists() and not (folder / "worklist.xlsx").exists():
        raise RecordError("holds another page; give --out a folder of its own.", where=folder / "index.html")


def _mark(audit: "Audit", state: MarkOptions) -> None:
    """Write the note that gives an item its state."""
    from stiction.fleet.labels import append_label
    from stiction.fleet.work_list import STATES

    tag, _, word = (state.mark or "").rpartition("=")
    if not tag:
        raise ParameterError(f"--mark {state.mark} has no state; write a tag and a state, such as FIC-101=done.")
    if word not in STATES:
        raise ParameterError(f"--mark {state.mark}: {word!r} is not a state; give one of {', '.join(STATES)}.")
    audit.row(tag)
    append_label(audit.folder, tag, "acknowledged" if word == "open" else word, state.note, state.author)


def _write_orders(audit: "Audit", items: "tuple[WorkItem, ...]", count: int, folder: Path) -> dict[str, str]:
    """Write the work orders of the worst valves; a valve whose record cannot be read is named, and left out."""
    from stiction import work_order
    from stiction.apps.output import print_err, track
    from stiction.atomic_write import safe_file_name
    from stiction.report.work_list_page import write_order_page

    valves = [item for item in items if item.kind == "repair" and item.state in ("open", "planned")]
    valves = [one for one in valves if audit.row(one.tag).verdict == "stiction"]
    chosen = sorted(valves, key=lambda item: -item.priority)[:count]
    written, taken = {}, set[str]()
    for item in track(chosen, "Writing work orders"):
        names = [safe_file_name(item.tag), *(f"{safe_file_name(item.tag)}-{k}" for k in range(2, len(chosen) + 1))]
        name = next(name for each in names if (name := f"orders/{each}.html").casefold() not in taken)
        taken.add(name.casefold())
        try:
            order = work_order(audit.diagnose(audit.read(item.tag)))
            write_order_page(order, item, folder / name)
            written[item.tag] = name
        except StictionError as error:
            print_err(f"The work order of {item.tag} was not written: {error}")
    return written


def _print_items(items: "tuple[WorkItem, ...]") -> None:
    """Print the items by kind of work."""
    from stiction.apps.output import print_out, print_table
    from stiction.display.number_format import count_noun
    from stiction.fleet.work_list import KINDS

    if not items:
        print_out("There is nothing to do.")
    for kind, (title, crew) in KINDS.items():
        chosen = [item for item in items if item.kind == kind]
        if not chosen:
            continue
        print_out(f"\n{title}: {count_noun(len(chosen), 'loop')} ({crew})")
        rows = [
            [item.area, item.tag, item.finding_text, item.task, item.test, item.S, item.state_text] for item in chosen
        ]
        print_table(["Area", "Loop", "Finding", "What to do", "Test", "S", "State"], rows)

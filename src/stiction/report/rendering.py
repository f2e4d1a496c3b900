"""From blocks to markup: the templates, which escape all text, and the format of table cells."""

from __future__ import annotations

from functools import cache
from numbers import Real
from typing import TYPE_CHECKING, Any

from stiction.display.duration_format import format_duration, format_time
from stiction.display.number_format import count_noun, format_number, format_probability
from stiction.display.visible_text import visible
from stiction.report.blocks import Cell, TrustedHtml
from stiction.report.plot_json import to_json

if TYPE_CHECKING:
    import jinja2

    from stiction.report.blocks import Block, Table

__all__ = ["environment", "format_cell", "render_fragment"]


def render_fragment(template: str, **values: Any) -> TrustedHtml:
    """Render one of the templates of the report; the values are escaped."""
    return TrustedHtml(environment().get_template(template).render(**values))


@cache
def environment() -> jinja2.Environment:
    """Return the templates, read once, with the filters they use."""
    import jinja2
    from markupsafe import Markup

    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        finalize=lambda value: value if hasattr(value, "__html__") or not isinstance(value, str) else visible(value),
    )

    def show(block: Block) -> Markup:
        name = type(block).__name__.lower()
        return Markup(templates.get_template(f"{name}.html").render(block=block))

    templates.filters.update(show=show, cell=_cell, format_cell=format_cell, numeric=_numeric, room=_room)
    templates.filters.update(time=format_time, count=count_noun)
    templates.filters.update(probability=format_probability, duration=format_duration)
    templates.filters["payload"] = lambda plot: Markup(to_json(plot))
    templates.filters["markup"] = lambda block: Markup(block.markup)
    templates.tests["html"] = lambda value: isinstance(value, TrustedHtml)
    return templates


def format_cell(value: str | float | None) -> str:
    """Return a table value as text: four significant digits, a dash for a missing value.

    Examples
    --------
    >>> format_cell(3.14159), format_cell(1234567.0), format_cell(float("nan")), format_cell(0.00004)
    ('3.142', '1234567', '–', '4e-05')
    """
    if isinstance(value, str):
        return value
    return "–" if value is None else format_number(value, significant=4)


def _cell(value: Any) -> Cell:
    return value if isinstance(value, Cell) else Cell(value)


def _is_number(cell: Cell) -> bool:
    return cell.value is None or (isinstance(cell.value, Real) and not isinstance(cell.value, bool))


def _numeric(table: Table) -> list[bool]:
    """Which columns hold numbers only."""
    return [
        bool(column) and all(_is_number(_cell(cell)) for cell in column) for column in zip(*table.rows, strict=True)
    ]


def _room(cell: Cell) -> str:
    """Class of a text cell: short ones keep to a line, long ones get width."""
    length = len(cell.value) if isinstance(cell.value, str) else 0
    return "long" if length > 40 else "middling" if length > 24 else "short"

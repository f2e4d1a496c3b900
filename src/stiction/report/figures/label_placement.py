"""Placement of the names of points, so that no name covers another."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["PLOT_SIZE_PX", "place_labels"]

PLOT_SIZE_PX = (300.0, 330.0)
"""Size of the plot for which names are placed: a telephone screen [px]. A wider plot has more room."""
SHARED_LABEL_DISTANCE_PX = (12.0, 13.0)
"""Points nearer than this, across and upright, share one text [px]."""
LETTER, LINE = 6.3, 14.0
"""Width of a letter and height of a line [px]."""
LABEL_POSITIONS = (
    "middle right", "middle left", "top center", "bottom center", "top right", "top left", "bottom right",
    "bottom left",
)  # fmt: skip
"""Positions of a text relative to its point, the best first."""

Box = tuple[float, float, float, float]


def place_labels(names: Sequence[str], at: Sequence[tuple[float, float]]) -> list[tuple[str, str]]:
    """Place each name next to its point, where it covers no point and no other name, or as little as possible.

    `names`: Names; marks such as <b> take no room. `at`: points from the lower left corner of `PLOT_SIZE_PX` [px].
    Returns text and position of each point, as plotly names positions; a point that shares the text of another has no
    text.

    Examples
    --------
    >>> place_labels(["a", "b", "far"], [(100.0, 100.0), (101.0, 100.0), (200.0, 300.0)])
    [('a<br>b', 'middle right'), ('', 'middle right'), ('far', 'middle right')]
    """
    groups: list[list[int]] = []
    for k, (x, y) in enumerate(at):
        near = (
            g
            for g in groups
            if abs(at[g[0]][0] - x) < SHARED_LABEL_DISTANCE_PX[0] and abs(at[g[0]][1] - y) < SHARED_LABEL_DISTANCE_PX[1]
        )
        group = next(near, None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    taken = [(x - 6.0, y - 6.0, x + 6.0, y + 6.0) for x, y in at]
    placed = [("", LABEL_POSITIONS[0])] * len(at)
    for group in sorted(groups, key=lambda group: -len(group)):
        texts = [names[k] for k in group]
        width = LETTER * max(len(text.replace("<b>", "").replace("</b>", "")) for text in texts)
        others = [box for j, box in enumerate(taken) if j not in group]
        boxes = [_box(at[group[0]], place, width, LINE * len(group)) for place in LABEL_POSITIONS]
        covered = [sum(_overlap_area(box, other) for other in others) + _outside_area(box) for box in boxes]
        best = covered.index(min(covered))
        placed[group[0]] = ("<br>".join(texts), LABEL_POSITIONS[best])
        taken.append(boxes[best])
    return placed


def _box(at: tuple[float, float], place: str, width: float, height: float) -> Box:
    """Left, lower, right and upper edge of a text [px]."""
    upright, across = place.split()
    left = {"right": at[0] + 7.0, "left": at[0] - 7.0 - width, "center": at[0] - 0.5 * width}[across]
    low = {"top": at[1] + 7.0, "middle": at[1] - 0.5 * height, "bottom": at[1] - 7.0 - height}[upright]
    return left, low, left + width, low + height


def _overlap_area(a: Box, b: Box) -> float:
    """Area that two boxes share [px squared]."""
    return max(min(a[2], b[2]) - max(a[0], b[0]), 0.0) * max(min(a[3], b[3]) - max(a[1], b[1]), 0.0)


def _outside_area(box: Box) -> float:
    """Area of a box outside the plot [px squared]."""
    return (box[2] - box[0]) * (box[3] - box[1]) - _overlap_area(box, (0.0, 0.0, *PLOT_SIZE_PX))

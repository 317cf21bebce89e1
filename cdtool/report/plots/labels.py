"""Labels of limits in a plot, written where they do not hide anything; on white where there is no such place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.report.plots.figures import text_width
from cdtool.report.plots.style import LIMIT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Bbox

#: Points, chosen by eye: below those of the axes.
_SIZE = 7
# From a line to the label's foot, tried in this order [points].
_LIFTS = (2.0, 9.0, 18.0, 27.0)


@dataclass(frozen=True)
class LineLabel:
    """The label of a horizontal line from `begin` to `end` at `height`, in the units of the axes."""

    text: str
    begin: float
    end: float
    height: float


def place_labels(axes: Axes, labels: Sequence[LineLabel], curves: Sequence[tuple[FloatArray, FloatArray]]) -> None:
    """Write each label above its line, as far left as it does not hide anything; else at the left end, on white.

    Call it after the figure is arranged and everything else is drawn.
    """
    from matplotlib.transforms import Bbox

    points = axes.figure.dpi / 72.0
    to_pixels = axes.transData.transform
    drawn = [to_pixels(np.column_stack(curve)) for curve in curves]
    taken = [text.get_window_extent() for text in axes.texts]
    for label in labels:
        (left, line), (right, _) = to_pixels([(label.begin, label.height), (label.end, label.height)])
        width = text_width([label.text], _SIZE) * 72.0 * points
        begin = left + 4.0 * points
        starts = np.linspace(begin, max(right - width - points, begin), 30)
        boxes = [
            Bbox.from_bounds(start, line + lift * points, width, 9.0 * points)
            for lift, start in product(_LIFTS, starts.tolist())
        ]
        free = next((box for box in boxes if _free(box, drawn, taken)), None)
        box = free or boxes[0]
        taken.append(box)
        axes.annotate(
            label.text,
            (label.begin, label.height),
            # In whole tenths: the last bits of a position differ between runs.
            xytext=(round((box.x0 - left) / points, 1), round((box.y0 - line) / points, 1)),
            textcoords="offset points",
            fontsize=_SIZE,
            color=LIMIT,
            bbox=None if free else {"facecolor": "white", "alpha": 0.75, "linewidth": 0, "pad": 0.5},
            zorder=5,
        )


def _free(box: Bbox, curves: Sequence[FloatArray], taken: Sequence[Bbox]) -> bool:
    return not (any(box.overlaps(other) for other in taken) or any(_crosses(curve, box) for curve in curves))


def _crosses(curve: FloatArray, box: Bbox) -> bool:
    """Return whether a curve (n, 2) with rising x crosses the box, at or between its samples."""
    x, y = curve.T
    if box.x1 < x[0] or box.x0 > x[-1]:
        return False
    inside = y[(x > box.x0) & (x < box.x1)]
    heights = np.concatenate((inside, np.interp([box.x0, box.x1], x, y)))
    return bool(heights.min() <= box.y1 and heights.max() >= box.y0)

"""Labels of curves and limits in a plot, written where they do not hide anything.

A curve without room for its label has none; a limit always has one, on white where it would hide something.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.report.plots.figures import text_width
from cdtool.report.plots.style import LIMIT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Bbox

#: Points, chosen by eye: below those of the axes.
_SIZE, _LIMIT_SIZE = 7.5, 7
# Distance between the samples of a line that a label must not cover [points]: less than a letter.
_SAMPLED = 3.0
# From a line to the label's foot, tried in this order [points].
_LIFTS = (2.0, 9.0, 18.0, 27.0)


@dataclass(frozen=True)
class Labelled:
    """A curve (n,) in the panel's scale, its name, and the indices (m,) of points for its label, the best one first."""

    text: str
    colour: str
    x: FloatArray
    y: FloatArray
    places: np.ndarray


def write_labels(axes: Axes, curves: Sequence[Labelled]) -> list[str]:
    """Write each label above or below its curve, clear of all others; return those that are written.

    The position, limits and scales of the panel must be final.
    """
    points = 72.0 / axes.figure.dpi
    lines = [points * axes.transData.transform(np.column_stack((curve.x, curve.y))) for curve in curves]
    sampled = [_sampled(line) for line in lines]
    frame = points * axes.bbox.get_points()
    names = np.empty((0, 2))
    written: list[str] = []
    for i, (curve, line) in enumerate(zip(curves, lines, strict=True)):
        size = np.array([72.0 * text_width([curve.text], _SIZE), _SIZE])
        others = np.concatenate([names, *(item for k, item in enumerate(sampled) if k != i)])
        corner = _free_corner(line[curve.places], size, sampled[i], others, frame)
        if corner is None:
            continue
        middle = corner + 0.5 * size
        axes.annotate(
            curve.text,
            tuple((middle - frame[0]).tolist()),
            xycoords="axes points",
            ha="center",
            va="center",
            fontsize=_SIZE,
            color=curve.colour,
            fontweight="bold",
            zorder=8,
        )
        names = np.concatenate((names, _filled(corner, size)))
        written.append(curve.text)
    return written


def _free_corner(
    places: FloatArray, size: FloatArray, own: FloatArray, others: FloatArray, frame: FloatArray
) -> FloatArray | None:
    """Return the lower left corner of the first position where a text of a size covers nothing and is in the frame."""
    sides = np.array([(-0.5 * size[0], 3.5), (-0.5 * size[0], -3.5 - size[1])])
    for corner in (place + side for place in places for side in sides):
        inside = np.all(corner >= frame[0] + 1.0) and np.all(corner + size <= frame[1] - 1.0)
        if inside and not _covers(corner, size, own, 1.0) and not _covers(corner, size, others, 5.0):
            return np.asarray(corner)
    return None


def _covers(corner: FloatArray, size: FloatArray, points: FloatArray, clear: float) -> bool:
    return bool(np.any(np.all((points > corner - clear) & (points < corner + size + clear), axis=1)))


def _sampled(line: FloatArray) -> FloatArray:
    """Return points along a line at short distances, which a label must not cover."""
    found = [line]
    for start, end in pairwise(line):
        count = int(np.hypot(*(end - start)) / _SAMPLED)
        found.append(start + np.linspace(0.0, 1.0, count + 2)[1:-1, np.newaxis] * (end - start))
    return np.concatenate(found)


def _filled(corner: FloatArray, size: FloatArray) -> FloatArray:
    """Return points all over a label, which other labels must not cover."""
    x, y = np.meshgrid(np.arange(0.0, size[0] + _SAMPLED, _SAMPLED), np.arange(0.0, size[1] + _SAMPLED, _SAMPLED))
    return np.asarray(corner + np.column_stack((x.ravel(), y.ravel())))


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
        width = text_width([label.text], _LIMIT_SIZE) * 72.0 * points
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
            fontsize=_LIMIT_SIZE,
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

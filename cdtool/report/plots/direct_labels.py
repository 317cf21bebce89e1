"""Names written beside curves where they hide nothing; where there is no room, none is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cdtool.recording import FloatArray
from cdtool.report.plots.figures import text_width

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE = 7.5
# Distances in points: from a point to its name, to all else, which has to be further away; between samples of a line.
_AWAY, _CLEAR, _SAMPLED = 3.5, 5.0, 3.0


@dataclass(frozen=True)
class Labelled:
    """A curve (n,) in the panel's scale, its name, and the points (m,) where the name may stand, the best one first."""

    text: str
    colour: str
    x: FloatArray
    y: FloatArray
    places: np.ndarray


def write_labels(axes: Axes, curves: Sequence[Labelled]) -> list[str]:
    """Write each name above or below its curve, clear of all others; returns those that are written.

    The panel's place, limits and scales have to be final.
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
    """Lower left corner of the first place where a text of that size covers nothing and stays in the frame."""
    sides = np.array([(-0.5 * size[0], _AWAY), (-0.5 * size[0], -_AWAY - size[1])])
    for corner in (place + side for place in places for side in sides):
        inside = np.all(corner >= frame[0] + 1.0) and np.all(corner + size <= frame[1] - 1.0)
        if inside and not _covers(corner, size, own, 1.0) and not _covers(corner, size, others, _CLEAR):
            return np.asarray(corner)
    return None


def _covers(corner: FloatArray, size: FloatArray, points: FloatArray, clear: float) -> bool:
    return bool(np.any(np.all((points > corner - clear) & (points < corner + size + clear), axis=1)))


def _sampled(line: FloatArray) -> FloatArray:
    """Points along a line, a few points apart: what a name may not cover."""
    found = [line]
    for start, end in pairwise(line):
        count = int(np.hypot(*(end - start)) / _SAMPLED)
        found.append(start + np.linspace(0.0, 1.0, count + 2)[1:-1, np.newaxis] * (end - start))
    return np.concatenate(found)


def _filled(corner: FloatArray, size: FloatArray) -> FloatArray:
    """Points all over a name: other names keep clear of it."""
    x, y = np.meshgrid(np.arange(0.0, size[0] + _SAMPLED, _SAMPLED), np.arange(0.0, size[1] + _SAMPLED, _SAMPLED))
    return np.asarray(corner + np.column_stack((x.ravel(), y.ravel())))

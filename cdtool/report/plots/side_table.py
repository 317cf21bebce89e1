"""Columns of numbers right of a panel, which its marks must be read with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cdtool.report.number_text import NOTHING
from cdtool.report.plots.figures import Margins, label, stacked_panels, text_width, write
from cdtool.report.plots.style import line_of, look_of
from cdtool.report.table import shown
from cdtool.results.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a line, and how far the names of detectors are moved in [points], chosen by eye.
_ROW, _INDENT = 12.5, 30.0
# A detector's name is cut to this length.
NAME_LENGTH = 24


@dataclass(frozen=True)
class SideColumn:
    """A heading of one or two lines, and the width of the column [points]; `left`: its texts are left-aligned."""

    heading: str
    width: float
    left: bool = False


@dataclass(frozen=True)
class _CellLine:
    """The position of a line of cells: `y` in `coordinates`, lifted by `lift` [points]; `size` of its letters."""

    coordinates: object
    y: float
    lift: float = 0.0
    side: str = "center"
    size: float = 8


@dataclass(frozen=True)
class SideTable:
    """Columns right of the panels of a figure, the first one `gap` [points] from their edge."""

    columns: Sequence[SideColumn]
    gap: float = 10.0

    @property
    def width(self) -> float:
        """The width of all columns with the gap [inch]."""
        return (self.gap + sum(column.width for column in self.columns)) / 72.0

    def write_headings(self, axes: Axes) -> None:
        """Write the headings above the panel's upper edge."""
        for i, column in enumerate(self.columns):
            self._write(axes, i, column.heading, _CellLine("axes fraction", 1.0, 4.0, "bottom", 7.5))

    def write_row(self, axes: Axes, y: float, cells: Sequence[str], loud: Sequence[bool]) -> None:
        """Write a row at height `y` in the panel's scale; `loud` cells are bold."""
        for i, (cell, bold) in enumerate(zip(cells, loud, strict=True)):
            self._write(axes, i, cell, _CellLine(axes.get_yaxis_transform(), y), bold)

    def write_key(self, axes: Axes, row: int, detector: str, cells: Sequence[str], loud: Sequence[bool]) -> None:
        """Write a row counted from the panel's upper edge: the detector's mark and name, then the cells."""
        from matplotlib.lines import Line2D

        lift, look, points = -_ROW * (row + 0.5), look_of(detector), 72.0 / axes.figure.dpi * np.asarray(axes.bbox.size)
        mark = Line2D(
            1.0 + (self.gap + np.array([0.0, 0.45, 0.9]) * _INDENT) / points[0],
            np.full(3, 1.0 + lift / points[1]),
            transform=axes.transAxes,
            **line_of(look),
            linewidth=1.5,
            marker=look.marker,
            markevery=[1],
            markersize=5.5,
            clip_on=False,
        )
        axes.add_line(mark)
        self._write(axes, 0, label(detector, NAME_LENGTH), _CellLine("axes fraction", 1.0, lift), indent=_INDENT)
        for i, (cell, bold) in enumerate(zip(cells, loud, strict=True), 1):
            self._write(axes, i, cell, _CellLine("axes fraction", 1.0, lift), bold)

    def _write(
        self, axes: Axes, number: int, text: str, line: _CellLine, bold: bool = False, indent: float = 0.0
    ) -> None:
        column = self.columns[number]
        before = self.gap + sum(item.width for item in self.columns[:number])
        offset = before + (indent if column.left else 0.5 * column.width)
        side, weight = "left" if column.left else "center", "bold" if bold else "normal"
        look = {"ha": side, "va": line.side, "fontsize": line.size, "fontweight": weight}
        write(axes, text, (1.0, line.y), (offset, line.lift), line.coordinates, **look)


def count_cells(row: Summary) -> tuple[tuple[str, ...], tuple[bool, ...]]:
    """Return the cells of detected, missed and not assessable contacts and false alarms, and which are bold."""
    false_alarms = str(row.false_alarms) if row.watched else NOTHING
    cells = (f"{row.detected} of {row.contacts}", str(row.missed), str(row.not_assessable), false_alarms)
    return cells, (False, row.missed > 0, row.not_assessable > 0, row.false_alarms > 0)


def keyed_panels(
    rows: Mapping[str, Sequence[Summary]], columns: Sequence[SideColumn], size: tuple[float, float], bottom: float
) -> tuple[Figure, list[Axes], SideTable]:
    """Return a panel of at least `size` [inch] for each group, and the table whose rows are the key of its detectors.

    `bottom` is the margin below the panels [inch]. For use within `drawing()`.
    """
    names = [label(item.detector, NAME_LENGTH) for items in rows.values() for item in items]
    table = SideTable((SideColumn("", 72.0 * text_width(names, 8) + _INDENT + 8.0, left=True), *columns))
    heights = [max(size[1], _ROW * len(items) / 72.0 + 0.1) for items in rows.values()]
    margins = Margins(0.75, table.width + 0.1, 0.5, bottom)
    figure, panels = stacked_panels(margins.left + size[0] + margins.right, heights, margins, gap=0.36)
    for axes, group in zip(panels, rows, strict=True):
        axes.set_title(label(shown(group), 60), loc="left", fontweight="bold", y=1.0)
    table.write_headings(panels[0])
    return figure, panels, table

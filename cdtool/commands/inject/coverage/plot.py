"""The coverage map: latency over position and stiffness, a panel per detector."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.base.plain_text import digits
from cdtool.commands.inject.coverage.coverage_map import CellKey, CoverageMap, MapCell
from cdtool.report.plots.figures import drawing, label, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMNS = 2
# Pale for fast, dark for slow, distinct in grey print.
_COLOURS = "viridis_r"
_MISSED = "0.25"
_TICKS = (1, 2, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000, 2000)


def plot_coverage(coverage: CoverageMap, machine: str, path: Path) -> None:
    """Draw a panel per detector: mean latency [ms] in each cell, hatched where most contacts are missed.

    The second line of a cell is the force at the alarm [N]. Raises UsageError, CdtoolError (see `save`).
    """
    with drawing():
        rows = math.ceil(len(coverage.cells) / _COLUMNS)
        columns = min(_COLUMNS, len(coverage.cells))
        width = max(2.8, 0.5 * len(coverage.positions) + 0.9)
        height = max(2.0, 0.34 * len(coverage.stiffnesses) + 0.8)
        figure = new_figure(columns * width + 0.8, rows * height + 0.5)
        panels = np.atleast_1d(figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)).ravel()
        norm = _scale(coverage)
        image: Any = None
        for panel, (name, cells) in zip(panels, coverage.cells.items(), strict=False):
            image = _draw(panel, coverage, cells, norm)
            panel.set_title(label(name), loc="left")
        for panel in panels[len(coverage.cells) :]:
            panel.set_visible(False)
        for index, panel in enumerate(panels[: len(coverage.cells)]):
            if index % columns == 0:
                panel.set_ylabel("stiffness [N/mm]")
            if index + columns >= len(coverage.cells):
                panel.tick_params(labelbottom=True)
                panel.set_xlabel(f"position [{coverage.unit}]")
        ticks = [tick for tick in _TICKS if norm.vmin <= tick <= norm.vmax]
        bar = figure.colorbar(image, ax=list(panels), shrink=0.8, pad=0.01, aspect=30, ticks=ticks)
        bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
        bar.minorticks_off()
        bar.set_label("latency [ms]")
        figure.suptitle(
            f"{label(machine)}: injected contacts, latency in ms (above) and force at the alarm in N", fontsize=9
        )
        save(figure, path)


def _scale(coverage: CoverageMap) -> Any:
    from matplotlib.colors import LogNorm

    values = [cell.latency_ms for cells in coverage.cells.values() for cell in cells.values()]
    known = [max(value, 1.0) for value in values if math.isfinite(value)] or [1.0, 10.0]
    return LogNorm(min(known), max(max(known), 1.01 * min(known)))


def _draw(axes: Axes, coverage: CoverageMap, cells: Any, norm: Any) -> Any:
    shape = (len(coverage.stiffnesses), len(coverage.positions))
    values = np.full(shape, np.nan)
    for row, stiffness in enumerate(coverage.stiffnesses):
        for column, position in enumerate(coverage.positions):
            cell = cells.get(CellKey(position, stiffness))
            if cell is not None:
                values[row, column] = max(cell.latency_ms, 1.0) if math.isfinite(cell.latency_ms) else np.nan
                _write(axes, cell, (column, row), norm)
    image = axes.imshow(values, norm=norm, cmap=_COLOURS, origin="lower", aspect="auto")
    axes.set_xticks(range(shape[1]), [f"{position:.3g}" for position in coverage.positions])
    axes.set_yticks(range(shape[0]), [digits(float(f"{item / 1e3:.2g}")) for item in coverage.stiffnesses])
    return image


def _write(axes: Axes, cell: MapCell, at: tuple[int, int], norm: Any) -> None:
    column, row = at
    if cell.missed:
        from matplotlib.patches import Rectangle

        face = _MISSED if cell.misses_most else "none"
        axes.add_patch(
            Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, hatch="////", facecolor=face, edgecolor="0.6", zorder=2)
        )
    text = "-" if math.isnan(cell.latency_ms) else f"{cell.latency_ms:.0f}"
    low, high = cell.range_ms
    if math.isfinite(low) and high - low > 1.0:
        text = f"{low:.0f}–{high:.0f}"
    if cell.missed:
        text = f"{cell.missed} of {cell.contacts}\nmissed"
    elif math.isfinite(cell.force_n):
        text += f"\n{cell.force_n:.0f} N"
    dark = cell.misses_most or (math.isfinite(cell.latency_ms) and norm(max(cell.latency_ms, 1.0)) > 0.45)
    axes.text(column, row, text, ha="center", va="center", fontsize=6.0, color="white" if dark else "black", zorder=3)

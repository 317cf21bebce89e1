"""Median latency against false alarms, with the limits of every detector moved (AMOC): a panel per group.

The horizontal axis shows rates; a strip of its own at the left has the points without a false alarm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.report.model import AXES
from cdtool.report.number_text import NOTHING, number
from cdtool.report.plots.figures import (
    between,
    drawing,
    message_figure,
    save,
    write,
)
from cdtool.report.plots.latency_axis import FLOOR_MS, LatencyAxis
from cdtool.report.plots.side_table import SideColumn, SideTable, keyed_panels
from cdtool.report.plots.style import BAND, line_of, look_of
from cdtool.report.writers.base import Image, Report
from cdtool.results.curves.amoc import AmocCurve, amoc_curves
from cdtool.results.evaluated import Evaluated
from cdtool.results.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FIGURES = (
    SideColumn("factor\nin use", 40),
    SideColumn("median\n[ms]", 62),
    SideColumn("missed", 46),
    SideColumn("not\nassessable", 50),
    SideColumn("false alarms\nin hold-out", 66),
)
# Shares of a panel's width for the strip of the points without a false alarm, and for it with its distance.
_STRIP, _RATES_FROM = 0.24, 0.27


@drawing()
def amoc_figure(evaluated: Evaluated) -> Figure:
    """Return a panel per group with a curve per detector."""
    curves = amoc_curves(evaluated.results)
    groups = list(dict.fromkeys(item.group for item in curves))
    if not groups:
        text = "no impact-free hold-out, or none that is assessable: no false alarms to compare with latencies"
        return message_figure(text)
    rows = {group: [item for item in evaluated.summaries if item.group == group] for group in groups}
    names = tuple(dict.fromkeys(item.detector for item in curves))
    figure, panels, table = keyed_panels(rows, _FIGURES, (5.2, 2.5), bottom=0.9)
    _set_rates(panels[-1], curves)
    scale = amoc_axis(curves)
    for axes, group in zip(panels, groups, strict=True):
        strip = _strip_of(axes, names)
        scale.set(axes, "y")
        # Room above the highest point for an arrow.
        axes.set_ylim(scale.low, (1.3 if scale.logarithmic else 1.08) * scale.high)
        axes.grid(color="0.9", linewidth=0.6)
        shown = [item for item in curves if item.group == group]
        for item in shown:
            quiet = np.array([point.false_alarms == 0 for point in item.points])
            column = np.full(len(quiet), float(names.index(item.detector)))
            _draw_points(strip, item, column, quiet, scale)
            _draw_points(axes, item, _rates(item), ~quiet, scale)
        by_name = {item.detector: item for item in shown}
        for i, row in enumerate(rows[group]):
            _write_row(table, axes, i, row, by_name.get(row.detector))
    _explain(panels[-1], strip, curves, floored=scale.logarithmic)
    return figure


def amoc_axis(curves: Sequence[AmocCurve]) -> LatencyAxis:
    """Return the axis of the medians of all points."""
    return LatencyAxis.of(np.array([point.median for item in curves for point in item.points]))


def _rates(item: AmocCurve) -> FloatArray:
    return np.array([item.rate(point) for point in item.points])


def _heights(item: AmocCurve, scale: LatencyAxis) -> FloatArray:
    """Return the medians of a curve as drawn [ms]: on a logarithmic axis at least its lower end."""
    return np.maximum([point.median for point in item.points], scale.low)


def _strip_of(axes: Axes, names: Sequence[str]) -> Axes:
    """Return the strip left of a panel, which takes room and title of it; it has a column for each detector."""
    box = axes.get_position()
    strip = axes.figure.add_axes((box.x0, box.y0, _STRIP * box.width, box.height), sharey=axes, facecolor=BAND)
    axes.set_position((box.x0 + _RATES_FROM * box.width, box.y0, (1.0 - _RATES_FROM) * box.width, box.height))
    strip.set_title(axes.get_title(loc="left"), loc="left", fontweight="bold", y=1.0)
    axes.set_title("", loc="left")
    axes.tick_params(axis="y", labelleft=False, length=0)
    strip.set_ylabel(AXES["median"])
    strip.grid(axis="y", color="white", linewidth=0.8)
    strip.set_xlim(-0.7, len(names) - 0.3)
    strip.set_xticks([])
    return strip


def _draw_points(axes: Axes, item: AmocCurve, x: FloatArray, kept: np.ndarray, scale: LatencyAxis) -> None:
    """Draw the points of a curve that are `kept`, at `x`; an arrow leaves the last one whose median is reached."""
    look, y = look_of(item.detector), _heights(item, scale)
    line = np.where(np.isfinite(y), y, np.nan)[kept]
    axes.plot(x[kept], line, **line_of(look), linewidth=1.2, zorder=3)
    missed = np.array([point.missed > 0 for point in item.points])
    for open_mark in (False, True):
        marked = kept & (missed == open_mark) & np.isfinite(y)
        axes.plot(
            x[marked],
            y[marked],
            look.marker,
            markerfacecolor="white" if open_mark else look.colour,
            markeredgecolor=look.colour,
            markeredgewidth=0.7,
            markersize=3.2,
            linestyle="none",
            zorder=4,
        )
    arrow = {"arrowstyle": "<-", "color": look.colour, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    for i in np.flatnonzero(kept[:-1] & np.isfinite(y[:-1]) & np.isinf(y[1:])).tolist():
        axes.annotate("", (x[i], y[i]), xytext=(0.0, 15.0), textcoords="offset points", arrowprops=arrow)
    if kept[item.in_use] and math.isfinite(y[item.in_use]):
        _mark_in_use(axes, item, float(x[item.in_use]), float(y[item.in_use]))


def _mark_in_use(axes: Axes, item: AmocCurve, x: float, y: float) -> None:
    look = look_of(item.detector)
    axes.plot(
        x,
        y,
        look.marker,
        markerfacecolor="white" if item.set_point.missed else look.colour,
        markeredgecolor="black",
        markeredgewidth=1.2,
        markersize=8.5,
        zorder=6,
    )


def _write_row(table: SideTable, axes: Axes, place: int, row: Summary, curve: AmocCurve | None) -> None:
    if curve is None:
        cells = (NOTHING, NOTHING, NOTHING, str(row.not_assessable), NOTHING)
        table.write_key(axes, place, row.detector, cells, (False, False, False, row.not_assessable > 0, False))
        return
    point = curve.set_point
    cells = (
        number(point.safety_factor),
        number(point.median, error=row.resolution_ms),
        f"{point.missed} of {point.detected + point.missed}",
        str(curve.not_assessable),
        f"{point.false_alarms} in {curve.operations} op.",
    )
    loud = (False, False, point.missed > 0, curve.not_assessable > 0, point.false_alarms > 0)
    table.write_key(axes, place, row.detector, cells, loud)


def _set_rates(axes: Axes, curves: Sequence[AmocCurve]) -> None:
    """Set the horizontal axis to rates; it begins slightly below that of a single false alarm."""
    from matplotlib.ticker import FixedLocator, NullLocator

    least = 1.0 / max(item.exposure for item in curves) / 1.6
    most = max([10.0 * least, *(1.6 * item.rate(point) for item in curves for point in item.points)])
    axes.set_xscale("log")
    axes.set_xlim(least, most)
    steps = (1.0, 2.0, 5.0) if most < 100.0 * least else (1.0,)
    decades = range(math.floor(math.log10(least)), math.ceil(math.log10(most)))
    axes.xaxis.set_major_locator(FixedLocator([step * 10.0**power for power in decades for step in steps]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.12g}")


def _explain(axes: Axes, strip: Axes, curves: Sequence[AmocCurve], *, floored: bool) -> None:
    """Write below the strip what no false alarm means, below the rates their unit and the meaning of the marks.

    `floored`: the axis of latencies is logarithmic, and medians below its lower end are drawn there.
    """
    hours, bounds = [item.hours for item in curves], [item.at_most for item in curves]
    per, counts = curves[0].per, sorted({item.operations for item in curves})
    operations = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else str(counts[0])
    watched = f"{between(min(hours), max(hours))} h" if per == "hour" else f"{operations} operations"
    none = f"0\nin {watched}:\nat most {between(min(bounds), max(bounds))} per {per}"
    for panel, text, share, lift, size, side in (
        (strip, none, 0.5, -5.0, 7.5, "center"),
        (axes, f"false alarms per {per}, in the hold-out", 0.5, -22.0, 9.0, "center"),
        (strip, _marks(curves, floored), 0.0, -46.0, 8.0, "left"),
    ):
        write(panel, text, (share, 0.0), (0.0, lift), ha=side, va="top", fontsize=size, linespacing=1.35)


def _marks(curves: Sequence[AmocCurve], floored: bool) -> str:
    points = [point for item in curves for point in item.points]
    words = ["each mark: a safety factor, the large one is in use"]
    if any(point.missed for point in points):
        words.append("open: contacts were missed")
    if any(math.isinf(point.median) for point in points):
        words.append("arrow: the median is not reached, at least half of the contacts were missed")
    if floored and any(point.median < FLOOR_MS for point in points):
        words.append(f"medians below {FLOOR_MS:.0f} ms are drawn there")
    return "; ".join(words)


def write_amoc(report: Report, folder: Path) -> list[Image]:
    """Draw amoc.png for a report folder if limits were moved; raises CdtoolError (see `save`)."""
    if not report.evaluated.results.sweep:
        return []
    image = Image("amoc.png", "median latency against false alarms, with the limits of each detector moved")
    save(amoc_figure(report.evaluated), folder / image.name)
    return [image]

"""Median latency against false alarms, with the limits of every detector moved (AMOC): a panel a group."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.evaluation.amoc import AmocCurve, amoc_curves
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.summary import Summary
from cdtool.recording import FloatArray
from cdtool.report.figure_text import NOTHING, number
from cdtool.report.plots.amoc_axes import RateFrame, explain, rate_frame, set_latencies, set_rates
from cdtool.report.plots.direct_labels import Labelled, write_labels
from cdtool.report.plots.figures import Margins, drawing, label, new_figure, save, stacked_panels, text_width
from cdtool.report.plots.latency_axis import FLOOR_MS, latency_range
from cdtool.report.plots.side_table import Column, SideTable, key_height
from cdtool.report.plots.style import look_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FIGURES = (
    Column("factor\nin use", 40),
    Column("median\n[ms]", 62),
    Column("missed", 46),
    Column("not\nassessable", 50),
    Column("false alarms\nin hold-out", 66),
)
_NAME = 24
_PANEL = 2.5
_ARROW = 15.0


def plot_amoc(evaluated: Evaluated, path: Path) -> None:
    """Draw a panel a group and a curve a detector; raises UsageError, CdtoolError (see `save`).

    A lower curve is better. Left of the first rate that can be seen nothing is known but a bound, which is written.
    """
    with drawing():
        save(_figure(evaluated), path)


def _figure(evaluated: Evaluated) -> Figure:
    curves = amoc_curves(evaluated.results)
    groups = list(dict.fromkeys(item.group for item in curves))
    if not groups:
        figure = new_figure(9.0, 1.2)
        text = "no impact-free hold-out, or none that could be judged: no false alarms to hold against latencies"
        figure.text(0.5, 0.5, text, ha="center", va="center")
        return figure
    rows = {group: [item for item in evaluated.summaries if item.group == group] for group in groups}
    name = 72.0 * text_width([label(item.detector, _NAME) for items in rows.values() for item in items], 8) + 20.0
    table = SideTable((Column("", name, left=True), *_FIGURES))
    heights = [max(_PANEL, key_height(len(items)) + 0.1) for items in rows.values()]
    margins = Margins(0.75, table.width + 0.1, 0.5, 0.9)
    figure, panels = stacked_panels(margins.left + 5.2 + margins.right, heights, margins, gap=0.36)
    frame = rate_frame(curves)
    set_rates(panels[-1], frame)
    low, high, logarithmic = latency_range(np.array([point.median for item in curves for point in item.points]))
    for axes, group in zip(panels, groups, strict=True):
        set_latencies(axes, low, high, logarithmic)
        frame.shade(axes)
        shown = [item for item in curves if item.group == group]
        for item in shown:
            _draw_curve(axes, item, frame)
        _name_curves(axes, shown, frame)
        axes.set_title(label(group, 60), loc="left", fontweight="bold", y=1.0)
        by_name = {item.detector: item for item in shown}
        for i, row in enumerate(_by_median(rows[group], by_name)):
            _write_row(table, axes, i, row, by_name.get(row.detector))
    table.write_headings(panels[0])
    explain(panels[-1], curves, floored=logarithmic)
    return figure


def _heights(axes: Axes, item: AmocCurve) -> FloatArray:
    """Where the medians of a curve are drawn [ms]: on a logarithmic axis, those below its floor at the floor."""
    medians = np.array([point.median for point in item.points])
    return np.maximum(medians, FLOOR_MS) if axes.get_yscale() == "log" else medians


def _draw_curve(axes: Axes, item: AmocCurve, frame: RateFrame) -> None:
    look, x = look_of(item.detector), frame.x(item.detector, item.points)
    y = _heights(axes, item)
    inside = np.array([point.false_alarms == 0 for point in item.points])
    drawn = np.where(np.isfinite(y), y, np.nan)
    same = inside[1:] == inside[:-1]
    for kind, width, style in ((same, 1.0, "-"), (~same, 0.7, ":")):
        axes.plot(*_segments(x, drawn, kind), color=look.colour, linewidth=width, linestyle=style, zorder=3)
    missed = np.array([point.missed > 0 for point in item.points])
    for open_mark in (False, True):
        kept = (missed == open_mark) & np.isfinite(y)
        axes.plot(
            x[kept],
            y[kept],
            look.marker,
            markerfacecolor="white" if open_mark else look.colour,
            markeredgecolor=look.colour,
            markeredgewidth=0.7,
            markersize=3.2,
            linestyle="none",
            zorder=4,
        )
    for i in np.flatnonzero(np.isfinite(y[:-1]) & np.isinf(y[1:])).tolist():
        _arrow_up(axes, (x[i], y[i]), look.colour)
    _mark_in_use(axes, item, float(x[item.in_use]))


def _segments(x: FloatArray, y: FloatArray, kept: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """The pieces between neighbouring points that are `kept`, with gaps between them."""
    gap = np.full(int(kept.sum()), np.nan)
    across = np.column_stack((x[:-1][kept], x[1:][kept], gap))
    return across.ravel(), np.column_stack((y[:-1][kept], y[1:][kept], gap)).ravel()


def _mark_in_use(axes: Axes, item: AmocCurve, x: float) -> None:
    look, point = look_of(item.detector), item.set_point
    if math.isnan(point.median):
        return
    reached = math.isfinite(point.median)
    axes.plot(
        x,
        float(_heights(axes, item)[item.in_use]) if reached else 0.88,
        look.marker,
        transform=axes.transData if reached else axes.get_xaxis_transform(),
        markerfacecolor="white" if point.missed else look.colour,
        markeredgecolor="black",
        markeredgewidth=1.2,
        markersize=8.5,
        zorder=6,
    )
    if not reached:
        axes.annotate("", (x, 0.91), (x, 1.0), xycoords=axes.get_xaxis_transform(), arrowprops=_arrow("black"))


def _arrow_up(axes: Axes, place: tuple[float, float], colour: str) -> None:
    """From a point upward: with the next safety factor the median is not reached."""
    axes.annotate("", place, xytext=(0.0, _ARROW), textcoords="offset points", arrowprops=_arrow(colour))


def _arrow(colour: str) -> dict[str, object]:
    return {"arrowstyle": "<-", "color": colour, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}


def _name_curves(axes: Axes, curves: Sequence[AmocCurve], frame: RateFrame) -> None:
    """Names where there are rates, from low ones on; in the zone without a false alarm there is no room."""
    named = []
    for item in curves:
        y = _heights(axes, item)
        seen = np.isfinite(y)
        x, y = frame.x(item.detector, item.points)[seen], y[seen]
        if len(x):
            places = np.flatnonzero(x > frame.least)[::-1]
            named.append(Labelled(label(item.detector, _NAME), look_of(item.detector).colour, x, y, places))
    write_labels(axes, named)


def _by_median(rows: Sequence[Summary], curves: dict[str, AmocCurve]) -> list[Summary]:
    """The fastest at its factor in use first; those without a median last."""

    def median(row: Summary) -> float:
        found = curves[row.detector].set_point.median if row.detector in curves else math.nan
        return math.inf if math.isnan(found) else min(found, 1e12)

    return sorted(rows, key=median)


def _write_row(table: SideTable, axes: Axes, place: int, row: Summary, curve: AmocCurve | None) -> None:
    name = label(row.detector, _NAME)
    if curve is None:
        cells = (name, NOTHING, NOTHING, NOTHING, str(row.not_assessable), NOTHING)
        table.write_key(axes, place, row.detector, cells, (*((False,) * 4), row.not_assessable > 0, False))
        return
    point = curve.set_point
    cells = (
        name,
        number(point.safety_factor),
        number(point.median),
        f"{point.missed} of {point.detected + point.missed}",
        str(curve.not_assessable),
        f"{point.false_alarms} in {curve.operations} op.",
    )
    loud = (False, False, False, point.missed > 0, curve.not_assessable > 0, point.false_alarms > 0)
    table.write_key(axes, place, row.detector, cells, loud)

"""Median latency against false alarms, with the limits of every detector moved (AMOC): a panel per group.

The horizontal axis shows rates; to their left is a zone for points without a false alarm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.report.model import AXES
from cdtool.report.number_text import NOTHING, number
from cdtool.report.plots.figures import (
    between,
    drawing,
    label,
    message_figure,
    save,
    write,
)
from cdtool.report.plots.labels import Labelled, write_labels
from cdtool.report.plots.latency_axis import FLOOR_MS, latency_range, set_ticks
from cdtool.report.plots.side_table import NAME_LENGTH, SideColumn, SideTable, keyed_panels, rank
from cdtool.report.plots.style import BAND, look_of
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
# Share of a panel's width for the points without a false alarm.
_ZONE = 0.27


@drawing()
def amoc_figure(evaluated: Evaluated) -> Figure:
    """Return a panel per group with a curve per detector."""
    curves = amoc_curves(evaluated.results)
    groups = list(dict.fromkeys(item.group for item in curves))
    if not groups:
        text = "no impact-free hold-out, or none that is assessable: no false alarms to compare with latencies"
        return message_figure(text)
    rows = {group: [item for item in evaluated.summaries if item.group == group] for group in groups}
    figure, panels, table = keyed_panels(rows, _FIGURES, (5.2, 2.5), bottom=0.9)
    frame = _rate_frame(curves)
    _set_rates(panels[-1], frame)
    low, high, logarithmic = latency_range(np.array([point.median for item in curves for point in item.points]))
    for axes, group in zip(panels, groups, strict=True):
        _set_latencies(axes, low, high, logarithmic)
        frame.shade(axes)
        shown = [item for item in curves if item.group == group]
        for item in shown:
            _draw_curve(axes, item, frame)
        _name_curves(axes, shown, frame)
        by_name = {item.detector: item for item in shown}
        medians = {name: item.set_point.median for name, item in by_name.items()}
        ordered = sorted(rows[group], key=lambda row: rank(medians.get(row.detector, math.nan)))
        for i, row in enumerate(ordered):
            _write_row(table, axes, i, row, by_name.get(row.detector))
    _explain(panels[-1], curves, floored=logarithmic)
    return figure


def _heights(axes: Axes, item: AmocCurve) -> FloatArray:
    """Return the medians of a curve as drawn [ms]: on a logarithmic axis at least its lower end."""
    medians = np.array([point.median for point in item.points])
    return np.maximum(medians, FLOOR_MS) if axes.get_yscale() == "log" else medians


def _draw_curve(axes: Axes, item: AmocCurve, frame: _RateFrame) -> None:
    look, x = look_of(item.detector), frame.x(item)
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
    """Return the segments between neighbouring points that are `kept`, separated by NaN."""
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
    """Draw an arrow upward from a point: with the next safety factor the median is not reached."""
    axes.annotate("", place, xytext=(0.0, 15.0), textcoords="offset points", arrowprops=_arrow(colour))


def _arrow(colour: str) -> dict[str, object]:
    return {"arrowstyle": "<-", "color": colour, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}


def _name_curves(axes: Axes, curves: Sequence[AmocCurve], frame: _RateFrame) -> None:
    """Write the names of curves next to their rates, low ones first; the zone without a false alarm has no room."""
    named = []
    for item in curves:
        y = _heights(axes, item)
        seen = np.isfinite(y)
        x, y = frame.x(item)[seen], y[seen]
        if len(x):
            places = np.flatnonzero(x > frame.least)[::-1]
            named.append(Labelled(label(item.detector, NAME_LENGTH), look_of(item.detector).colour, x, y, places))
    write_labels(axes, named)


def _write_row(table: SideTable, axes: Axes, place: int, row: Summary, curve: AmocCurve | None) -> None:
    if curve is None:
        cells = (NOTHING, NOTHING, NOTHING, str(row.not_assessable), NOTHING)
        table.write_key(axes, place, row.detector, cells, (False, False, False, row.not_assessable > 0, False))
        return
    point = curve.set_point
    cells = (
        number(point.safety_factor),
        number(point.median),
        f"{point.missed} of {point.detected + point.missed}",
        str(curve.not_assessable),
        f"{point.false_alarms} in {curve.operations} op.",
    )
    loud = (False, False, point.missed > 0, curve.not_assessable > 0, point.false_alarms > 0)
    table.write_key(axes, place, row.detector, cells, loud)


@dataclass(frozen=True)
class _RateFrame:
    """The horizontal axis: a zone without a false alarm from `left` to `least`, then rates up to `most`.

    In the zone each detector has its own column: the position of a point in it does not mean a rate.
    """

    left: float
    least: float
    most: float
    columns: tuple[str, ...]

    def x(self, item: AmocCurve) -> FloatArray:
        """Return the horizontal positions of a detector's points."""
        share = (self.columns.index(item.detector) + 0.5) / len(self.columns)
        column = self.left * (self.least / self.left) ** share
        return np.array([item.rate(point) if point.false_alarms else column for point in item.points])

    def shade(self, axes: Axes) -> None:
        """Colour the zone."""
        axes.axvspan(self.left, self.least, color=BAND, linewidth=0, zorder=0)


def _rate_frame(curves: Sequence[AmocCurve]) -> _RateFrame:
    """Return the axis; its rates begin slightly below that of a single false alarm."""
    least = 1.0 / max(item.exposure for item in curves) / 1.6
    most = max([10.0 * least, *(1.6 * item.rate(point) for item in curves for point in item.points)])
    columns = tuple(dict.fromkeys(item.detector for item in curves))
    return _RateFrame(least / (most / least) ** (_ZONE / (1.0 - _ZONE)), least, most, columns)


def _set_rates(axes: Axes, frame: _RateFrame) -> None:
    """Set the horizontal axis to rates."""
    from matplotlib.ticker import FixedLocator, NullFormatter

    axes.set_xscale("log")
    axes.set_xlim(frame.left, frame.most)
    decades = range(math.ceil(math.log10(frame.least)), math.floor(math.log10(frame.most)) + 1)
    minor = [step * 10.0**power for power in (*decades, decades.start - 1) for step in range(2, 10)]
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in decades]))
    axes.xaxis.set_minor_locator(FixedLocator([tick for tick in minor if frame.least <= tick <= frame.most]))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.12g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _set_latencies(axes: Axes, low: float, high: float, logarithmic: bool) -> None:
    """Set the vertical axis to latencies [ms]."""
    if logarithmic:
        axes.set_yscale("log")
        set_ticks(axes.yaxis, low, high)
    # Room above the highest point for an arrow.
    axes.set_ylim(low, high * (high / low) ** 0.08 if logarithmic else 1.08 * high)
    axes.set_ylabel(AXES["median"])
    axes.grid(color="0.9", linewidth=0.6)


def _explain(axes: Axes, curves: Sequence[AmocCurve], *, floored: bool) -> None:
    """Write below the zone what no false alarm means, below the rates their unit and the meaning of the marks.

    `floored`: the axis of latencies is logarithmic, and medians below its lower end are drawn there.
    """
    hours, bounds = [item.hours for item in curves], [item.at_most for item in curves]
    per, counts = curves[0].per, sorted({item.operations for item in curves})
    operations = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else str(counts[0])
    zone = "\n".join(
        (
            f"none in {operations} operations,",
            f"{between(min(hours), max(hours))} h",
            f"(at most {between(min(bounds), max(bounds))} per {per})",
        )
    )
    rates = f"false alarms per {per}"
    for text, share, lift, size, side in (
        (zone, 0.5 * _ZONE, -4.0, 7.5, "center"),
        (rates, _ZONE + 0.5 * (1.0 - _ZONE), -22.0, 9.0, "center"),
        (_marks(curves, floored), 0.0, -46.0, 8.0, "left"),
    ):
        write(axes, text, (share, 0.0), (0.0, lift), ha=side, va="top", fontsize=size, linespacing=1.35)


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

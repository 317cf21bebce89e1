"""Latency of every detector in every group: a mark per contact, the median with its interval, and all counts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.report.few_contacts import draws_no_interval, grouped, open_end
from cdtool.report.model import AXES
from cdtool.report.number_text import NOTHING, with_interval
from cdtool.report.plots.figures import (
    Margins,
    between,
    drawing,
    label,
    message_figure,
    save,
    stacked_panels,
    text_width,
    write,
)
from cdtool.report.plots.latency_axis import FLOOR_MS, LatencyAxis
from cdtool.report.plots.side_table import SideColumn, SideTable, count_cells
from cdtool.report.plots.style import look_of
from cdtool.report.table import shown
from cdtool.report.writers.base import Image, Report
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import Results
from cdtool.results.summary import Summary
from cdtool.statistics.small_sample import FEWEST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = (
    SideColumn("median [ms]", 132),
    SideColumn("detected", 66),
    SideColumn("missed", 38),
    SideColumn("not\nassessable", 52),
    SideColumn("false\nalarms", 36),
)
#: More marks in a row cover each other.
_MOST_MARKS = 400
# Share of the width of the strip right of the axis, for missed contacts that were monitored for longer.
_BEYOND = 0.09


@dataclass(frozen=True)
class _Marks:
    """Latencies of the detected contacts, and how long the missed ones were monitored, both ascending [ms]."""

    detected: FloatArray
    missed: FloatArray


@dataclass(frozen=True)
class _Axis:
    """The time axis [ms]: `scale`, then the strip of missed contacts up to `high`, if there is one."""

    scale: LatencyAxis
    high: float

    def shown(self, times: FloatArray | float) -> FloatArray:
        """Return where times are drawn: beyond the end of the scale in the middle of the strip."""
        ends = self.scale.high, self.high
        middle = math.sqrt(ends[0] * ends[1]) if self.scale.logarithmic else 0.5 * sum(ends)
        return np.asarray(np.where(np.greater(times, ends[0]), middle, np.maximum(times, self.scale.low)))


@drawing()
def latency_figure(evaluated: Evaluated) -> Figure:
    """Return a panel per group with a row per detector."""
    summaries = [item for item in evaluated.summaries if item.contacts]
    groups = list(dict.fromkeys(item.group for item in summaries))
    if not groups:
        return message_figure("no contact in any group: no latency to show")
    known = _all_marks(evaluated.results)
    marks = {key: known[key] for key in ((item.detector, item.group) for item in summaries)}
    impact_free = list(dict.fromkeys(item.group for item in evaluated.summaries if not item.contacts))
    more = [SideColumn(f"false alarms\nin {label(shown(group), 11)}", 70.0) for group in impact_free]
    table = SideTable((*_COLUMNS, *more))
    rows = {group: [item for item in summaries if item.group == group] for group in groups}
    names = [label(item.detector, 28) for item in summaries]
    axis = _axis_of(evaluated.results)
    explained = _explained(summaries, list(marks.values()), axis)
    bottom = 0.325 + 0.175 * len(explained.splitlines())
    margins = Margins(text_width(names, 9) + 0.15, table.width + 0.1, 0.5, bottom)
    heights = [0.2 + 0.36 * len(rows[group]) for group in groups]
    figure, panels = stacked_panels(margins.left + 4.4 + margins.right, heights, margins, gap=0.36)
    axis.scale.set(panels[-1], "x")
    panels[-1].set_xlim(axis.scale.low, axis.high)
    counts = {(item.detector, item.group): _count(item) for item in evaluated.summaries}
    for axes, group in zip(panels, groups, strict=True):
        _draw_group(axes, rows[group], marks, axis)
        axes.set_title(label(shown(group), 40), loc="left", fontweight="bold", y=1.0)
        for i, row in enumerate(rows[group]):
            free = [counts.get((row.detector, name), NOTHING) for name in impact_free]
            _write_row(table, axes, i, row, free)
    table.write_headings(panels[0])
    # In the middle of the axis, unless the text would then begin left of the figure.
    beside = 0.5 * text_width(explained.splitlines(), 10) + 0.1 - margins.left
    panels[-1].set_xlabel(explained, linespacing=1.4, x=max(0.5, beside / 4.4))
    return figure


def _all_marks(results: Results) -> dict[tuple[str, str], _Marks]:
    found: dict[tuple[str, str], tuple[list[float], list[float]]] = {}
    for item in results.scored_contacts:
        detected, missed = found.setdefault((item.detector, item.group), ([], []))
        if item.latency_ms is not None:
            detected.append(item.latency_ms)
        elif item.outcome == "missed":
            missed.append(item.watched_ms or 0.0)
    return {key: _Marks(np.sort(detected), np.sort(missed)) for key, (detected, missed) in found.items()}


def latency_axis(results: Results) -> LatencyAxis:
    """Return the axis of all latencies; without any, of the times for which missed contacts were monitored."""
    rows = results.scored_contacts
    late = [row.latency_ms for row in rows if row.latency_ms is not None]
    return LatencyAxis.of(np.array(late or [row.watched_ms or 0.0 for row in rows if row.outcome == "missed"]))


def _axis_of(results: Results) -> _Axis:
    scale = latency_axis(results)
    low, end = scale.low, scale.high
    if not any(row.outcome == "missed" and (row.watched_ms or 0.0) > end for row in results.scored_contacts):
        return _Axis(scale, end)
    return _Axis(scale, end * (end / low) ** _BEYOND if scale.logarithmic else end + _BEYOND * (end - low))


def _draw_group(axes: Axes, rows: Sequence[Summary], marks: dict[tuple[str, str], _Marks], axis: _Axis) -> None:
    for i, row in enumerate(rows):
        _draw_marks(axes, i, row.detector, marks[row.detector, row.group], axis)
        _draw_median(axes, i, row, axis)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_yticks(range(len(rows)), [label(row.detector, 28) for row in rows])
    axes.tick_params(axis="y", length=0, labelsize=9)
    axes.grid(axis="x", color="0.88", linewidth=0.6)
    if axis.high > axis.scale.high:
        _name_strip(axes, np.concatenate([marks[row.detector, row.group].missed for row in rows]), axis)


def _name_strip(axes: Axes, missed: FloatArray, axis: _Axis) -> None:
    axes.axvline(axis.scale.high, color="0.6", linewidth=0.7, linestyle=(0, (2, 2)), zorder=0.5)
    beyond = missed[missed > axis.scale.high]
    if not len(beyond):
        return
    words = f"> {between(float(beyond.min()), float(beyond.max()))} ms"
    write(axes, words, (1.0, 1.0), (2, 3), ha="right", va="bottom", fontsize=7.5)


def _draw_marks(axes: Axes, row: int, detector: str, marks: _Marks, axis: _Axis) -> None:
    """Draw detected contacts as filled marks, missed ones as open marks."""
    look = look_of(detector)
    for times, filled in ((marks.detected, True), (marks.missed, False)):
        shown = axis.shown(_thinned(times))
        # Evenly, without random numbers.
        height = row - 0.12 + 0.42 * (np.arange(len(shown)) * 0.6180339887 % 1.0 - 0.5)
        axes.plot(
            shown,
            height,
            look.marker,
            color=look.colour,
            markerfacecolor=look.colour if filled else "white",
            markeredgecolor="white" if filled else look.colour,
            markersize=4.5,
            markeredgewidth=0.4 if filled else 0.9,
            linestyle="none",
            clip_on=False,
        )


def _thinned(ordered: FloatArray) -> FloatArray:
    if len(ordered) <= _MOST_MARKS:
        return ordered
    return np.asarray(ordered[np.linspace(0, len(ordered) - 1, _MOST_MARKS).astype(int)])


def _draw_median(axes: Axes, row: int, summary: Summary, axis: _Axis) -> None:
    """Draw the median below the marks with its interval as a bar; without an upper end it is written at its lower end.

    With fewer than ten contacts only the median: the marks show the range.
    """
    height, median, least = row + 0.28, summary.median, open_end(summary)
    if least is None and not draws_no_interval(summary) and np.isfinite(median.high):
        ends = [axis.shown(median.low), axis.shown(median.high)]
        axes.plot(ends, [height, height], color="black", linewidth=1.4, solid_capstyle="butt", zorder=3)
    if least is not None:
        _write_open_end(axes, height, (least[0], median.value), least[1], axis)
    if np.isfinite(median.value):
        at = axis.shown(median.value)
        axes.plot(
            [at, at], [height - 0.13, height + 0.13], color="black", linewidth=2.0, solid_capstyle="butt", zorder=4
        )


def _write_open_end(axes: Axes, height: float, ends: tuple[float, float], words: str, axis: _Axis) -> None:
    """Draw an open interval from its lower end to the median and write it there; in the right half, left of both."""
    low, high = axis.shown(np.array([ends[0], ends[1] if np.isfinite(ends[1]) else ends[0]])).tolist()
    axes.plot([low, low], [height - 0.1, height + 0.1], color="black", linewidth=1.0, zorder=3)
    axes.plot([low, high], [height, height], color="black", linewidth=1.4, solid_capstyle="butt", zorder=3)
    share = axes.transAxes.inverted().transform(axes.transData.transform((high, 0.0)))[0]
    at, side, offset = (low, "right", -4) if share > 0.5 else (high, "left", 5)
    write(axes, words, (at, height), (offset, 0), "data", ha=side, va="center", fontsize=7)


def _write_row(table: SideTable, axes: Axes, place: int, row: Summary, impact_free: Sequence[str]) -> None:
    cells, loud = count_cells(row)
    alarmed = (not cell.startswith(("0 ", NOTHING)) for cell in impact_free)
    table.write_row(
        axes, place, (with_interval(row.median, row.resolution_ms), *cells, *impact_free), (False, *loud, *alarmed)
    )


def _count(item: Summary) -> str:
    """Return the false alarms; a dash if the detector could not assess anything."""
    return f"{item.false_alarms} in {item.judged_operations} op." if item.watched else NOTHING


def _explained(summaries: Sequence[Summary], marks: Sequence[_Marks], axis: _Axis) -> str:
    below = axis.scale.logarithmic and any(np.any(item.detected < FLOOR_MS) for item in marks)
    missed = any(len(item.missed) for item in marks)
    lines = [f"{AXES['latency']}{f' (below {FLOOR_MS:.0f} ms drawn there)' if below else ''}"]
    lines.append(f"each mark: a contact{', open if missed, at the end of its monitoring' if missed else ''}")
    lines[-1] += "; ≥: without an upper end" if any(map(open_end, summaries)) else ""
    if any(max(len(item.detected), len(item.missed)) > _MOST_MARKS for item in marks):
        lines[-1] += f" (at most {_MOST_MARKS} are drawn)"
    few, later = [draws_no_interval(item) for item in summaries], ", missed contacts counted as later" if missed else ""
    interval = "" if all(few) else " and its 95 % interval"
    lines.append(f"black: median{interval}{later}")
    if any(few):
        no_bar = f"no bar with fewer than {FEWEST} contacts{' or recordings' if grouped(summaries) else ''}"
        # A longer line would be wider than the axis [characters].
        lines[-1] += f"{'; ' if len(lines[-1]) + len(no_bar) <= 90 else chr(10)}{no_bar}"
    return "\n".join(lines)


def write_latencies(report: Report, folder: Path) -> list[Image]:
    """Draw latency.png for a report folder; raises CdtoolError (see `save`)."""
    image = Image("latency.png", "latency of every detector in every group")
    save(latency_figure(report.evaluated), folder / image.name)
    return [image]

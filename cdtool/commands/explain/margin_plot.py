"""Why an alarm was raised or a contact missed: channels in the order in which they moved, signal and margin."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.recordings.recording import Recording
from cdtool.report.explanation_words import words
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, label, log_label, new_figure, save, unit_label, write
from cdtool.report.plots.panels import (
    PIXELS,
    Legend,
    count_from,
    draw_alarm,
    draw_force,
    draw_onset,
    draw_signal,
    frame_signal,
)
from cdtool.report.plots.style import BAND, LIMIT_LINE, look_of
from cdtool.results.explanation.departure import Departure
from cdtool.results.explanation.explanation import Explanation
from cdtool.results.explanation.margin import joint_margins
from cdtool.results.traces.decimation import decimate
from cdtool.results.traces.trace import Span, StatisticCurve

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Time shown before and after the events, and at most after a contact [s].
_BEFORE, _AFTER, _LONGEST = 0.15, 0.06, 0.6
_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2)
_OTHER = "0.45"


def plot_explanation(detection: Detection, explanation: Explanation, path: Path) -> None:
    """Draw an alarm or a missed contact: its channels in the order of moving, signal with band, margin over time.

    Raises UsageError, CdtoolError (see `save`).
    """
    with drawing():
        save(_figure(detection, explanation), path)


def _figure(detection: Detection, item: Explanation) -> Figure:
    recording = detection.operation.recording
    channels, span = _channels(item), _span(item, recording)
    forced = item.contact is not None and "force" in recording
    heights = [0.8] * forced + [0.8] * len(channels) + [1.5, 1.3]
    figure = new_figure(9.0, 1.6 + sum(heights))
    panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0].tolist()
    legend = Legend(item.detector)
    if forced:
        force = recording["force"]
        draw_force(panels[0], force.time, force.values[:, 0], span, contact=True)
        _name(panels[0], f"load cell\n[{unit_label(force.unit)}]")
    for axes, departure in zip(panels[int(forced) :], channels, strict=False):
        _draw_channel(axes, recording, departure, item, span)
    _draw_statistic(panels[-2], detection, item, span, legend)
    _draw_margin(panels[-1], detection, item, span)
    for axes in panels:
        _draw_event(axes, item, legend)
        axes.set_xlim(span)
        axes.locator_params(axis="y", nbins=4)
    event = "contact onset" if item.contact else "alarm"
    panels[-1].set_xlabel(f"time from {event} [ms]")
    count_from(panels[-1], item.zero, next((x for x in _STEPS if (span[1] - span[0]) / x <= 12), _STEPS[-1]))
    figure.align_ylabels()
    heading = f"{log_label(item.operation)}  ·  {label(item.detector)}  ·  {label(item.joint)}"
    figure.suptitle(f"{heading}\n{fill(label(words(item)[0], 200), 110)}", fontsize=10, x=0.01, ha="left")
    figure.legend(handles=[*legend.handles(), *_more_handles(item, channels)], loc="outside lower left", ncols=4)
    return figure


def _channels(item: Explanation) -> list[Departure]:
    """Return the channels that moved, in order, then those that the detector reads and that did not."""
    moved = [found for found in item.departed if not math.isnan(found.time)]
    still = [found for found in item.departed if math.isnan(found.time) and found.channel in item.inputs]
    return [*moved, *still][:5]  # panels that fit on a page


def _span(item: Explanation, recording: Recording) -> Span:
    moved = [found.time for found in item.departed if not math.isnan(found.time)]
    if item.contact is None:
        start, end = min([item.zero, *moved]), item.zero
    else:
        start = item.zero
        if item.alarm:
            last = item.alarm.time
        else:
            last = max([start + min(item.watched, _LONGEST), *(found.nearest.time for found in item.approaches[:1])])
        end = max([last, *(time for time in moved if time <= start + _LONGEST)])
    return max(start - _BEFORE, recording.start), min(end + _AFTER, recording.end)


def _draw_channel(axes: Axes, recording: Recording, departure: Departure, item: Explanation, span: Span) -> None:
    series = recording[departure.channel].between(*span)
    value = series.values[:, recording.joints.index(departure.joint)]
    colour = _colour(departure, item)
    axes.plot(*decimate(series.time, value, PIXELS), color=colour, linewidth=1.0)
    joint = f"\n{label(departure.joint, 14)}" if departure.joint != item.joint else ""
    _name(axes, f"{label(departure.channel, 20)}{joint}\n[{unit_label(series.unit)}]")
    if math.isnan(departure.time):
        _write(axes, departure.reason, (span[1], 1.0), (0, 2), "right")
        return
    axes.axvline(departure.time, color=colour, linewidth=0.9, linestyle=":")
    axes.plot([departure.time], [1.0], marker="v", color=colour, transform=axes.get_xaxis_transform(), clip_on=False)
    after = number(1e3 * abs(departure.time - item.zero), error=1e3 * float(np.median(np.diff(series.time))))
    sign = "−" if departure.time < item.zero else "+"
    _write(axes, f"{sign}{after} ms", (departure.time, 1.0), (6, -1), "left")


def _draw_statistic(axes: Axes, detection: Detection, item: Explanation, span: Span, legend: Legend) -> None:
    course = StatisticCurve.of(detection, detection.statistic.joints.index(item.joint))
    frame_signal(axes, [course], span, headroom=1.0)
    draw_signal(axes, course, item.detector, span, legend)
    _name(axes, f"{label(item.detector, 20)}\n[{unit_label(item.unit)}]")


def _draw_margin(axes: Axes, detection: Detection, item: Explanation, span: Span) -> None:
    margin = joint_margins(detection)[detection.statistic.joints.index(item.joint)]
    inside = (margin.time >= span[0]) & (margin.time <= span[1])
    time, value = margin.time[inside], margin.margin[inside]
    _name(axes, f"margin to limit\n[{unit_label(item.unit)}]")
    axes.axhline(0.0, **LIMIT_LINE)
    if not np.isfinite(value).any():
        return
    colour = look_of(item.detector).colour
    axes.plot(*decimate(time, value, PIXELS), color=colour)
    low, high = _range(value)
    axes.set_ylim(low, high)
    axes.axhspan(0.0, high, color=BAND, linewidth=0, zorder=0)
    if item.alarm:
        axes.axvspan(item.left, item.alarm.time, color=colour, alpha=0.25, linewidth=0)
        debounce = f"outside for {counted(item.debounce, 'sample')}"
        _write(axes, debounce, (item.left, 0.0), (-4, 4), "right")
        return
    for nearest in [found.nearest for found in item.approaches[:1]]:
        depth = float(np.clip(nearest.margin, low, high))
        axes.plot([nearest.time], [depth], marker="o", color=colour, clip_on=False)
        words = f"nearest, {number(1e3 * (nearest.time - item.zero), error=1e3 * float(np.median(np.diff(time))))} ms"
        axes.annotate(words, (nearest.time, depth), (8, 0), textcoords="offset points", va="center", fontsize=8)


def _range(value: FloatArray) -> Span:
    """Return the range from slightly above the largest margin to the beginning of a deep excursion below 0."""
    known = value[np.isfinite(value)]
    high, low = max(float(known.max()), 0.0), min(float(known.min()), 0.0)
    low = max(low, -1.2 * high) if high > 0.0 else low
    room = 0.08 * (high - low) or 1.0
    return low - room, high + room


def _draw_event(axes: Axes, item: Explanation, legend: Legend) -> None:
    if item.contact:
        draw_onset(axes, item.contact.start, legend)
    if item.alarm:
        draw_alarm(axes, item.alarm, look_of(item.detector).colour, legend)


def _more_handles(item: Explanation, channels: list[Departure]) -> list[Artist]:
    from matplotlib.lines import Line2D

    handles: list[Artist] = []
    if any(not math.isnan(found.time) for found in channels):
        handles.append(Line2D([], [], color=_OTHER, marker="v", linestyle=":", linewidth=0.9, label="moved"))
    if any(found.channel in item.inputs for found in channels):
        colour = look_of(item.detector).colour
        handles.append(Line2D([], [], color=colour, linewidth=1.0, label=f"read by {label(item.detector, 24)}"))
    if any(found.channel not in item.inputs for found in channels):
        handles.append(Line2D([], [], color=_OTHER, linewidth=1.0, label="not read by it"))
    return handles


def _colour(departure: Departure, item: Explanation) -> str:
    return look_of(item.detector).colour if departure.channel in item.inputs else _OTHER


def _write(axes: Axes, text: str, place: tuple[float, float], offset: tuple[float, float], side: str) -> None:
    """Write a text next to a time [s] and a height as a share of the panel; `offset` in points."""
    write(axes, text, place, offset, axes.get_xaxis_transform(), ha=side, va="bottom", fontsize=8)


def _name(axes: Axes, text: str) -> None:
    axes.set_ylabel(text, rotation=0, ha="right", va="center", labelpad=6)

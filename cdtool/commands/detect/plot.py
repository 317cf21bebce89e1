"""One log and one detector: signal and band, trigger and load cell over time (thesis figures 5.6 to 5.8).

A line above it states the outcome in words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.plain_text import counted
from cdtool.commands.detecting.detection import Detected
from cdtool.detectors.detection import Alarm
from cdtool.recordings.recording import Contact
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, label, log_label, new_figure, save, unit_label, write
from cdtool.report.plots.panels import (
    Legend,
    count_from,
    draw_alarm,
    draw_force,
    draw_onset,
    draw_signal,
    draw_trigger,
    frame_signal,
)
from cdtool.report.plots.style import look_of
from cdtool.results.results import ContactResult
from cdtool.results.traces.trace import Span, StatisticCurve
from cdtool.truth.matching import Match

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Before the event, and after the last alarm [s]: what led to it.
_BEFORE = 0.2


@dataclass(frozen=True)
class _Event:
    """What the zoom shows: a contact with the alarm that detected it, or only an alarm."""

    contact: Contact | None
    alarm: Alarm | None

    @property
    def zero(self) -> float:
        if self.contact:
            return self.contact.start
        return self.alarm.time if self.alarm else 0.0


def plot_detected(found: Detected, path: Path) -> None:
    """Draw one log: a panel per joint that alarms (else the leading joint), trigger, load cell, zoom of the event.

    Raises UsageError, CdtoolError (see `save`).
    """
    save(detection_figure(found), path)


def detection_figure(found: Detected) -> Figure:
    """Return the figure of `plot_detected`, which a notebook shows."""
    with drawing():
        return _figure(found)


def _figure(found: Detected) -> Figure:
    alarming, joints = _shown_joints(found)
    recording = found.recording
    whole = (recording.start, recording.end)
    matches = [item for matching in found.matchings for item in matching.matches]
    event = _event(matches, [alarm for item in found.detections for alarm in item.verdict.alarms])
    zoom = _zoom(event, whole)
    spans = [whole] if zoom is None else [whole, zoom]
    forced = "force" in recording and len(recording["force"]) > 0
    heights = [2.3 if len(joints) == 1 else 1.15] * len(joints) + [0.5] + [1.2] * forced
    figure = new_figure(11.0 if zoom else 9.0, 1.5 + sum(heights))
    grid = figure.subplots(
        len(heights),
        len(spans),
        sharex="col",
        squeeze=False,
        height_ratios=heights,
        width_ratios=[1.0, 1.2][: len(spans)],
    )
    detector = found.detections[0].detector if found.detections else ""
    legend = Legend(detector)
    for column, span in enumerate(spans):
        _column(list(grid[:, column]), found, joints, span, matches, legend)
    _name_rows(list(grid[:, 0]), found, joints)
    if zoom is None:
        grid[-1, 0].set_xlabel("time [s]")
    else:
        _finish_zoom(grid, event, zoom)
    _name_event(list(grid[:, -1]), joints, event)
    if event.contact and event.alarm:
        late = next(row for rows in found.contact_rows for row in rows if row.outcome == "detected")
        _write_latency(grid[len(joints), -1], event, number(late.latency_ms, error=late.resolution_ms))
    figure.suptitle(
        f"{log_label(recording.name)}  ·  {label(detector)}\n{_outcome_words(found, alarming, joints)}",
        fontsize=10,
        x=0.01,
        ha="left",
    )
    figure.align_ylabels()
    figure.legend(handles=legend.handles(), loc="outside lower left", ncols=4 if zoom else 3)
    return figure


def _column(
    rows: list[Axes], found: Detected, joints: list[int], span: Span, matches: Sequence[Match], legend: Legend
) -> None:
    parts = [item for item in found.detections if _overlap(item, span)]
    colour = look_of(found.detections[0].detector).colour if found.detections else "0.35"
    for axes, joint in zip(rows, joints, strict=False):
        frame_signal(axes, [StatisticCurve.of(item, joint) for item in parts], span, headroom=2.0)
        for item in parts:
            draw_signal(axes, StatisticCurve.of(item, joint), item.detector, span, legend)
            for alarm in item.verdict.alarms:
                if alarm.column == joint:
                    draw_alarm(axes, alarm, colour, legend)
    draw_trigger(rows[len(joints)], parts, colour, legend)
    if len(rows) > len(joints) + 1:
        force = found.recording["force"]
        draw_force(rows[-1], force.time, force.values[:, 0], span, contact=bool(matches))
    for axes in rows:
        for event in matches:
            draw_onset(axes, event.contact.start, legend)
        axes.set_xlim(span)


def _name_rows(rows: list[Axes], found: Detected, joints: list[int]) -> None:
    unit = unit_label(found.detections[0].statistic.unit) if found.detections else "–"
    for axes, joint in zip(rows, joints, strict=False):
        several = len(found.recording.joints) > 1
        axes.set_ylabel(f"{label(found.joints[joint], 16)}\n[{unit}]" if several else f"signal [{unit}]")
    rows[len(joints)].set_ylabel("trigger")
    if len(rows) > len(joints) + 1:
        rows[-1].set_ylabel(f"load cell [{unit_label(found.recording['force'].unit)}]")


def _finish_zoom(grid: np.ndarray, event: _Event, zoom: Span) -> None:
    grid[-1, 0].set_xlabel("time [s]")
    what = "contact onset" if event.contact else "alarm"
    grid[-1, 1].set_xlabel(f"time from {what} [ms]")
    for axes in grid[:, 0]:
        axes.axvspan(*zoom, facecolor="none", edgecolor="0.3", linewidth=0.8, zorder=5)
    grid[0, 0].set_title("whole log", loc="left")
    count_from(grid[-1, 1], event.zero, 0.1)


def _name_event(rows: list[Axes], joints: list[int], event: _Event) -> None:
    if event.contact:
        side = "left" if event.alarm and event.alarm.time < event.contact.start else "right"
        _write_above(rows[0], event.contact.start, f" onset {event.contact.start:.3f} s ", side)
    if event.alarm and event.alarm.column in joints:
        side = "right" if event.contact and event.alarm.time < event.contact.start else "left"
        axes = rows[joints.index(event.alarm.column)]
        _write_above(axes, event.alarm.time, f" alarm {event.alarm.time:.3f} s ", side, bold=True)


def _write_above(axes: Axes, time: float, text: str, side: str, *, bold: bool = False) -> None:
    weight = "bold" if bold else "normal"
    frame = axes.get_xaxis_transform()
    write(axes, text, (time, 1.0), (0, 3), frame, ha=side, va="bottom", fontsize=9, fontweight=weight)


def _write_latency(axes: Axes, event: _Event, latency_ms: str) -> None:
    if event.contact is None or event.alarm is None:
        return
    axes.annotate(
        "",
        (event.alarm.time, 0.5),
        (event.contact.start, 0.5),
        arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0, "linewidth": 0.9},
    )
    axes.annotate(
        f"latency {latency_ms} ms ",
        (min(event.contact.start, event.alarm.time), 0.5),
        ha="right",
        va="center",
        fontsize=9,
        fontweight="bold",
    )


def _shown_joints(found: Detected) -> tuple[list[int], list[int]]:
    """Return the joints that alarm, and those that are drawn."""
    alarming = sorted({alarm.column for item in found.detections for alarm in item.verdict.alarms})
    leading = sorted({item.leading for item in found.detections})
    return alarming, (alarming or leading)[:6]  # panels that fit on a page: the joints of a robot


def _event(matches: Sequence[Match], alarms: Sequence[Alarm]) -> _Event:
    detected = next((item for item in matches if item.alarm), None)
    if detected or matches:
        chosen = detected or matches[0]
        return _Event(chosen.contact, chosen.alarm)
    return _Event(None, alarms[0] if alarms else None)


def _zoom(event: _Event, whole: Span) -> Span | None:
    if event.contact is None and event.alarm is None:
        return None
    last = max(event.zero, event.alarm.time if event.alarm else event.zero)
    start = max(event.zero - _BEFORE, whole[0])
    end = min(max(event.zero + 0.6, last + _BEFORE), whole[1])
    # A zoom is drawn if it enlarges: it shows less than 40 % of the log.
    return (start, end) if 0.0 < end - start < 0.4 * (whole[1] - whole[0]) else None


def _overlap(detection: Detection, span: Span) -> bool:
    time = detection.statistic.time
    return len(time) > 0 and bool(time[0] <= span[1] and time[-1] >= span[0])


def _outcome_words(found: Detected, alarming: list[int], joints: list[int]) -> str:
    """Return the outcomes of contacts and alarms, what is not assessable, and which joints are drawn.

    Parameters
    ----------
    found : Detected
        The log with the detector's results for each of its operations.
    alarming, joints : list of int
        The columns of the joints that alarm, and of those that are drawn.

    """
    contacts = [row for rows in found.contact_rows for row in rows]
    words = _words_of_contacts(contacts) + _words_of_alarms(found, bool(contacts))
    not_assessable = _words_of_not_assessable(found)
    if not_assessable:
        words = [word for word in words if word not in ("no alarm", "not assessable")]
    operations = [counted(len(found.detections), "operation")] if len(found.detections) > 1 else []
    return "  ·  ".join([*words, *not_assessable, *operations, *_words_of_joints(found, alarming, joints)])


def _words_of_contacts(contacts: Sequence[ContactResult]) -> list[str]:
    detected = sorted((row.latency_ms, row.resolution_ms) for row in contacts if row.latency_ms is not None)
    late = [number(latency, error=resolution) for latency, resolution in detected]
    if not contacts:
        return []
    if len(contacts) == 1:
        return [f"detected after {late[0]} ms" if late else contacts[0].outcome.replace("_", " ")]
    spread = f" after {late[0]} to {late[-1]} ms" if late else ""
    return [f"{len(late)} of {counted(len(contacts), 'contact')} detected{spread}"]


def _words_of_alarms(found: Detected, has_contacts: bool) -> list[str]:
    """Return the number of alarms; with contacts, of those that do not belong to any."""
    if has_contacts:
        extra = sum(len(matching.false_alarms) for matching in found.matchings)
        return [counted(extra, "false alarm")] if extra else []
    alarms = sum(len(item.verdict.alarms) for item in found.detections)
    return [counted(alarms, "alarm") if alarms else "no alarm"]


def _words_of_not_assessable(found: Detected) -> list[str]:
    not_assessable = [item for item in found.detections if item.verdict.outcome == "not_assessable"]
    if not not_assessable:
        return []
    operations = len(found.detections)
    share = f" in {len(not_assessable)} of {operations} operations" if operations > 1 else ""
    return [f"not assessable{share}: {label(not_assessable[0].verdict.reason, 70)}"]


def _words_of_joints(found: Detected, alarming: list[int], joints: list[int]) -> list[str]:
    if len(alarming) > len(joints):
        return [f"{len(joints)} of {len(alarming)} alarming joints shown"]
    if len(found.joints) > len(joints):
        which = "those that alarm" if alarming else "the leading joint"
        return [f"{len(joints)} of {len(found.joints)} joints shown: {which}"]
    return []

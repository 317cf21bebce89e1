"""All detectors under one load-cell curve: who raises an alarm when (thesis figures 5.7 and 5.8)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from cdtool.evaluation.matching import Match, Matching
from cdtool.pipeline import Detection
from cdtool.recording import Contact
from cdtool.report.figures import drawing, label, new_figure, save, unit_label
from cdtool.report.panels import Legend, Span, count_from, draw_force, draw_onset, draw_signal, frame_signal
from cdtool.report.style import look_of
from cdtool.workflows.scoring import Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHORTEST_VIEW, _LONGEST_VIEW = 0.3, 1.2
_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2)


@dataclass(frozen=True)
class _Row:
    """One detector and what became of the contact that is shown."""

    detection: Detection
    matching: Matching
    match: Match | None

    @property
    def late(self) -> float:
        return self.match.latency if self.match and self.match.alarm else math.inf

    @property
    def joint(self) -> int:
        alarms = self.detection.verdict.alarms
        if self.match and self.match.alarm:
            return self.match.alarm.joint
        return alarms[0].joint if alarms else self.detection.leading

    @property
    def trigger(self) -> float | None:
        """When the trigger rises [s]: the contact's alarm, or the first one of a run without contacts."""
        if self.match:
            return self.match.alarm.time if self.match.alarm else None
        alarms = self.detection.verdict.alarms
        return alarms[0].time if alarms else None


def plot_triggers(trace: Trace, path: Path) -> None:
    """Draw the load cell with the contact's onset, below it a row a detector, the fastest first.

    Of several contacts the first that most detectors noticed is shown. Raises UsageError, CdtoolError (see `save`).
    """
    with drawing():
        save(_figure(trace), path)


def _figure(trace: Trace) -> Figure:
    contact = _contact(trace)
    rows = sorted(_rows(trace, contact), key=lambda row: (row.late, row.match is not None and _blind(row)))
    recording = trace.operation.recording
    span = _view(rows, contact, (recording.start, recording.end))
    forced = "force" in recording and len(recording["force"]) > 0
    heights = [1.3] * forced + [0.85] * len(rows)
    figure = new_figure(9.0, 1.4 + sum(heights))
    panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0].tolist()
    legend = Legend(None)
    if forced:
        draw_force(panels[0], recording["force"], span, contact=contact is not None)
        _name(panels[0], f"load cell\n[{unit_label(recording['force'].unit)}]")
    for axes, row in zip(panels[int(forced) :], rows, strict=True):
        _draw_row(axes, row, span, legend)
    for axes in panels:
        if contact:
            draw_onset(axes, contact.start, legend)
        axes.set_xlim(span)
    panels[-1].set_xlabel("time from contact onset [ms]" if contact else "time [s]")
    if contact:
        step = next((step for step in _STEPS if (span[1] - span[0]) / step <= 12), _STEPS[-1])
        count_from(panels[-1], contact.start, step)
    figure.align_ylabels()
    figure.suptitle(_title(trace, contact), fontsize=10, x=0.01, ha="left")
    figure.legend(handles=legend.handles(), loc="outside lower left", ncols=4)
    return figure


def _draw_row(axes: Axes, row: _Row, span: Span, legend: Legend) -> None:
    detection = row.detection
    frame_signal(axes, [(detection.statistic, detection.band)], row.joint, span, headroom=1.5)
    draw_signal(axes, detection, row.joint, span, legend)
    axes.locator_params(axis="y", nbins=3)
    colour = look_of(detection.detector).colour
    if row.trigger is not None:
        axes.axvspan(row.trigger, span[1], color=colour, alpha=0.25, linewidth=0, zorder=1.5)
        axes.axvline(row.trigger, color=colour, linewidth=2.2, zorder=4)
        legend.add("trigger")
    names = detection.statistic.joints
    joint = f" {label(names[row.joint], 14)}" if len(detection.operation.recording.joints) > 1 else ""
    _name(axes, f"{label(detection.detector, 24)}\n[{unit_label(detection.statistic.unit)}]{joint}")
    verdict, detail = _verdict(row)
    axes.annotate(
        verdict,
        (1.0, 0.5),
        xycoords="axes fraction",
        xytext=(8, 0),
        textcoords="offset points",
        va="bottom" if detail else "center",
        fontsize=10,
        fontweight="bold",
    )
    axes.annotate(
        detail,
        (1.0, 0.5),
        xycoords="axes fraction",
        xytext=(8, -3),
        textcoords="offset points",
        va="top",
        fontsize=8,
    )


def _verdict(row: _Row) -> tuple[str, str]:
    verdict = row.detection.verdict
    if _blind(row):
        return "not assessable", fill(label(verdict.reason, 66), 24)
    count = len(row.matching.false_alarms)
    false = f"{count} false {'alarm' if count == 1 else 'alarms'}" if count else ""
    if row.match is None:
        return (false or "no alarm"), ""
    if row.match.alarm:
        return f"{1e3 * row.late:.0f} ms", false
    return "missed", false


def _blind(row: _Row) -> bool:
    if row.match:
        return row.match.outcome == "not_assessable"
    return row.detection.verdict.outcome == "not assessable"


def _name(axes: Axes, text: str) -> None:
    axes.set_ylabel(text, rotation=0, ha="right", va="center", labelpad=6)


def _contact(trace: Trace) -> Contact | None:
    def noticed(contact: Contact) -> int:
        return sum(bool(m.alarm) for matching in trace.matchings for m in matching.matches if m.contact == contact)

    return max(trace.contacts, key=noticed, default=None)


def _rows(trace: Trace, contact: Contact | None) -> list[_Row]:
    return [
        _Row(detection, matching, next((m for m in matching.matches if m.contact == contact), None))
        for detection, matching in zip(trace.detections, trace.matchings, strict=True)
    ]


def _view(rows: list[_Row], contact: Contact | None, whole: Span) -> Span:
    if contact is None:
        return whole
    latest = max((row.late for row in rows if math.isfinite(row.late)), default=0.0)
    length = min(max(1.25 * latest, _SHORTEST_VIEW), _LONGEST_VIEW)
    return max(contact.start - 0.25 * length, whole[0]), min(contact.start + length, whole[1])


def _title(trace: Trace, contact: Contact | None) -> str:
    words = [f"{label(trace.group, 40)}  ·  {label(trace.operation.name, 50)}"]
    if contact is None:
        words.append("no contact")
    elif len(trace.contacts) > 1:
        words.append(f"contact {trace.contacts.index(contact) + 1} of {len(trace.contacts)}")
    if contact and math.isfinite(contact.peak_force):
        words.append(f"peak {contact.peak_force:.0f} N")
    return "  ·  ".join(words)

"""The curves of one operation, decimated and stored at detection, so that reports draw without computing again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import StatusArray
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact
from cdtool.results.traces.decimation import mark_kept
from cdtool.truth.matching import Match, Matching

Span = tuple[float, float]

# Decimals of a time [s], and steps over the range of a panel: a plot has fewer pixels.
TIME_DECIMALS, LEVELS = 5, 8000
# Columns of pixels kept of the whole operation, and again of the view on the contact.
_WHOLE, _VIEW = 200, 250


@dataclass(frozen=True)
class StatisticCurve:
    """A statistic of one joint with its limits and status, each (m,), on `time` (m,) [s]."""

    time: FloatArray
    value: FloatArray
    lower: FloatArray
    upper: FloatArray
    status: StatusArray

    @classmethod
    def of(cls, detection: Detection, joint: int) -> Self:
        """Return every sample of one column of a detection."""
        statistic, band = detection.statistic, detection.band
        return cls(
            statistic.time,
            statistic.values[:, joint],
            band.lower[:, joint],
            band.upper[:, joint],
            statistic.status[:, joint],
        )

    def at(self, kept: np.ndarray | slice) -> StatisticCurve:
        """Return the samples at these indices, of this mask or of this slice (without a copy)."""
        return StatisticCurve(self.time[kept], self.value[kept], self.lower[kept], self.upper[kept], self.status[kept])

    def within(self, span: Span) -> StatisticCurve:
        """Return the samples from span[0] to span[1] [s]."""
        first, last = np.searchsorted(self.time, span[0]), np.searchsorted(self.time, span[1], side="right")
        return self.at(slice(int(first), int(last)))

    def decimated(self, view: Span | None) -> StatisticCurve:
        """Return the samples, rounded, that draw the same picture: coarse for the whole, fine in the view."""
        kept = np.zeros(len(self.time), dtype=np.bool_)
        mark_kept(self.time, self.value, _WHOLE, kept)
        if view is not None:
            first, last = np.searchsorted(self.time, view[0]), np.searchsorted(self.time, view[1], side="right")
            if last > first:
                mark_kept(self.time[first:last], self.value[first:last], _VIEW, kept[first:last])
        found = self.at(np.flatnonzero(kept))
        # One scale, so that a value above a limit is never below it.
        value, lower, upper = rounded(found.value, found.lower, found.upper)
        return StatisticCurve(np.round(found.time, TIME_DECIMALS), value, lower, upper, found.status)


def rounded(*curves: FloatArray) -> list[FloatArray]:
    """Return curves of one scale with the decimals that a plot shows: few, so that they are short as text."""
    known = np.concatenate(curves)
    known = known[np.isfinite(known)]
    span = float(np.ptp(known)) if len(known) else 0.0
    if span == 0.0:
        return list(curves)
    exact = 15 - math.ceil(math.log10(float(np.abs(known).max())))  # the significant digits of a float64
    decimals = min(math.ceil(math.log10(LEVELS / span)), exact)
    return [np.round(curve, decimals) for curve in curves]


@dataclass(frozen=True)
class ContactOutcome:
    """The outcome of one contact; its latency `late` and `alarm` [s] are NaN unless it was detected."""

    outcome: str
    late: float = math.nan
    alarm: float = math.nan
    reason: str = ""


@dataclass(frozen=True)
class Panel:
    """One detector over one operation: the curve of the joint that raised the alarm, otherwise of the leading one.

    `seen` has one entry per contact of the trace; `alarms` and `false_alarms` are times [s]; `why` explains the alarms
    and misses in plain sentences. `rearmed`: when each alarm was re-armed [s], infinite if never; empty if unknown.
    """

    detector: str
    unit: str
    joint: str
    course: StatisticCurve
    verdict: str
    reason: str
    seen: tuple[ContactOutcome, ...]
    alarms: tuple[float, ...]
    false_alarms: tuple[float, ...]
    why: tuple[str, ...] = ()
    rearmed: tuple[float, ...] = ()

    @property
    def is_not_assessable(self) -> bool:
        """Whether no sample was assessable."""
        return self.verdict == "not_assessable"


@dataclass(frozen=True)
class Trace:
    """One operation with every detector's panel: `contact` is the number in `contacts` that is shown, -1 for none.

    `recording` is its name, LOG#N for `operation` N of a log that is cut. `view` is the interval around the contact
    [s]; `force` (m,) [N] is the load cell on `force_time`, empty without one. `chosen` states why the trace was stored;
    `joints` is the number of the machine's joints.
    """

    recording: str
    group: str
    start: float
    end: float
    contacts: tuple[Contact, ...]
    contact: int
    view: Span
    force_time: FloatArray
    force: FloatArray
    panels: tuple[Panel, ...]
    joints: int = 1
    chosen: str = ""
    operation: int = 0

    @property
    def log(self) -> str:
        """Return the recording as the rows of results name it."""
        return self.recording.removesuffix(f"#{self.operation}") if self.operation else self.recording

    @property
    def shown(self) -> Contact | None:
        """Return the contact that is shown."""
        return self.contacts[self.contact] if self.contact >= 0 else None


def make_trace(
    group: str,
    operation: Operation,
    contacts: Sequence[Contact],
    detections: Sequence[Detection],
    matchings: Sequence[Matching],
    why: Sequence[Sequence[str]] = (),
    chosen: str = "",
) -> Trace:
    """Return the decimated curves of an operation, for figures.

    Parameters
    ----------
    group : str
        The group of impacts.
    operation : Operation
        The operation.
    contacts : sequence of Contact
        Its contacts.
    detections : sequence of Detection
        One per detector.
    matchings : sequence of Matching
        Their alarms and contacts, in the order of `detections`.
    why : sequence of sequence of str
        Explanations of each detection's alarms.
    chosen : str
        Why the trace is stored.

    Returns
    -------
    Trace
        The contact shown is the first that most detectors noticed.

    Examples
    --------
    `cdtool.benchmark` returns the traces.
    """
    recording = operation.recording
    contact = _most_noticed(contacts, matchings)
    found = [matching.matches[contact] if contact >= 0 else None for matching in matchings]
    view = _view(contacts[contact] if contact >= 0 else None, found, (recording.start, recording.end))
    panels = [
        _panel(detection, matching, shown, view if contact >= 0 else None, reasons)
        for detection, matching, shown, reasons in zip(
            detections, matchings, found, why or [()] * len(detections), strict=True
        )
    ]
    force_time, force = _force(operation, view if contact >= 0 else None)
    return Trace(
        recording=operation.name,
        group=group,
        start=round(recording.start, TIME_DECIMALS),
        end=round(recording.end, TIME_DECIMALS),
        contacts=tuple(contacts),
        contact=contact,
        view=(round(view[0], TIME_DECIMALS), round(view[1], TIME_DECIMALS)),
        force_time=force_time,
        force=force,
        panels=tuple(panels),
        joints=len(recording.joints),
        chosen=chosen,
        operation=operation.number,
    )


def _panel(
    detection: Detection, matching: Matching, shown: Match | None, view: Span | None, why: Sequence[str]
) -> Panel:
    alarms = detection.verdict.alarms
    alarm = shown.alarm if shown and shown.alarm else (alarms[0] if alarms else None)
    joint = alarm.column if alarm else detection.leading
    return Panel(
        detector=detection.detector,
        unit=detection.statistic.unit,
        joint=detection.statistic.joints[joint],
        course=StatisticCurve.of(detection, joint).decimated(view),
        verdict=detection.verdict.outcome,
        reason=detection.verdict.reason,
        seen=tuple(
            ContactOutcome(item.outcome, item.latency, item.alarm.time if item.alarm else math.nan, item.reason)
            for item in matching.matches
        ),
        alarms=tuple(item.time for item in alarms),
        false_alarms=tuple(item.time for item in matching.false_alarms),
        why=tuple(why),
        rearmed=detection.verdict.rearmed,
    )


def _most_noticed(contacts: Sequence[Contact], matchings: Sequence[Matching]) -> int:
    if not contacts or not matchings:
        return -1
    noticed = [sum(bool(matching.matches[i].alarm) for matching in matchings) for i in range(len(contacts))]
    return noticed.index(max(noticed))


def _view(contact: Contact | None, found: Sequence[Match | None], whole: Span) -> Span:
    if contact is None:
        return whole
    latest = max((item.latency for item in found if item and item.alarm), default=0.0)
    length = min(max(1.25 * latest, 0.3), 1.2)
    return max(contact.start - 0.25 * length, whole[0]), min(contact.start + length, whole[1])


def _force(operation: Operation, view: Span | None) -> tuple[FloatArray, FloatArray]:
    recording = operation.recording
    if "force" not in recording or not len(recording["force"]):
        return np.empty(0), np.empty(0)
    series = recording["force"]
    force = series.values[:, 0]
    nothing = np.zeros(len(force), dtype=np.uint8)
    course = StatisticCurve(series.time, force, force, force, nothing).decimated(view)
    return course.time, course.value

"""Why each alarm was raised and each contact missed: joint, limit, margin over time, what left its normal band."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import UsageError
from cdtool.detectors.detection import Alarm
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact
from cdtool.results.explanation.departure import Departure, departures
from cdtool.results.explanation.glitch import Glitch, glitches
from cdtool.results.explanation.margin import Approach, JointMargin, Moment, joint_margins
from cdtool.thresholds.normal_motion import Absence, NormalMotion, NormalMotions
from cdtool.truth.matching import Match, Matching

Role = Literal["detection", "further alarm", "in progress", "false alarm", "alarm", "missed", "not_assessable"]

#: Times at which the margin to an alarm is reported [s].
TO_ALARM = (-0.1, -0.05, -0.02, -0.01, -0.005, 0.0)
#: Times from the onset of a missed contact at which it is reported [s].
FROM_ONSET = (-0.1, 0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
#: Departures are searched for from this long before an onset [s]: the largest delay of a load cell.
LEAD_OF_ONSET = 0.05
#: Without a contact, from this long before the signal left its band [s]: a soft contact takes as long.
LEAD_OF_ALARM = 0.9
#: Compared with the log's own past from this long before [s]: a line does not hold longer.
LEAD_OF_OWN_PAST = 0.35
#: Until this long after an onset or an alarm [s].
AFTERMATH = 0.5
#: Glitches are searched for from this long before the signal left its band [s].
SHORTLY = 0.3


@dataclass(frozen=True)
class Explanation:
    """Why an `alarm` was raised or, without one, a `contact` was missed; `role` states which.

    An alarm: since `left` [s] the statistic was outside, for `debounce` consecutive samples; `skipped` samples were
    missing among them. `contact` is the one that it belongs to; None also for a contact in progress when the recording
    began, since its onset is not recorded.

    A contact that was missed or not assessable (`reason`): an alarm would have counted for `watched` [s] after its
    onset; `not_judged` is the share of samples there that were not assessable, by reason, and `approaches` state how
    near each joint came, the nearest first.

    Both: `moments` are the margin over time of `joint`, `departed` the channels in the order in which they left their
    normal band, `glitches` those of the sensors; `inputs` names the channels that the detector reads. `runs`: number
    of impact-free runs that the channels were compared with; without any, `absent` is the reason, and the log's own
    past was used.
    """

    operation: str
    detector: str
    unit: str
    joint: str
    role: Role
    contact: Contact | None
    debounce: int
    moments: tuple[Moment, ...]
    departed: tuple[Departure, ...]
    glitches: tuple[Glitch, ...]
    inputs: tuple[str, ...]
    runs: int
    absent: Absence | None
    alarm: Alarm | None = None
    left: float = math.nan
    skipped: int = 0
    reason: str = ""
    watched: float = math.nan
    not_judged: Mapping[str, float] = field(default_factory=dict)  # language: a field of --json and results.json
    approaches: tuple[Approach, ...] = ()

    @property
    def zero(self) -> float:
        """Return the time from which others count [s]: the contact's onset, else the alarm."""
        return self.contact.start if self.contact else self.alarm.time if self.alarm else math.nan


def explain_operation(
    detection: Detection,
    matching: Matching,
    activation: Activation,
    inputs: Sequence[str] = (),
    normals: NormalMotions = NormalMotions(),  # noqa: B008
) -> tuple[Explanation, ...]:
    """Explain every alarm of an operation and every missed contact.

    Parameters
    ----------
    detection : Detection
        The result of a detector for the operation.
    matching : Matching
        The operation's contacts with their outcomes, and its false alarms.
    activation : Activation
        The activation that raised the alarms.
    inputs : sequence of str
        Channels that the detector needs: the explanation states which of them left its normal band first.
    normals : NormalMotions
        The normal motion of impact-free runs. Without any, each channel is compared with its own past.

    Returns
    -------
    tuple of Explanation
        In order of time: one per alarm and per contact without one. A contact in progress when the recording begins
        has none of its own: without an onset it is not missed.

    Notes
    -----
    A diagnosis after the event: it uses the recording before and after an alarm, and no result depends on it.

    Examples
    --------
    The gate's stiff test without impact-free runs; the momentum observer with a limit of 400 N detects the contact.

    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> found = cdtool.detect(log, machine, detector="momentum", settings={"threshold.limits": 400.0}).detected
    >>> (alarm,) = explain_operation(found.detections[0], found.matchings[0], found.activation)
    >>> alarm.role, alarm.joint, alarm.debounce, alarm.absent.value
    ('detection', 'gate', 9, 'limits set by hand')
    """
    explainer = Explainer(detection, activation, tuple(inputs), normals)
    # One that detects a contact of this operation may be in another one, which explains it.
    alarms = {*detection.verdict.alarms, *(item.alarm for item in matching.matches if item.alarm)}
    found = [
        explainer.alarm(alarm, *_belonging(alarm, detection, matching))
        for alarm in alarms & {*detection.verdict.crossings}
    ]
    found += [explainer.miss(item) for item in matching.matches if item.alarm is None and not item.contact.in_progress]
    return tuple(sorted(found, key=lambda item: (item.alarm.time if item.alarm else item.zero, item.joint)))


@dataclass(frozen=True)
class Explainer:
    """Explains alarms and missed contacts of one `detection` by its `activation`; see `explain_operation`."""

    detection: Detection
    activation: Activation
    inputs: tuple[str, ...] = ()
    normals: NormalMotions = field(default_factory=NormalMotions)

    @cached_property
    def margins(self) -> tuple[JointMargin, ...]:
        """Return the margin of every joint of the signal."""
        return joint_margins(self.detection)

    @cached_property
    def normal(self) -> NormalMotion | Absence:
        """Return the normal motion to compare the operation with, or why it is missing."""
        operation = self.detection.operation
        return self.normals.of(operation.recording, operation.motion)

    def alarm(self, alarm: Alarm, contact: Contact | None = None, role: Role = "detection") -> Explanation:
        """Explain one of the detection's alarms, which belongs to a contact or not; raises UsageError for others."""
        margin = self.margins[alarm.column]
        at = int(np.searchsorted(margin.time, alarm.time))
        containing = margin.runs[(margin.runs[:, 0] <= at) & (margin.runs[:, 1] >= at), 0]
        if not len(containing):
            raise UsageError(
                f"{self.detection.operation.name}: no alarm at {alarm.time:g} s", "give one of this detection"
            )
        first = int(containing[0])
        if contact is not None and contact.in_progress:
            contact, role = None, "in progress"
        times = [alarm.time + step for step in TO_ALARM] + ([contact.start] if contact else [])
        return self._explained(
            margin.name,
            contact,
            (float(margin.time[first]), alarm.time),
            role=role,
            moments=margin.moments(times),
            alarm=alarm,
            left=float(margin.time[first]),
            skipped=at - first + 1 - self._debounce,
        )

    def miss(self, match: Match) -> Explanation:
        """Explain how near a contact without an alarm came to one, for the time in which one would have counted."""
        contact, statistic = match.contact, self.detection.statistic
        closes = contact.start + match.watched
        tried = [(item, item.approach(contact.start, closes, self._debounce)) for item in self.margins]
        # A large share of the limit that was held is nearest, otherwise the longest run outside.
        near = sorted(
            ((item, found) for item, found in tried if found),
            key=lambda pair: (-np.nan_to_num(pair[1].held, nan=-np.inf), -pair[1].longest),
        )
        joint, moments = statistic.joints[self.detection.leading], tuple[Moment, ...]()
        if near:
            margin, approach = near[0]
            times = [contact.start + step for step in FROM_ONSET if step <= match.watched]
            joint, moments = margin.name, margin.moments([*times, approach.nearest.time])
        return self._explained(
            joint,
            contact,
            (contact.start, contact.start),
            role="not_assessable" if match.outcome == "not_assessable" else "missed",
            moments=moments,
            reason=match.reason,
            watched=match.watched,
            not_judged=statistic.shares(contact.start, closes),
            approaches=tuple(found for _, found in near),
        )

    @property
    def _debounce(self) -> int:
        return self.activation.samples(self.detection.statistic.period)

    def _explained(self, joint: str, contact: Contact | None, span: tuple[float, float], **parts: Any) -> Explanation:
        """Add what left its normal band, and the glitches, around the time from exit to alarm, or the onset [s]."""
        operation, (left, until) = self.detection.operation, span
        recording = operation.recording.without_ground_truth()
        normal = self.normal if isinstance(self.normal, NormalMotion) else None
        leading = recording.joints[(normal or operation).motion.joint]
        begin = (
            contact.start - LEAD_OF_ONSET - contact.uncertainty
            if contact
            else left - (LEAD_OF_ALARM if normal else LEAD_OF_OWN_PAST)
        )
        departed = departures(recording, normal, joint, leading, begin, until + AFTERMATH)
        return Explanation(
            operation=operation.name,
            detector=self.detection.detector,
            unit=self.detection.statistic.unit,
            joint=joint,
            contact=contact,
            debounce=self._debounce,
            departed=departed,
            glitches=glitches(recording, self.inputs or tuple(recording.channels), departed, left - SHORTLY, until),
            inputs=self.inputs,
            runs=normal.runs if normal else 0,
            absent=None if isinstance(self.normal, NormalMotion) else self.normal,
            **parts,
        )


def _belonging(alarm: Alarm, detection: Detection, matching: Matching) -> tuple[Contact | None, Role]:
    """Return the contact that an alarm belongs to, and the role of the alarm."""
    for item in matching.matches:
        if item.alarm == alarm:
            return item.contact, "detection"
    earlier = [item.contact for item in matching.matches if item.contact.start - item.contact.uncertainty <= alarm.time]
    # Alarms of several joints at much the same time count as one false alarm.
    if alarm in matching.false_alarms or not earlier:
        recording = detection.operation.recording
        if detection.operation.log and not any(item.time <= alarm.time for item in matching.false_alarms):
            return None, "further alarm"
        known = bool(matching.matches) or any(channel in recording for channel in SHOWS_CONTACTS)
        return None, "false alarm" if known else "alarm"
    return max(earlier, key=lambda contact: contact.start), "further alarm"

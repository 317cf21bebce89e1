"""Why each alarm was raised and each contact missed: joint, limit, margin over time, first movement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import UsageError
from cdtool.detectors.detection import Alarm
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact
from cdtool.results.explanation.cause import Cause, Event
from cdtool.results.explanation.diagnosis import diagnose_alarm, diagnose_contact
from cdtool.results.explanation.margin import Approach, JointMargin, Moment, joint_margins
from cdtool.results.explanation.movement import Movement, which_moved_first
from cdtool.thresholds.normal_choice import Absence, NormalMotions
from cdtool.truth.matching import Match, Matching

Role = Literal["detection", "further alarm", "in progress", "false alarm", "alarm"]

# Times at which the margin is reported [s]: to the alarm; from the onset of a missed contact.
_TO_ALARM = (-0.1, -0.05, -0.02, -0.01, -0.005, 0.0)
_FROM_ONSET = (-0.1, 0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
# Largest delay of a load cell [s]; the delay of an alarm is unknown without a contact.
_LEAD_OF_ONSET, _LEAD_OF_ALARM = 0.05, 0.3
# Time after an onset in which channels are analysed [s].
_AFTERMATH = 0.5


@dataclass(frozen=True)
class AlarmExplanation:
    """Why an alarm was raised: since `left` [s] the statistic was outside, for `debounce` consecutive samples.

    `skipped` samples were missing among them. `contact` is the one that the alarm belongs to; None also for a contact
    in progress when the recording began, since its onset is not recorded. `moved` are the channels in the order in
    which they moved; `inputs` names those that the detector needs. `cause` is the likely one, derived without load cell
    and labels. `runs`: number of impact-free runs that the channels were compared with; without any, `absent` is the
    reason, and the log's own past was used.
    """

    operation: str
    detector: str
    unit: str
    joint: str
    role: Role
    alarm: Alarm
    contact: Contact | None
    left: float
    debounce: int
    skipped: int
    moments: tuple[Moment, ...]
    moved: tuple[Movement, ...]
    inputs: tuple[str, ...]
    cause: Cause
    runs: int = 0
    absent: Absence | None = None

    @property
    def zero(self) -> float:
        """Return the time from which others count [s]: the contact's onset, else the alarm."""
        return self.contact.start if self.contact else self.alarm.time


@dataclass(frozen=True)
class MissExplanation:
    """Why a contact was missed, or was not assessable (`reason`): how near each joint came, the nearest first.

    `watched` [s]: how long after the onset an alarm would have counted. `not_judged`: share of the samples there that
    were not assessable, by reason. `joint` is the nearest one; `moments` and `moved` describe it. `runs` and `absent`
    are as for an alarm.
    """

    operation: str
    detector: str
    unit: str
    joint: str
    contact: Contact
    outcome: Literal["missed", "not_assessable"]
    reason: str
    watched: float
    debounce: int
    not_judged: Mapping[str, float]  # language: a field of --json and results.json
    approaches: tuple[Approach, ...]
    moments: tuple[Moment, ...]
    moved: tuple[Movement, ...]
    inputs: tuple[str, ...]
    runs: int = 0
    absent: Absence | None = None

    @property
    def zero(self) -> float:
        """Return the time from which others count [s]: the contact's onset."""
        return self.contact.start


Explanation = AlarmExplanation | MissExplanation


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
        Channels that the detector needs: the explanation states which of them moved first.
    normals : NormalMotions
        The normal motion of impact-free runs. Without any, each channel is compared with its own past.

    Returns
    -------
    tuple of AlarmExplanation or MissExplanation
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
    >>> found = cdtool.detect(log, machine, detector="momentum", limit=[400.0]).detected
    >>> (alarm,) = explain_operation(found.detections[0], found.matchings[0], found.activation)
    >>> alarm.role, alarm.joint, alarm.debounce, alarm.absent.value
    ('detection', 'gate', 9, 'limits set by hand')
    """
    margins = joint_margins(detection)
    detecting = {item.alarm: item.contact for item in matching.matches if item.alarm}
    found: list[Explanation] = [
        _as_role(role, explain_alarm(detection, alarm, activation, contact, inputs, margins, normals))
        for alarm in {*detection.verdict.alarms, *detecting}
        # One that detects a contact of this operation may be in another one, which explains it.
        if alarm in detection.verdict.crossings
        for contact, role in [_belonging(alarm, detection, matching)]
    ]
    found += [
        explain_miss(detection, item, activation, inputs, margins, normals)
        for item in matching.matches
        if item.alarm is None and not item.contact.in_progress
    ]
    return tuple(sorted(found, key=_order))


def explain_alarm(
    detection: Detection,
    alarm: Alarm,
    activation: Activation,
    contact: Contact | None = None,
    inputs: Sequence[str] = (),
    margins: Sequence[JointMargin] = (),
    normals: NormalMotions = NormalMotions(),  # noqa: B008
) -> AlarmExplanation:
    """Explain an alarm of a detection.

    Parameters
    ----------
    detection : Detection
        The result of a detector for an operation.
    alarm : Alarm
        One of its alarms.
    activation : Activation
        The activation that raised it.
    contact : Contact, optional
        The contact that it belongs to; times count from its onset.
    inputs : sequence of str
        Channels that the detector needs.
    margins : sequence of JointMargin
        The `joint_margins` of the detection, if they are available; computed if empty.
    normals : NormalMotions
        The normal motion of impact-free runs.

    Returns
    -------
    AlarmExplanation
        Its role is "detection" with a contact, otherwise "alarm": only `explain_operation` knows whether it is false.

    Raises
    ------
    UsageError
        The alarm is of another detection.

    Examples
    --------
    `explain_operation` explains every alarm of an operation.
    """
    margin = (margins or joint_margins(detection))[alarm.column]
    at = int(np.searchsorted(margin.time, alarm.time))
    runs = margin.runs
    containing = runs[(runs[:, 0] <= at) & (runs[:, 1] >= at), 0]
    if not len(containing):
        raise UsageError(f"{detection.operation.name}: no alarm at {alarm.time:g} s", "give one of this detection")
    first = int(containing[0])
    debounce = activation.samples(detection.statistic.period)
    left = float(margin.time[first])
    times = [alarm.time + step for step in _TO_ALARM]
    recording = detection.operation.recording.without_ground_truth()
    role: Role = "detection" if contact else "alarm"
    if contact is not None and contact.in_progress:
        contact, role = None, "in progress"
    if contact:
        times.append(contact.start)
        own_past = partial(_moved_at_contact, detection, margin.name, contact, alarm.time)
    else:
        own_past = partial(which_moved_first, recording, margin.name, alarm.time, lead=_LEAD_OF_ALARM, after=0.0)
    event = Event(margin.name, left, alarm.time, tuple(inputs), detection.operation.motion)
    diagnosis = diagnose_alarm(recording, event, normals, own_past)
    return AlarmExplanation(
        operation=detection.operation.name,
        detector=detection.detector,
        unit=detection.statistic.unit,
        joint=margin.name,
        role=role,
        alarm=alarm,
        contact=contact,
        left=left,
        debounce=debounce,
        skipped=at - first + 1 - debounce,
        moments=margin.moments(times),
        moved=diagnosis.moved,
        inputs=tuple(inputs),
        cause=diagnosis.cause,
        runs=diagnosis.runs,
        absent=diagnosis.absent,
    )


def explain_miss(
    detection: Detection,
    match: Match,
    activation: Activation,
    inputs: Sequence[str] = (),
    margins: Sequence[JointMargin] = (),
    normals: NormalMotions = NormalMotions(),  # noqa: B008
) -> MissExplanation:
    """Explain how near a missed contact came to an alarm.

    Parameters
    ----------
    detection : Detection
        The result of a detector for an operation.
    match : Match
        The contact with its outcome; an alarm would have counted for `match.watched` [s] after its onset.
    activation : Activation
        The activation that was used: its debounce is what an alarm requires.
    inputs : sequence of str
        Channels that the detector needs.
    margins : sequence of JointMargin
        The `joint_margins` of the detection, if they are available; computed if empty.
    normals : NormalMotions
        The normal motion of impact-free runs.

    Returns
    -------
    MissExplanation
        The joints in order of their approach, the nearest first; none if no sample was assessable.

    Examples
    --------
    With a limit of 4000 N the momentum observer misses the gate's stiff contact.

    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> found = cdtool.detect(log, machine, detector="momentum", limit=[4000.0]).detected
    >>> miss = explain_miss(found.detections[0], found.matchings[0].matches[0], found.activation)
    >>> miss.outcome, miss.joint, miss.approaches[0].longest
    ('missed', 'gate', 0)
    """
    contact, statistic = match.contact, detection.statistic
    closes = contact.start + match.watched
    debounce = activation.samples(statistic.period)
    tried = [(item, item.approach(contact.start, closes, debounce)) for item in margins or joint_margins(detection)]
    near = sorted(((item, found) for item, found in tried if found), key=lambda pair: _distance(pair[1]))
    joint = near[0][0].name if near else statistic.joints[detection.leading]
    moments: tuple[Moment, ...] = ()
    if near:
        margin, approach = near[0]
        times = [contact.start + step for step in _FROM_ONSET if step <= match.watched]
        moments = margin.moments([*times, approach.nearest.time])
    own_past = partial(_moved_at_contact, detection, joint, contact, contact.start)
    recording = detection.operation.recording.without_ground_truth()
    begin, until = contact.start - _LEAD_OF_ONSET - contact.uncertainty, contact.start + _AFTERMATH
    diagnosis = diagnose_contact(recording, joint, begin, until, normals, own_past)
    return MissExplanation(
        operation=detection.operation.name,
        detector=detection.detector,
        unit=statistic.unit,
        joint=joint,
        contact=contact,
        outcome="not_assessable" if match.outcome == "not_assessable" else "missed",
        reason=match.reason,
        watched=match.watched,
        debounce=debounce,
        not_judged=statistic.shares(contact.start, closes),
        approaches=tuple(approach for _, approach in near),
        moments=moments,
        moved=diagnosis.moved,
        inputs=tuple(inputs),
        runs=diagnosis.runs,
        absent=diagnosis.absent,
    )


def _moved_at_contact(detection: Detection, joint: str, contact: Contact, until: float) -> tuple[Movement, ...]:
    return which_moved_first(
        detection.operation.recording,
        joint,
        contact.start,
        lead=_LEAD_OF_ONSET + contact.uncertainty,
        after=max(_AFTERMATH, until - contact.start),
    )


def _as_role(role: Role, item: AlarmExplanation) -> AlarmExplanation:
    """Return the explanation of an alarm that is known to be a `role`; in a contact in progress it stays that."""
    return item if item.role == "in progress" else replace(item, role=role)


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


def _distance(approach: Approach) -> tuple[float, int]:
    """Return the order of approaches: a large held share first, otherwise the longest run outside."""
    return (-np.nan_to_num(approach.held, nan=-np.inf), -approach.longest)


def _order(item: Explanation) -> tuple[float, str]:
    return (item.alarm.time if isinstance(item, AlarmExplanation) else item.contact.start, item.joint)

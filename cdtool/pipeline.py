"""One log through detector, threshold and activation, and what that says of each of its operations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.activation import Activation
from cdtool.clock import previous_value
from cdtool.clock.lost import lost_samples
from cdtool.detection import REASONS, Alarm, Band, Signal, Status, Verdict
from cdtool.detectors.base import Detector
from cdtool.detectors.contract import checked_signal
from cdtool.dynamics import Machine
from cdtool.judgement import Judgement, judged
from cdtool.motion import MotionClass
from cdtool.motion.applicable import HOLD
from cdtool.motion.speed_course import TOLERANCE
from cdtool.operations import Operation
from cdtool.recording import BoolArray, FloatArray, Recording
from cdtool.thresholds.base import FittedThreshold

# From this share of its samples at another speed on, an operation without an alarm is one of another motion.
_ANOTHER_MOTION = 0.5
# Below this share of the slowest learned speed an axis is said to be at rest.
_AT_REST = 0.01


@dataclass(frozen=True)
class Stretch:
    """A part of an operation that cannot be judged: why, from when to when [s], from where to where [load unit]."""

    reason: str
    start: float
    end: float
    way_start: float
    way_end: float


@dataclass(frozen=True)
class Detection:
    """What a detector and its threshold say of one operation, with all that led there.

    `threshold` is None where none applies. `judgement` is that of the whole log, of which the operation is `rows`.
    """

    operation: Operation
    detector: str
    statistic: Signal
    band: Band
    verdict: Verdict
    signal: Signal | None = None
    threshold: FittedThreshold | None = None
    judgement: Judgement | None = None
    rows: slice = field(default_factory=lambda: slice(None))

    def exceedance(self) -> FloatArray:
        """For each sample (n, J) the safety factor at which its limit would be met; -inf without a threshold."""
        if self.judgement is None:
            return np.full(self.statistic.values.shape, -np.inf)
        return self.judgement.met_at[self.rows]

    @property
    def begins(self) -> tuple[float, ...]:
        """Where strokes of the log begin for thresholds and activation [s], the first one apart."""
        return tuple(item.applies for item in self.judgement.strokes[1:]) if self.judgement else ()

    @property
    def other_speed(self) -> str:
        """What was measured where no learned class fitted, and what was learned, in words; empty where one always did.

        The speed is the median of the leading joint over the samples at another speed.
        """
        joint, recording = self.operation.motion.joint, self.operation.recording
        other = self.statistic.time[(self.statistic.status == Status.OTHER_SPEED).any(axis=1)]
        if self.judgement is None or not len(other) or "speed" not in recording:
            return ""
        speeds = previous_value(recording["speed"], other)[:, joint]
        speed = float(np.median(speeds[np.isfinite(speeds)])) if np.isfinite(speeds).any() else 0.0
        unit = recording["speed"].unit
        classes = [replace(item, unit=item.unit or unit) for item in self.judgement.classes]
        moves = abs(speed) >= _AT_REST * min(item.nominal_speed for item in classes)
        measured = MotionClass(int(np.sign(speed)) if moves else 0, abs(speed), joint, unit=unit)
        # A speed of the right size may come at the wrong place: a start where the stroke should run, say.
        where = " in another part of the stroke" if any(measured.matches(item, TOLERANCE) for item in classes) else ""
        return f"measured {measured.described}{where}, learned {' and '.join(item.described for item in classes)}"

    @property
    def leading(self) -> int:
        """The statistic's column of the joint that leads the motion; the first where that one is not watched."""
        recording = self.operation.recording
        name = recording.joints[self.operation.motion.joint]
        return self.statistic.joints.index(name) if name in self.statistic.joints else 0

    @property
    def assessed_seconds(self) -> float:
        """For how long the operation was watched [s]: the time of the valid samples of its best-watched joint."""
        if not len(self.statistic.time):
            return 0.0
        return self.statistic.period * float(np.count_nonzero(self.statistic.valid, axis=0).max())

    def not_judged(self) -> list[Stretch]:
        """The stretches in which the leading joint's signal could not be judged, in order of time."""
        joint = self.operation.motion.joint
        status, time = self.statistic.status[:, self.leading], self.statistic.time
        edges = np.flatnonzero(np.diff(status)) + 1
        starts, ends = [0, *edges.tolist()], [*(edges - 1).tolist(), len(status) - 1]
        found = [(a, b) for a, b in zip(starts, ends, strict=True) if len(status) and status[a] != Status.VALID]
        recording = self.operation.recording
        way = (
            previous_value(recording["position"], time)[:, joint]
            if "position" in recording
            else np.full(len(time), np.nan)
        )
        return [
            Stretch(REASONS[int(status[a])], float(time[a]), float(time[b]), float(way[a]), float(way[b]))
            for a, b in found
        ]


def run_detector(operation: Operation, machine: Machine, detector: Detector, watched: Sequence[str] = ()) -> Signal:
    """The detector's signal of an operation, of the watched joints (none named: all of them).

    It runs over the whole log that the operation was cut from, and ground truth is taken away before it looks. Raises
    RecordingError, or ConfigurationError for an unknown joint.
    """
    signal = _signal_of_log(operation, machine, detector, watched)
    return signal if operation.log is None else signal.part(_rows(signal, operation))


def run_detector_on_each(
    operations: Sequence[Operation], machine: Machine, detector: Detector, watched: Sequence[str] = ()
) -> list[Signal]:
    """The detector's signal of each operation of one log, over which it runs once; raises as `run_detector` does."""
    if not operations:
        return []
    whole = _signal_of_log(operations[0], machine, detector, watched)
    return [whole if item.log is None else whole.part(_rows(whole, item)) for item in operations]


def detect_operations(
    operations: Sequence[Operation],
    machine: Machine,
    detector: Detector,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    watched: Sequence[str] = (),
    hold: float = HOLD,
) -> list[Detection]:
    """Run the detector over a log and hold it against thresholds, for each of the log's operations.

    Of several signatures those of the motion so far serve, see `motion.applicable`; where none does, a sample is not
    assessable. Raises RecordingError where the recording lacks a channel that the detector needs.
    """
    if not operations:
        return []
    signal = _signal_of_log(operations[0], machine, detector, watched)
    return _judge_log(operations, detector.name, signal, thresholds, activation, hold)


def _lost_inputs(detector: Detector, recording: Recording, machine: Machine, signal: Signal) -> BoolArray | None:
    """Where the detector's inputs lost samples, for the columns of its signal; None where none was lost."""
    channels = dict.fromkeys((*detector.needs, *(("position",) if machine.coupled else ())))
    lost = lost_samples(recording, channels, signal.time)
    # Each of several coupled joints feels the others, and a signal of the whole machine rests on all of them.
    if lost is not None and (machine.coupled or lost.shape != signal.values.shape):
        lost = np.repeat(lost.any(axis=1, keepdims=True), signal.values.shape[1], axis=1)
    return lost


def detect_operation(
    operation: Operation,
    machine: Machine,
    detector: Detector,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    watched: Sequence[str] = (),
) -> Detection:
    """What `detect_operations` says of one operation of a log."""
    return detect_operations([operation], machine, detector, thresholds, activation, watched)[0]


def judge(
    operation: Operation,
    detector: str,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
) -> Detection:
    """Hold a detector's signal of an operation against thresholds; what is around the operation plays no part."""
    alone = replace(operation, log=None, cut="whole")
    (detection,) = _judge_log([alone], detector, signal, thresholds, activation, HOLD)
    return replace(detection, operation=operation)


def _signal_of_log(operation: Operation, machine: Machine, detector: Detector, watched: Sequence[str]) -> Signal:
    recording = operation.whole.without_ground_truth()
    signal = checked_signal(detector, recording, machine)
    lost = _lost_inputs(detector, recording, machine, signal)
    if signal.lost is not None:
        lost = signal.lost if lost is None else lost | signal.lost
    return replace(signal, joints=signal.joints or recording.joints, lost=lost).watching(watched)


def _rows(signal: Signal, operation: Operation) -> slice:
    part = operation.recording
    return slice(None) if operation.log is None else signal.rows(part.start, part.end)


def _judge_log(
    operations: Sequence[Operation],
    detector: str,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    hold: float,
) -> list[Detection]:
    if not thresholds:
        return [_nothing_learned(item, detector, signal.part(_rows(signal, item))) for item in operations]
    judgement = judged(operations[0].whole, signal, thresholds, operations[0].cut, hold)
    statistic, band = judgement.evaluated
    inner = judgement.narrower(1.0 - activation.hysteresis) if activation.hysteresis else None
    begins = [stroke.applies for stroke in judgement.strokes[1:]]
    alarms, crossings = activation.alarms(statistic, band, inner, begins)
    rearmed = dict(zip(alarms, activation.rearmed(statistic, band, alarms, inner, begins), strict=True))
    found = []
    for item in operations:
        rows = _rows(signal, item)
        part = statistic.part(rows)
        own = [tuple(alarm for alarm in of_log if _within(alarm, part)) for of_log in (alarms, crossings)]
        verdict = replace(_verdict(part, own[0], own[1]), rearmed=tuple(rearmed[alarm] for alarm in own[0]))
        detection = Detection(
            item,
            detector,
            part,
            band.part(rows),
            verdict,
            signal.part(rows),
            judgement.thresholds[0],
            judgement,
            rows,
        )
        if verdict.outcome == "not_assessable" and (words := detection.other_speed):
            detection = replace(detection, verdict=replace(verdict, reason=f"{verdict.reason}; {words}"))
        found.append(detection)
    return found


def _within(alarm: Alarm, part: Signal) -> bool:
    return bool(len(part.time)) and part.time[0] <= alarm.time <= part.time[-1]


def _verdict(statistic: Signal, alarms: tuple[Alarm, ...], crossings: tuple[Alarm, ...]) -> Verdict:
    if alarms:
        return Verdict("alarm", alarms, crossings=crossings)
    other = float(np.mean(statistic.status == Status.OTHER_SPEED)) if statistic.status.size else 0.0
    if statistic.valid.any() and other < _ANOTHER_MOTION:
        return Verdict("no alarm", crossings=crossings)
    return Verdict("not_assessable", reason=statistic.why_not())


def _nothing_learned(operation: Operation, detector: str, signal: Signal) -> Detection:
    nothing = np.full(signal.values.shape, np.nan)
    status = np.where(signal.status == Status.VALID, Status.NO_LIMIT, signal.status).astype(np.uint8)
    unlearned = f"nothing learned: {signal.why_not()}" if signal.shares() else "nothing learned"
    verdict = Verdict("not_assessable", reason=unlearned)
    return Detection(operation, detector, replace(signal, status=status), Band(nothing, nothing), verdict, signal)

"""Run one log through detector, threshold and activation, with the results for each of its operations.

`signal_of_log`, then `judge_log`, returns a `Detection` per operation; the others are forms of these two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from cdtool.alarms.activation import Activation
from cdtool.alarms.judgement import Judgement, judgement_of
from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.base import Detector
from cdtool.detectors.contract import checked_signal
from cdtool.detectors.detection import REASONS, Alarm, Band, Signal, Status, Verdict
from cdtool.machines.dynamics import Machine
from cdtool.recordings.clock import previous_value
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.applicable import GRACE
from cdtool.recordings.motion.speed_course import TOLERANCE
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import FittedThreshold

# With at least this share of samples at another speed, an operation without an alarm counts as another motion.
_ANOTHER_MOTION = 0.5
# Below this share of the slowest learned speed, an axis is described as at rest.
_AT_REST = 0.01


@dataclass(frozen=True)
class UnassessableSection:
    """A section of an operation that is not assessable: reason, start and end [s], and positions [load unit]."""

    reason: str
    start: float
    end: float
    position_start: float
    position_end: float


@dataclass(frozen=True)
class Detection:
    """The result of a detector and its threshold for one operation, with its derivation.

    `threshold` is the first one that was learned, for its settings; None if nothing was learned. Only `judgement`, that
    of the whole log, knows which one applied to which sample. The operation is its `rows`.
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
        """Return for each sample (n, J) the safety factor at which its limit would be met; -inf without a threshold."""
        if self.judgement is None:
            return np.full(self.statistic.values.shape, -np.inf)
        return self.judgement.met_at[self.rows]

    @property
    def begins(self) -> tuple[float, ...]:
        """Return the start of the log's later strokes for thresholds and activation [s], without the first one."""
        return tuple(item.applies for item in self.judgement.strokes[1:]) if self.judgement else ()

    @property
    def other_speed(self) -> str:
        """Return in words the measured and learned motion where no learned class matched; empty if one always did.

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
        # A matching speed may occur at the wrong position: a start in the middle of the stroke, for example.
        where = " in another part of the stroke" if any(measured.matches(item, TOLERANCE) for item in classes) else ""
        return f"measured {measured.described}{where}, learned {' and '.join(item.described for item in classes)}"

    @property
    def leading(self) -> int:
        """Return the statistic's column of the joint that leads the motion; the first one if it is not monitored."""
        recording = self.operation.recording
        name = recording.joints[self.operation.motion.joint]
        return self.statistic.joints.index(name) if name in self.statistic.joints else 0

    @property
    def assessed_seconds(self) -> float:
        """Return how long the operation was monitored [s]: the valid samples of the joint with most of them."""
        if not len(self.statistic.time):
            return 0.0
        return self.statistic.period * float(np.count_nonzero(self.statistic.valid, axis=0).max())

    def not_assessable_sections(self) -> list[UnassessableSection]:
        """Return the sections in which the leading joint's signal is not assessable, in order of time."""
        joint = self.operation.motion.joint
        status, time = self.statistic.status[:, self.leading], self.statistic.time
        edges = np.flatnonzero(np.diff(status)) + 1
        starts, ends = [0, *edges.tolist()], [*(edges - 1).tolist(), len(status) - 1]
        found = [(a, b) for a, b in zip(starts, ends, strict=True) if len(status) and status[a] != Status.VALID]
        recording = self.operation.recording
        at = (
            previous_value(recording["position"], time)[:, joint]
            if "position" in recording
            else np.full(len(time), np.nan)
        )
        return [
            UnassessableSection(REASONS[int(status[a])], float(time[a]), float(time[b]), float(at[a]), float(at[b]))
            for a, b in found
        ]


def signal_of_log(operation: Operation, machine: Machine, detector: Detector, watched: Sequence[str]) -> Signal:
    """Return the detector's signal of the whole log of an operation, for the watched joints (empty: all).

    Raises as `run_detector`.
    """
    recording = operation.whole.without_ground_truth()
    signal = checked_signal(detector, recording, machine)
    lost = _lost_inputs(detector, recording, machine, signal)
    if signal.lost is not None:
        lost = signal.lost if lost is None else lost | signal.lost
    own = recording.own_clock(signal.time)
    if len(signal.time) > 1 and own is not None:
        signal.know_period(next(series.period for series in recording.channels.values() if series.time is own))
    if lost is not signal.lost or not signal.joints or own is not None:
        # Equal clocks are one object, which is quickly recognised.
        time = signal.time if own is None else own
        signal = signal.changed(time=time, joints=signal.joints or recording.joints, lost=lost)
    return signal.watching(watched)


def _lost_inputs(detector: Detector, recording: Recording, machine: Machine, signal: Signal) -> BoolArray | None:
    """Return where the detector's inputs lost samples, for the columns of its signal; None without losses."""
    channels = dict.fromkeys((*detector.needs, *(("position",) if machine.coupled else ())))
    lost = lost_samples(recording, channels, signal.time)
    # Coupled joints affect each other, and a signal of the whole machine depends on all of them.
    if lost is not None and (machine.coupled or lost.shape != signal.values.shape):
        lost = np.repeat(lost.any(axis=1, keepdims=True), signal.values.shape[1], axis=1)
    return lost


def run_detector(operation: Operation, machine: Machine, detector: Detector, watched: Sequence[str] = ()) -> Signal:
    """Return the detector's signal of an operation, for the watched joints (empty: all).

    It runs over the whole log of the operation, without ground truth. Raises RecordingError, or ConfigurationError for
    an unknown joint.
    """
    signal = signal_of_log(operation, machine, detector, watched)
    return signal if operation.log is None else signal.part(_rows(signal, operation))


def run_detector_on_each(
    operations: Sequence[Operation], machine: Machine, detector: Detector, watched: Sequence[str] = ()
) -> list[Signal]:
    """Return the detector's signal of each operation of one log in one run; raises as `run_detector`."""
    if not operations:
        return []
    whole = signal_of_log(operations[0], machine, detector, watched)
    return [whole if item.log is None else whole.part(_rows(whole, item)) for item in operations]


def judge_log(
    operations: Sequence[Operation],
    detector: str,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    grace: float,
) -> list[Detection]:
    """Compare a detector's signal of a whole log with thresholds; as `detect_operations`."""
    if not thresholds:
        return [_nothing_learned(item, detector, signal.part(_rows(signal, item))) for item in operations]
    judgement = judgement_of(operations[0].whole, signal, thresholds, operations[0].cut, grace)
    statistic, band = judgement.evaluated
    inner = judgement.narrower(1.0 - activation.hysteresis) if activation.hysteresis else None
    begins = [stroke.applies for stroke in judgement.strokes[1:]]
    debounce = partial(_debounce, judgement.recording, activation, statistic.time)
    alarms, crossings = activation.alarms(statistic, band, inner, begins, debounce)
    rearmed = dict(zip(alarms, activation.rearmed(statistic, band, alarms, inner, begins), strict=True))
    found = []
    for item in operations:
        rows = _rows(signal, item)
        part = _part(statistic, rows, judgement.recording)
        own = [tuple(alarm for alarm in of_log if _within(alarm, part)) for of_log in (alarms, crossings)]
        verdict = _verdict(part, own[0], own[1], tuple(rearmed[alarm] for alarm in own[0]))
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


def judge_alone(
    operation: Operation,
    detector: str,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
) -> Detection:
    """Compare a detector's signal of an operation with thresholds; the log around the operation is ignored."""
    alone = replace(operation, log=None, cut="whole")
    (detection,) = judge_log([alone], detector, signal, thresholds, activation, GRACE)
    return replace(detection, operation=operation)


def detect_operations(
    operations: Sequence[Operation],
    machine: Machine,
    detector: Detector,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    watched: Sequence[str] = (),
    grace: float = GRACE,
) -> list[Detection]:
    """Run the detector over a log and compare its signal with thresholds, for each of the log's operations.

    With several signatures, those for the motion so far apply, see `recordings.motion.applicable`; if none does, a
    sample is not assessable. Raises RecordingError if a channel that the detector needs is missing.
    """
    if not operations:
        return []
    signal = signal_of_log(operations[0], machine, detector, watched)
    return judge_log(operations, detector.name, signal, thresholds, activation, grace)


def detect_operation(
    operation: Operation,
    machine: Machine,
    detector: Detector,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    watched: Sequence[str] = (),
) -> Detection:
    """Return the result of `detect_operations` for one operation of a log."""
    return detect_operations([operation], machine, detector, thresholds, activation, watched)[0]


def _rows(signal: Signal, operation: Operation) -> slice:
    part = operation.recording
    return slice(None) if operation.log is None else signal.rows(part.start, part.end)


def _part(signal: Signal, rows: slice, recording: Recording) -> Signal:
    """Return these rows of a signal; their period is computed once for all signals on this clock of the recording."""
    part, own = signal.part(rows), recording.own_clock(signal.time)
    if part is not signal and own is not None:
        part.know_period(recording.derived(("period", rows.start, rows.stop), lambda: part.period, own))
    return part


def _within(alarm: Alarm, part: Signal) -> bool:
    return bool(len(part.time)) and part.time[0] <= alarm.time <= part.time[-1]


def _debounce(recording: Recording, activation: Activation, clock: FloatArray) -> npt.NDArray[np.int64]:
    """Return the debounce in samples on a clock; for one of the recording's own clocks, it is computed once."""
    own = recording.own_clock(clock)
    if own is None:
        return activation.needed(clock)
    return recording.derived(("debounce", activation.debounce), lambda: activation.needed(own), own)


def _verdict(
    statistic: Signal, alarms: tuple[Alarm, ...], crossings: tuple[Alarm, ...], rearmed: tuple[float, ...]
) -> Verdict:
    if alarms:
        return Verdict("alarm", alarms, crossings=crossings, rearmed=rearmed)
    status = statistic.status
    other = np.count_nonzero(status == Status.OTHER_SPEED) / status.size if status.size else 0.0
    if other < _ANOTHER_MOTION and statistic.valid.any():
        return Verdict("no alarm", crossings=crossings)
    return Verdict("not_assessable", reason=statistic.why_not())


def _nothing_learned(operation: Operation, detector: str, signal: Signal) -> Detection:
    nothing = np.full(signal.values.shape, np.nan)
    status = np.where(signal.status == Status.VALID, Status.NO_LIMIT, signal.status).astype(np.uint8)
    unlearned = f"nothing learned: {signal.why_not()}" if signal.shares() else "nothing learned"
    verdict = Verdict("not_assessable", reason=unlearned)
    return Detection(operation, detector, replace(signal, status=status), Band(nothing, nothing), verdict, signal)

"""One operation through detector, threshold and activation. No files, no printing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cdtool.activation import Activation
from cdtool.clock import previous_value
from cdtool.detection import REASONS, Band, Signal, Status, Verdict
from cdtool.detectors.base import Detector
from cdtool.detectors.contract import checked_signal
from cdtool.operations import Operation
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.contract import checked_evaluation, checked_exceedance, checked_factor


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

    `threshold` is None where none applies.
    """

    operation: Operation
    detector: str
    statistic: Signal
    band: Band
    verdict: Verdict
    signal: Signal | None = None
    threshold: FittedThreshold | None = None

    def exceedance(self) -> FloatArray:
        """For each sample (n, J) the safety factor at which its limit would be met; -inf without a threshold."""
        if self.threshold is None or self.signal is None:
            return np.full(self.statistic.values.shape, -np.inf)
        recording = self.operation.recording.without_ground_truth()
        return checked_exceedance(self.threshold, recording, self.signal)[1]

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


def run_detector(operation: Operation, machine: Any, detector: Detector, watched: Sequence[str] = ()) -> Signal:
    """The detector's signal of an operation, of the watched joints (none named: all of them).

    Ground truth is taken away before it looks. Raises RecordingError, or ConfigurationError for an unknown joint.
    """
    signal = checked_signal(detector, operation.recording.without_ground_truth(), machine)
    return replace(signal, joints=signal.joints or operation.recording.joints).watching(watched)


def detect_operation(
    operation: Operation,
    machine: Any,
    detector: Detector,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
    watched: Sequence[str] = (),
) -> Detection:
    """Run the detector and hold it against the threshold of the operation's class, joint by watched joint.

    Of several signatures the one of the operation's direction and speed serves; where none does, the verdict is "not
    assessable". Raises RecordingError where the recording lacks a channel that the detector needs.
    """
    signal = run_detector(operation, machine, detector, watched)
    return judge(operation, detector.name, signal, thresholds, activation)


def judge(
    operation: Operation,
    detector: str,
    signal: Signal,
    thresholds: Sequence[FittedThreshold],
    activation: Activation,
) -> Detection:
    """Hold a detector's signal of an operation against the threshold of its class."""
    threshold, refused = choose_threshold(operation, thresholds)
    if threshold is None:
        nothing = np.full(signal.values.shape, np.nan)
        status = np.where(signal.status == Status.VALID, Status.NO_LIMIT, signal.status).astype(np.uint8)
        statistic = replace(signal, status=status)
        unlearned = f"nothing learned: {signal.why_not()}" if signal.shares() else "nothing learned"
        verdict = Verdict("not assessable", reason=refused or unlearned)
        return Detection(operation, detector, statistic, Band(nothing, nothing), verdict, signal)
    recording = operation.recording.without_ground_truth()
    statistic, band = checked_evaluation(threshold, recording, signal)
    alarms, crossings = activation.alarms(statistic, band, _inner_band(activation, threshold, recording, signal))
    if alarms:
        verdict = Verdict("alarm", alarms, crossings=crossings)
    elif not statistic.valid.any():
        verdict = Verdict("not assessable", reason=statistic.why_not())
    else:
        verdict = Verdict("no alarm")
    return Detection(operation, detector, statistic, band, verdict, signal, threshold)


def _inner_band(
    activation: Activation, threshold: FittedThreshold, recording: Recording, signal: Signal
) -> Band | None:
    """The band within which an alarm is armed again; None without hysteresis."""
    if not activation.hysteresis:
        return None
    narrower = checked_factor(threshold, (1.0 - activation.hysteresis) * threshold.safety_factor)
    return checked_evaluation(narrower, recording, signal)[1]


def choose_threshold(operation: Operation, thresholds: Sequence[FittedThreshold]) -> tuple[FittedThreshold | None, str]:
    """The threshold that applies to an operation, or None and why; nothing to say where nothing was learned at all.

    One with a class of motion (`motion`) serves that class alone, one without serves all.
    """
    if not thresholds:
        return None, ""
    learned = [(getattr(item, "motion", None), item) for item in thresholds]
    for motion, item in learned:
        if motion is None or motion.matches(operation.motion, SPEED_TOLERANCE):
            return item, ""
    known = " and ".join(motion.described for motion, _ in learned if motion is not None)
    return None, f"no signature for its class: runs {operation.motion.described}, learned {known}"

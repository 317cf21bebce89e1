"""All joints' channels of one recording on a single uniform clock, for the identification of a robot.

Identification is offline: a missing speed and the acceleration are central derivatives, without delay. Nothing here is
used by a detector.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.recordings.recording import Recording


@dataclass(frozen=True, eq=False)
class RobotRun:
    """The joints' channels on the load side (SI), every `period` [s] from `start` [s], in the recording's order.

    `torque`, `position` and `speed` (n, J): rad or m, N m or N; NaN without a sample.
    """

    name: str
    start: float
    period: float
    torque: FloatArray
    position: FloatArray
    speed: FloatArray

    def __post_init__(self) -> None:
        shape = np.shape(self.torque)
        if len(shape) != 2 or np.shape(self.position) != shape or np.shape(self.speed) != shape:
            raise RecordingError(f"{self.name}: torque, position and speed differ in shape", "each is (n, J)")
        if not 0.0 < self.period < math.inf:
            raise RecordingError(f"{self.name}: the period is {self.period} s", "it must be above 0")

    def __len__(self) -> int:
        return len(self.torque)

    @property
    def joint_count(self) -> int:
        """Return J, the number of joints."""
        return int(self.torque.shape[1])

    @property
    def time(self) -> FloatArray:
        """Return the times of the samples (n,) [s]."""
        return np.asarray(self.start + self.period * np.arange(len(self), dtype=np.float64))

    def acceleration(self) -> FloatArray:
        """Return the central derivative of the speed (n, J); NaN within 0.05 s of a gap, the start and the end."""
        return central_derivative(self.speed, self.period)

    def slow(self, stick_speed: Sequence[float]) -> BoolArray:
        """Return where (n, J) the direction, or the kind, of a joint's friction is uncertain.

        That is below its stick speed, three times the noise of its speed, and 2 % of its fastest motion. The noise is
        that of third differences, to which smooth motion adds nothing.
        """
        from scipy.stats import median_abs_deviation

        speed = np.abs(self.speed)
        moves = np.where(speed > stick_speed, self.speed, np.nan)
        least = np.array(stick_speed, dtype=np.float64)
        for joint, own in enumerate(moves.T):
            changes = np.diff(own, 3)
            changes = changes[np.isfinite(changes)]
            if len(changes):
                # The third difference of noise has 1 + 9 + 9 + 1 times its variance.
                noise = float(median_abs_deviation(changes, scale="normal")) / math.sqrt(20.0)
                fastest = float(np.nanpercentile(np.abs(own), 99.0))
                # Noise of three standard deviations changes the sign of a speed in one of a thousand samples. Below 2 %
                # of its fastest motion, the friction of a joint rises towards rest (Stribeck) in many drives.
                least[joint] = max(least[joint], 3.0 * noise, 0.02 * fastest)
        return np.asarray(~(speed >= least) & np.isfinite(speed))

    def without(self, excluded: BoolArray) -> RobotRun:
        """Return the run with NaN for the torques of the excluded samples (n,)."""
        return replace(self, torque=np.where(excluded[:, np.newaxis], np.nan, self.torque))


def robot_run(recording: Recording) -> RobotRun:
    """Return all joints' channels of a recording on the load side, on one uniform clock.

    The clock has the longest median step of torque, position and speed. A speed that is missing, or that was derived
    causally when the log was read, is replaced by the central derivative of the position. Raises RecordingError without
    torque or position, and for fewer than 50 samples that the channels have in common.
    """
    if "position" not in recording:
        raise RecordingError(
            f"{recording.name}: no position", "the torque of a robot depends on its pose: map position in [channels]"
        )
    is_derived = "speed" not in recording or any(item.kind == "derived_speed" for item in recording.findings)
    axes = [axis_run(recording, joint) for joint in range(len(recording.joints))]
    position = np.column_stack([_values(axis, "position") for axis in axes])
    if is_derived:
        speed = central_derivative(position, axes[0].period)
    else:
        speed = np.column_stack([_values(axis, "speed") for axis in axes])
    torque = np.column_stack([axis.torque for axis in axes])
    return RobotRun(recording.name, axes[0].start, axes[0].period, torque, position, speed)


def central_derivative(values: FloatArray, period: float) -> FloatArray:
    """Return the derivative (n, J) of the cubics that fit best within 0.05 s, and at least 3 samples, to either side.

    It has no delay (Savitzky and Golay, 1964). NaN where the window is not filled.
    """
    half = max(3, round(0.05 / period))  # over 0.05 s to either side, or three samples
    if len(values) <= 2 * half:
        return np.full(values.shape, np.nan)
    from scipy.signal import savgol_coeffs

    weights = savgol_coeffs(2 * half + 1, 3, deriv=1, delta=period, use="dot")
    slope = np.full(values.shape, np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half + 1, axis=0)
    slope[half:-half] = windows @ weights
    return slope


def _values(axis: AxisRun, channel: str) -> FloatArray:
    values: FloatArray = getattr(axis, channel)
    return values

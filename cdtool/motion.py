"""The class of a motion: direction, nominal speed and the joint that leads it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.recording import FloatArray, Recording, Series


@dataclass(frozen=True)
class MotionClass:
    """Direction of travel (+1, -1; 0 = no motion), nominal speed [load unit/s] and the joint that leads the motion."""

    direction: int
    nominal_speed: float
    joint: int = 0

    def matches(self, other: MotionClass, tolerance: float) -> bool:
        """Same joint and direction, and speeds that differ by at most the share `tolerance`."""
        if self.joint != other.joint or self.direction != other.direction:
            return False
        return abs(self.nominal_speed - other.nominal_speed) <= tolerance * max(self.nominal_speed, other.nominal_speed)

    @property
    def described(self) -> str:
        """For messages: direction and speed."""
        word = {1: "forward", -1: "backward", 0: "at rest"}[self.direction]
        return f"{word} at {self.nominal_speed:.3g}/s" if self.direction else word


def motion_class(recording: Recording) -> MotionClass:
    """Direction, nominal speed (median of the samples above 80 % of the peak) and leading joint of a recording.

    The reference speed decides where it is logged: an early contact does not change it. Without speed: class at rest.
    """
    for channel in ("reference_speed", "speed"):
        if channel in recording:
            joint = leading_joint(recording[channel])
            speed = recording[channel].values[:, joint]
            speed = speed[np.isfinite(speed)]
            if len(speed):
                return _class_of(speed, joint)
    return MotionClass(0, 0.0)


def leading_joint(series: Series) -> int:
    """The joint that moves most: largest mean absolute speed."""
    if series.joint_count == 1:
        return 0
    means = np.nanmean(np.abs(np.nan_to_num(series.values)), axis=0)
    return int(np.argmax(means))


def _class_of(speed: FloatArray, joint: int) -> MotionClass:
    peak = float(np.percentile(np.abs(speed), 99.0))
    if peak <= 0.0:
        return MotionClass(0, 0.0, joint)
    fast = speed[np.abs(speed) >= 0.8 * peak]
    direction = 1 if float(np.sum(fast)) > 0.0 else -1
    return MotionClass(direction, float(np.median(np.abs(fast))), joint)

"""What the motion of a robot's runs excites, joint by joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.axis.excitation import Excitation, excitation_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine

# A joint moves where this share of the samples within the window's half width [s] is above its stick speed: less is
# noise of the speed at rest.
_MOVING_SHARE, _HALF_WIDTH = 0.9, 0.1


@dataclass(frozen=True)
class JointMotion:
    """The motion of one joint in all runs: `lowest` and `highest` position [rad, m], NaN without a sample.

    `excitation`: of a joint that does not move it has no speeds, and every number is 0. Its acceleration is a smoothed
    derivative; the noise in it is not known (NaN).
    """

    joint: int
    excitation: Excitation
    lowest: float
    highest: float

    @property
    def is_moving(self) -> bool:
        """Return whether the joint moves at all."""
        return self.excitation.moving_time > 0.0


def measure_joint_motion(runs: Sequence[RobotRun], machine: CoupledMachine) -> tuple[JointMotion, ...]:
    """Return what the runs move of each joint; a joint moves where it stays above its stick speed.

    Raises IndexError for runs of another machine.
    """
    accelerations = [run.acceleration() for run in runs]
    return tuple(
        _of_joint(runs, accelerations, joint, machine.stick_speed[joint]) for joint in range(len(machine.joints))
    )


def _of_joint(runs: Sequence[RobotRun], accelerations: Sequence[FloatArray], joint: int, stick: float) -> JointMotion:
    speeds: list[FloatArray] = []
    rates: list[FloatArray] = []
    durations: list[FloatArray] = []
    lowest, highest = math.inf, -math.inf
    for run, acceleration in zip(runs, accelerations, strict=True):
        own = run.speed[:, joint]
        moving = _moving(own, stick, run.period)
        speeds.append(own[moving])
        rates.append(np.nan_to_num(acceleration[moving, joint]))
        durations.append(np.full(int(np.count_nonzero(moving)), run.period))
        known = run.position[np.isfinite(run.position[:, joint]), joint]
        if len(known):
            lowest, highest = min(lowest, float(known.min())), max(highest, float(known.max()))
    lowest, highest = (lowest, highest) if math.isfinite(lowest) else (math.nan, math.nan)
    speed, rate, duration = (np.concatenate(part) for part in (speeds, rates, durations))
    # The acceleration is a smoothed derivative: the noise in it is not known.
    moved = excitation_of(speed, rate, duration, np.full_like(speed, np.nan))
    return JointMotion(joint, moved, lowest, highest)


def _moving(speed: FloatArray, stick: float, period: float) -> BoolArray:
    """Return where a joint moves (n,): above the stick speed, and nearly always so around it."""
    above = np.abs(np.nan_to_num(speed)) > stick
    width = 2 * max(1, round(_HALF_WIDTH / period)) + 1
    if len(above) < width:
        return np.zeros(len(above), dtype=np.bool_)
    share = np.convolve(above.astype(np.float64), np.full(width, 1.0 / width), mode="same")
    return np.asarray(above & (share >= _MOVING_SHARE))

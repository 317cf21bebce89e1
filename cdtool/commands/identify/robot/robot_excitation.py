"""What the motion of a robot's runs excites, joint by joint, and the motion that would show its inertias.

The torques of a joint contain the inertias of all links behind it, so that a plan for these is one motion of all
joints at once: each over a wide range, at its own frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.axis.excitation import Excitation, excitation_of
from cdtool.commands.identify.estimate import Missing
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine

# A joint moves where this share of the samples within the window's half width [s] is above its stick speed: less is
# noise of the speed at rest.
_MOVING_SHARE, _HALF_WIDTH = 0.9, 0.1
# A plan moves each joint over this range [rad, m]: gravity turns through a sixth of a revolution to either side.
_WANTED_RANGE = 2.0
# A joint that is much slower than the fastest one excites little: a plan has at least this share of its speed.
_SPEED_SHARE = 0.5
# A plan lasts this many times its slowest period, and this many seconds per base parameter.
_PERIODS, _TIME_PER_PARAMETER = 2.0, 0.5


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
    def range(self) -> float:
        """Return the distance between the lowest and the highest position [rad, m]."""
        return self.highest - self.lowest

    @property
    def is_moving(self) -> bool:
        """Return whether the joint moves at all."""
        return self.excitation.moving_time > 0.0

    @property
    def missing(self) -> tuple[Missing, ...]:
        """Return what the motion does not have for the joint's friction: speeds, directions; empty if it has all."""
        if not self.is_moving:
            return (Missing.OTHER_MOTION,)
        missing = [] if len(self.excitation.speeds) > 1 else [Missing.SECOND_SPEED]
        missing += [Missing.REVERSALS] if self.excitation.is_one_way else []
        return tuple(missing)


@dataclass(frozen=True)
class JointDemand:
    """How one joint moves in a plan: `range` [rad, m] and highest `speed` [rad/s, m/s], with what the logs have."""

    joint: int
    range: float
    speed: float
    logged_range: float
    logged_speed: float

    @property
    def is_more(self) -> bool:
        """Return whether the joint has to move further or faster than in the logs."""
        return self.range > self.logged_range or self.speed > self.logged_speed


@dataclass(frozen=True)
class PlannedRobotMotion:
    """One motion of all joints at once, each at its own frequencies, for `duration` [s]; `logged_duration` [s]."""

    joints: tuple[JointDemand, ...]
    duration: float
    logged_duration: float


def measure_joint_motion(runs: Sequence[RobotRun], machine: CoupledMachine) -> tuple[JointMotion, ...]:
    """Return what the runs move of each joint; a joint moves where it stays above its stick speed.

    Raises IndexError for runs of another machine.
    """
    accelerations = [run.acceleration() for run in runs]
    return tuple(
        _of_joint(runs, accelerations, joint, machine.stick_speed[joint]) for joint in range(len(machine.joints))
    )


def plan_robot_motion(motions: Sequence[JointMotion], base_parameters: int) -> PlannedRobotMotion | None:
    """Return the motion that would show the inertias of all links; None if no joint moves in the logs.

    Parameters
    ----------
    motions : sequence of JointMotion
        The logged motion of every joint.
    base_parameters : int
        How many combinations of inertial parameters are wanted.

    Returns
    -------
    PlannedRobotMotion or None
        Each joint over at least 2 rad (or m), at its highest logged speed, at least half of that of the fastest joint.
        The plan does not know the limits of the joints, nor what is in the way.
    """
    fastest = max((motion.excitation.highest_speed for motion in motions), default=0.0)
    if not fastest > 0.0:
        return None
    demands = []
    for motion in motions:
        own, logged = motion.excitation.highest_speed, motion.range if math.isfinite(motion.range) else 0.0
        speed = max(own, _SPEED_SHARE * fastest)
        demands.append(JointDemand(motion.joint, max(logged, _WANTED_RANGE), speed, logged, own))
    slowest = max(math.pi * demand.range / demand.speed for demand in demands)
    duration = max(_PERIODS * slowest, _TIME_PER_PARAMETER * base_parameters)
    logged_time = max(motion.excitation.moving_time for motion in motions)
    return PlannedRobotMotion(tuple(demands), float(math.ceil(duration)), logged_time)


def _of_joint(runs: Sequence[RobotRun], accelerations: Sequence[FloatArray], joint: int, stick: float) -> JointMotion:
    speeds: list[FloatArray] = []
    rates: list[FloatArray] = []
    durations: list[FloatArray] = []
    strokes = reversals = 0
    lowest, highest = math.inf, -math.inf
    for run, acceleration in zip(runs, accelerations, strict=True):
        own = run.speed[:, joint]
        moving = _moving(own, stick, run.period)
        speeds.append(own[moving])
        rates.append(np.nan_to_num(acceleration[moving, joint]))
        durations.append(np.full(int(np.count_nonzero(moving)), run.period))
        own_strokes, own_reversals = _strokes_of(own, moving)
        strokes, reversals = strokes + own_strokes, reversals + own_reversals
        known = run.position[np.isfinite(run.position[:, joint]), joint]
        if len(known):
            lowest, highest = min(lowest, float(known.min())), max(highest, float(known.max()))
    lowest, highest = (lowest, highest) if math.isfinite(lowest) else (math.nan, math.nan)
    speed, rate, duration = (np.concatenate(part) for part in (speeds, rates, durations))
    # The acceleration is a smoothed derivative: the noise in it is not known.
    moved = excitation_of(speed, rate, duration, np.full_like(speed, np.nan), strokes, reversals)
    return JointMotion(joint, moved, lowest, highest)


def _moving(speed: FloatArray, stick: float, period: float) -> BoolArray:
    """Return where a joint moves (n,): above the stick speed, and nearly always so around it."""
    above = np.abs(np.nan_to_num(speed)) > stick
    width = 2 * max(1, round(_HALF_WIDTH / period)) + 1
    if len(above) < width:
        return np.zeros(len(above), dtype=np.bool_)
    share = np.convolve(above.astype(np.float64), np.full(width, 1.0 / width), mode="same")
    return np.asarray(above & (share >= _MOVING_SHARE))


def _strokes_of(speed: FloatArray, moving: BoolArray) -> tuple[int, int]:
    """Return the motions between rests and reversals, and the changes of direction."""
    direction = np.sign(speed[moving])
    if not len(direction):
        return 0, 0
    reversals = int(np.count_nonzero(np.diff(direction)))
    edges = np.diff(moving.astype(np.int8), prepend=0)
    sections = np.cumsum(edges > 0)[moving]
    strokes = 1 + int(np.count_nonzero((np.diff(direction) != 0) | (np.diff(sections) != 0)))
    return strokes, reversals

"""How much the torques of a robot differ between runs of the same motion: no model predicts a run better than that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.robot.robot_dynamics import HALF_WIDTH, Window
from cdtool.commands.identify.robot.robot_run import RobotRun

# Runs are the same motion if their lengths differ by at most this share, and their positions (RMS) by this share of
# the range of the joint that moves most.
_SAME_LENGTH, _SAME_POSITION = 0.02, 0.01


@dataclass(frozen=True, eq=False)
class RepeatedRuns:
    """RMS per joint (J,) [N m, N] by which one run's torque deviates from equal ones; NaN without a pair of runs."""

    floor: FloatArray
    pairs: int


def repeated_runs(runs: Sequence[RobotRun]) -> RepeatedRuns:
    """Return the floor of the prediction error, from pairs of neighbouring runs that repeat the same motion.

    The torques of a pair pass the window of robot_dynamics.py and are subtracted; the RMS of the
    difference is divided by sqrt(2), because both runs contribute. Equal motions that begin at different times after
    the start of their log are not recognised.
    """
    squares: list[FloatArray] = []
    pairs = 0
    for one, other in pairwise(runs):
        if not _is_same_motion(one, other):
            continue
        count, window = min(len(one), len(other)), Window.of(HALF_WIDTH, one.period)
        difference = window.average(one.torque[:count] - other.torque[:count])
        squares.append(0.5 * difference**2)
        pairs += 1
    joints = runs[0].joint_count
    if not squares:
        return RepeatedRuns(np.full(joints, np.nan), 0)
    together = np.concatenate(squares)
    known = np.isfinite(together)
    count_known = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, together, 0.0).sum(axis=0) / count_known
    return RepeatedRuns(np.where(known.any(axis=0), np.sqrt(mean), np.nan), pairs)


def _is_same_motion(one: RobotRun, other: RobotRun) -> bool:
    count = min(len(one), len(other))
    if max(len(one), len(other)) - count > _SAME_LENGTH * count or abs(one.period / other.period - 1.0) > 1e-3:
        return False
    difference = one.position[:count] - other.position[:count]
    known = np.isfinite(difference).all(axis=1)
    if not known.any():
        return False
    reach = float(np.max(np.ptp(one.position[:count][known], axis=0)))
    return bool(np.all(np.sqrt(np.mean(difference[known] ** 2, axis=0)) <= _SAME_POSITION * reach)) and reach > 0.0

"""What the logs show of a robot's joints: unseen torque, friction over speed, motion."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.axis.excitation import Excitation, excitation_of
from cdtool.commands.identify.evidence import CrossValidation, ForceEvidence, UnseenRun
from cdtool.commands.identify.robot.robot_dynamics import HALF_WIDTH, RobotFit, folds_of
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine


def joint_evidence(joint: int, fit: RobotFit, is_new: bool, runs: Sequence[RobotRun]) -> ForceEvidence | None:
    """Return what a fit to these runs shows of a joint, its model or, unless `is_new`, the machine's own one.

    Each part of the logs is predicted by a fit without it; the run is the one that is predicted worst; strokes that
    repeat each other are not looked for. None without motion of the joint.
    """
    equations, left_out = fit.equations, fit.left_out
    own = np.flatnonzero(left_out.joints == joint)
    if not len(own):
        return None
    measured, inertia, speed, position = equations.averages[own].T
    unseen = (left_out.residual if is_new else left_out.previous)[own]
    run = equations.runs[own].astype(np.int64)
    worst = int(np.argmax(np.bincount(run, unseen**2) / np.maximum(np.bincount(run), 1)))
    of_worst = run == worst
    time, force = equations.times[own][of_worst] - runs[worst].start, measured[of_worst]
    shown = UnseenRun(runs[worst].name, time, force, force - unseen[of_worst], len(runs))
    error, folds = float(np.sqrt(np.mean(unseen**2))), len(np.unique(folds_of(equations)))
    validation = CrossValidation(error, folds, math.nan, 0, shown)
    friction, residual = measured - inertia, unseen
    if is_new:
        rows = equations.rows[own] / fit.weights[joint]
        groups = [fit.columns[column].group for column in fit.grouping.base]
        inertial = np.array([group in (ColumnGroup.INERTIAL, ColumnGroup.DRIVE_INERTIA) for group in groups])
        start = fit.grouping.combination @ regressor_of(fit.machine).values[list(fit.grouping.columns)]
        friction = friction - rows[:, inertial] @ (fit.base.values - start)[inertial]
        residual = equations.torques[own] / fit.weights[joint] - rows @ fit.base.values
    return ForceEvidence.of((speed, position), friction, residual, left_out.blocks[own], validation)


def joint_excitations(runs: Sequence[RobotRun], machine: CoupledMachine) -> list[Excitation]:
    """Return what the runs excite of each joint, which moves where it stays above its stick speed.

    A joint that does not move has no speeds, and every number is 0. The acceleration is a smoothed derivative; the
    noise in it is not known (NaN). Raises IndexError for runs of another machine.
    """
    accelerations = [run.acceleration() for run in runs]
    found = []
    for joint, stick in enumerate(machine.stick_speed):
        columns = [np.zeros((3, 0))]
        for run, acceleration in zip(runs, accelerations, strict=True):
            moving = _moving(run.speed[:, joint], stick, run.period)
            rate = np.nan_to_num(acceleration[moving, joint])
            columns.append(np.vstack((run.speed[moving, joint], rate, np.full(len(rate), run.period))))
        speed, rate, duration = np.concatenate(columns, axis=1)
        found.append(excitation_of(speed, rate, duration, np.full_like(speed, math.nan)))
    return found


def _moving(speed: FloatArray, stick: float, period: float) -> BoolArray:
    """Return where a joint moves (n,): above the stick speed, and nearly always so around it."""
    above = np.abs(np.nan_to_num(speed)) > stick
    # The joint moves where it does so in 90 % of the window about a sample: less is noise of the speed at rest.
    width = 2 * max(1, round(HALF_WIDTH / period)) + 1
    if len(above) < width:
        return np.zeros(len(above), dtype=np.bool_)
    share = np.convolve(above.astype(np.float64), np.full(width, 1.0 / width), mode="same")
    return np.asarray(above & (share >= 0.9))

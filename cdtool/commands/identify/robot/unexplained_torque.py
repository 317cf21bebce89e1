"""Times at which no friction explains a robot's torque, as in a contact or an abrupt stop that no channel shows.

A few such moments would move least squares more than all the rest of the logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray
from cdtool.commands.identify.robot.robot_dynamics import HALF_WIDTH, RobotFit, identify_robot
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.statistics.spread import MAD_TO_STD


@dataclass(frozen=True, eq=False)
class ExplainedRuns:
    """Runs with NaN for the torque near unexplained moments; `share` of the equations of motion left out [-]."""

    runs: tuple[RobotRun, ...]
    share: float


def without_unexplained(runs: Sequence[RobotRun], machine: CoupledMachine) -> ExplainedRuns:
    """Return the runs without the times at which the friction fitted to all of them explains a torque by no means.

    That is a residual beyond eight robust standard deviations of its joint; its window to either
    side is left out for all joints. Contacts that last for much of the logs pass for friction. Raises what
    identify_robot raises.
    """
    fit = identify_robot(runs, machine)
    is_outside = _outside(fit)
    equations, cleaned = fit.equations, []
    for index, run in enumerate(runs):
        times = np.unique(equations.times[is_outside & (equations.runs == index)])
        cleaned.append(run.without(_near(run, times)) if len(times) else run)
    return ExplainedRuns(tuple(cleaned), float(np.mean(is_outside)))


def _outside(fit: RobotFit) -> BoolArray:
    """Return which equations (m,) are unexplained by the fit to all of them; one without a run may be a worse fit."""

    equations, joints = fit.equations, fit.left_out.joints
    size = np.abs(equations.torques - equations.rows @ fit.base.values)
    outside: BoolArray = np.zeros(len(size), dtype=np.bool_)
    for joint in np.unique(joints).tolist():
        own = joints == joint
        # No sensor resolves 1e-9 of its range: less is rounding.
        least = 1e-9 * float(np.max(np.abs(equations.torques[own])))
        # Beyond eight robust standard deviations it is neither friction nor noise.
        outside[own] = size[own] > 8.0 * MAD_TO_STD * max(float(np.median(size[own])), least)
    return outside


def _near(run: RobotRun, times: np.ndarray[tuple[int], np.dtype[np.float64]]) -> BoolArray:
    """Return which samples (n,) are within a window of one of the sorted times."""
    clock = run.time
    after = np.clip(np.searchsorted(times, clock), 1, len(times)) if len(times) > 1 else np.ones(len(clock), np.int64)
    before = times[after - 1]
    behind = times[np.minimum(after, len(times) - 1)]
    return np.asarray(np.minimum(np.abs(clock - before), np.abs(clock - behind)) <= HALF_WIDTH)

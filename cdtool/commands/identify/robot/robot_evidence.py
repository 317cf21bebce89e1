"""What the outputs show of a robot's joints: unseen torque, friction over speed, motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.friction_curve import FrictionCurve, friction_curve, speed_edges
from cdtool.commands.identify.robot.friction_choice import FrictionForm
from cdtool.commands.identify.robot.robot_dynamics import HALF_WIDTH, RobotFit, Window, rigid_torque, window_of_column
from cdtool.commands.identify.robot.robot_excitation import JointMotion
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, Regressor, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun

Indices = np.ndarray[tuple[int], np.dtype[np.int64]]

# A line is interrupted where windows are further apart than this many usual steps.
_GAP = 1.5


@dataclass(frozen=True, eq=False)
class UnseenTorque:
    """Torque of a joint along a run, each part predicted by a fit without it; arrays (n,) [N m, N], low-passed.

    NaN where a line is interrupted: windows at rest, near gaps and unexplained moments have no prediction. `predicted`
    with the `form`, `previous` with the old friction and inertias. `parts`: a run, or fifths of the only one.
    """

    run: str
    of_runs: int
    form: FrictionForm
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    previous: FloatArray

    @property
    def summary(self) -> dict[str, Any]:
        """Return the run, and the RMS of its residuals [N m, N], as JSON values."""
        return {
            "run": self.run,
            "of_runs": self.of_runs,
            "form": self.form.name.lower(),
            "error": _rms(self.measured - self.predicted),
            "previous_error": _rms(self.measured - self.previous),
        }


@dataclass(frozen=True, eq=False)
class JointFrictionCurve:
    """Friction of a joint over speed: measured torque less that of inertia and gravity, and the models.

    `points`: mean per interval of speed with the standard error between blocks of the log. `speed`, `new`, `previous`
    (n,): the models [N m, N] over the speed [rad/s, m/s].
    """

    points: FrictionCurve
    form: FrictionForm
    speed: FloatArray
    new: FloatArray
    previous: FloatArray


@dataclass(frozen=True, eq=False)
class RobotJointEvidence:
    """What the logs show of one joint; `unseen` and `friction` are None for a joint without enough motion."""

    motion: JointMotion
    unseen: UnseenTorque | None = None
    friction: JointFrictionCurve | None = None


def _rms(residual: FloatArray) -> float:
    known = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def joint_evidence(
    motion: JointMotion, form: FrictionForm | None, fits: Mapping[FrictionForm, RobotFit], runs: Sequence[RobotRun]
) -> RobotJointEvidence:
    """Return what the fit of a form, to these runs, shows of a joint; without a form only its motion."""
    if form is None or not (fits[form].equations.joints == motion.joint).any():
        return RobotJointEvidence(motion)
    windows = _FittedWindows.of(motion.joint, fits[form], runs)
    return RobotJointEvidence(
        motion, _unseen(windows, form, fits[form], runs), _friction(windows, motion.joint, form, fits[form])
    )


@dataclass(frozen=True, eq=False)
class _FittedWindows:
    """The equations of a joint (n,): where they are in all, run, place and time of the window, averages over it.

    `friction`: the torque less that of inertia and gravity, the machine's own and what the fit changed.
    """

    rows: Indices
    run: Indices
    place: Indices
    time: FloatArray
    torque: FloatArray
    speed: FloatArray
    friction: FloatArray

    @classmethod
    def of(cls, joint: int, fit: RobotFit, runs: Sequence[RobotRun]) -> _FittedWindows:
        """Return the windows of a joint, run by run, as the equations are."""
        equations, regressor, parts = fit.equations, regressor_of(fit.machine), []
        change = fit.parameters - regressor.values
        inertial = (ColumnGroup.INERTIAL, ColumnGroup.DRIVE_INERTIA)
        changed = [i for i in np.flatnonzero(change).tolist() if regressor.columns[i].group in inertial]
        for index, run in enumerate(runs):
            rows = np.flatnonzero((equations.joints == joint) & (equations.runs == index))
            window, time = Window.of(HALF_WIDTH, run.period), equations.times[rows] - run.start
            place = np.rint((time / run.period - len(window.weights) // 2) / window.step).astype(np.int64)
            rigid = rigid_torque(run, fit.machine, window)[:, joint]
            for column in changed:
                rigid = rigid + change[column] * window_of_column(run, regressor, window, column)[:, joint]
            torque, speed = window.average(run.torque)[place, joint], window.average(run.speed)[place, joint]
            parts.append((rows, np.full(len(rows), index), place, time, torque, speed, torque - rigid[place]))
        return cls(*(np.concatenate(item) for item in zip(*parts, strict=True)))


def _unseen(windows: _FittedWindows, form: FrictionForm, fit: RobotFit, runs: Sequence[RobotRun]) -> UnseenTorque:
    """Return the torque along the run that is predicted worst, relative to the torque of all runs."""
    residual, previous = fit.left_out.residual[windows.rows], fit.left_out.previous[windows.rows]
    worst = int(np.argmax(np.bincount(windows.run, residual**2) / np.maximum(np.bincount(windows.run), 1)))
    own = windows.run == worst
    time, measured = windows.time[own], windows.torque[own]
    gaps = np.flatnonzero(np.diff(windows.place[own]) > _GAP) + 1
    lines = (measured, measured - residual[own], measured - previous[own])
    broken = [np.insert(line, gaps, np.nan) for line in lines]
    return UnseenTorque(runs[worst].name, len(runs), form, np.insert(time, gaps, time[gaps]), *broken)


def _friction(windows: _FittedWindows, joint: int, form: FrictionForm, fit: RobotFit) -> JointFrictionCurve | None:
    """Return the friction over speed, with the inertias that belong to the form."""
    speed = windows.speed
    points = friction_curve(speed, windows.friction, fit.left_out.blocks[windows.rows], speed_edges(speed))
    if not len(points):
        return None
    reach = float(np.max(np.abs(speed)))
    at = np.linspace(-reach if speed.min() < 0.0 else 0.0, reach if speed.max() > 0.0 else 0.0, 81)
    regressor = regressor_of(fit.machine)
    lines = (_modelled(regressor, joint, values, at) for values in (fit.parameters, regressor.values))
    return JointFrictionCurve(points, form, at, *lines)


def _modelled(regressor: Regressor, joint: int, parameters: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the friction of a joint over the speed (n,)."""
    values = {
        column.group: float(value)
        for column, value in zip(regressor.columns, parameters, strict=True)
        if column.joint == joint and column.group is not ColumnGroup.INERTIAL
    }
    slope = regressor.machine.coulomb_slope[joint]
    direction = np.tanh(slope * speed) if slope else np.sign(speed)
    viscous, coulomb = values[ColumnGroup.VISCOUS] * speed, values[ColumnGroup.COULOMB] * direction
    return np.asarray(viscous + coulomb + values[ColumnGroup.CONSTANT])

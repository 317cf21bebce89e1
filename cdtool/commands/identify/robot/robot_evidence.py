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
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun

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
    if form is None:
        return RobotJointEvidence(motion)
    shown = _Joint(motion.joint, form, fits[form], runs)
    return RobotJointEvidence(motion, shown.unseen(), shown.friction())


@dataclass(frozen=True, eq=False)
class _Joint:
    """A joint, its form of friction, the fit of it, and the runs."""

    joint: int
    form: FrictionForm
    fit: RobotFit
    runs: Sequence[RobotRun]

    def unseen(self) -> UnseenTorque | None:
        """Return the torque along the run that is predicted worst, relative to the torque of all runs."""
        equations, left_out = self.fit.equations, self.fit.left_out
        own = equations.joints.astype(np.int64) == self.joint
        if not own.any():
            return None
        indices = equations.runs[own].astype(np.int64)
        squares = np.bincount(indices, weights=left_out.residual[own] ** 2)
        counts = np.maximum(np.bincount(indices), 1)
        worst = int(np.argmax(squares / counts))
        run = self.runs[worst]
        chosen = own & (equations.runs == worst)
        window = Window.of(HALF_WIDTH, run.period)
        place = self._places(run, window, equations.times[chosen])
        measured = window.average(run.torque)[place, self.joint]
        lines = (measured, measured - left_out.residual[chosen], measured - left_out.previous[chosen])
        time = equations.times[chosen] - run.start
        gaps = np.flatnonzero(np.diff(place) > _GAP) + 1
        time = np.insert(time, gaps, time[gaps])
        broken = [np.insert(line, gaps, np.nan) for line in lines]
        return UnseenTorque(run.name, len(self.runs), self.form, time, *broken)

    def friction(self) -> JointFrictionCurve | None:
        """Return the friction over speed, with the inertias that belong to the form."""
        equations = self.fit.equations
        own = equations.joints.astype(np.int64) == self.joint
        speeds, forces = [], []
        for index, run in enumerate(self.runs):
            chosen = own & (equations.runs == index)
            window = Window.of(HALF_WIDTH, run.period)
            place = self._places(run, window, equations.times[chosen])
            rest = window.average(run.torque)[:, self.joint] - self._rigid_torque(run, window)
            speeds.append(window.average(run.speed)[place, self.joint])
            forces.append(rest[place])
        speed, force = np.concatenate(speeds), np.concatenate(forces)
        if len(speed) < 2:
            return None
        order = np.argsort(equations.runs[own], kind="stable")
        blocks = self.fit.left_out.blocks[own][order]
        points = friction_curve(speed, force, blocks, speed_edges(speed))
        if not len(points):
            return None
        reach = float(np.max(np.abs(speed)))
        at = np.linspace(-reach if speed.min() < 0.0 else 0.0, reach if speed.max() > 0.0 else 0.0, 81)
        before = regressor_of(self.fit.machine).values
        return JointFrictionCurve(
            points,
            self.form,
            at,
            self._modelled(self.fit.parameters, at),
            self._modelled(before, at),
        )

    def _places(self, run: RobotRun, window: Window, times: FloatArray) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return the indices of the windows with these centres."""
        half = len(window.weights) // 2
        return np.rint(((times - run.start) / run.period - half) / window.step).astype(np.int64)

    def _rigid_torque(self, run: RobotRun, window: Window) -> FloatArray:
        """Return the torque (K,) of inertia and gravity of the joint: the machine's own, and what the fit changed."""
        regressor = regressor_of(self.fit.machine)
        total = rigid_torque(run, self.fit.machine, window)[:, self.joint]
        change = self.fit.parameters - regressor.values
        for column in np.flatnonzero(change).tolist():
            if regressor.columns[column].group in (ColumnGroup.INERTIAL, ColumnGroup.DRIVE_INERTIA):
                total = total + change[column] * window_of_column(run, regressor, window, column)[:, self.joint]
        return np.asarray(total)

    def _modelled(self, parameters: FloatArray, speed: FloatArray) -> FloatArray:
        """Return the friction of the joint over the speed (n,)."""
        machine = self.fit.machine
        values = {
            column.group: float(parameters[index])
            for index, column in enumerate(regressor_of(machine).columns)
            if column.joint == self.joint and column.group is not ColumnGroup.INERTIAL
        }
        slope = machine.coulomb_slope[self.joint]
        direction = np.tanh(slope * speed) if slope else np.sign(speed)
        total = (
            values[ColumnGroup.VISCOUS] * speed + values[ColumnGroup.COULOMB] * direction + values[ColumnGroup.CONSTANT]
        )
        return np.asarray(total)

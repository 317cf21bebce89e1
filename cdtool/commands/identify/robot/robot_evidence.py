"""What the outputs show of a robot's joints: unseen torque, friction over speed, decision on the friction, motion.

The runs are read again, and the chosen forms of friction fitted again: an identification keeps no samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.friction_curve import FrictionCurve, friction_curve, speed_edges
from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.robot.friction_choice import FrictionForm, JointFriction
from cdtool.commands.identify.robot.robot_dynamics import (
    HALF_WIDTH,
    RobotFit,
    RobotParameters,
    Window,
    identify_robot,
    window_of_column,
)
from cdtool.commands.identify.robot.robot_excitation import (
    JointMotion,
    PlannedRobotMotion,
    measure_joint_motion,
    plan_robot_motion,
)
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.commands.identify.robot.unexplained_torque import without_unexplained
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.urdf_robot import UrdfRobot

# A line is interrupted where windows are further apart than this many usual steps.
_GAP = 1.5
_FORMS: Mapping[FrictionForm, RobotParameters] = {
    FrictionForm.OFFSET: RobotParameters(friction=False),
    FrictionForm.FRICTION_ALONE: RobotParameters(offsets=False),
    FrictionForm.FRICTION: RobotParameters(),
    FrictionForm.DRIVE_INERTIA: RobotParameters(drive_inertia=True),
    FrictionForm.WITH_INERTIAS: RobotParameters(inertial=True),
}
# Those with which the old friction of a joint is compared.
_REFITTED = (FrictionForm.FRICTION_ALONE, FrictionForm.FRICTION)


class FrictionAnswer(Enum):
    """Whether the friction of a joint is new, and why the old one stays."""

    NEW = "new friction"
    NOT_BETTER = "not better by more than one standard error"
    NOT_IDENTIFIABLE = "new friction is not identifiable"
    NOT_MOVED = "the joint does not move"
    UNEXPLAINED = "the machine explains too little of the torque"


@dataclass(frozen=True)
class FrictionDecision:
    """The friction of a joint: the answer, and RMS errors [N m, N] of the torque on parts that were left out.

    `form`: the new one; where the old friction stays, that which predicted best of those compared with it, None without
    any. `before`: with the old friction, `after`: with `form`.
    `torque`: RMS in motion. `floor`: between runs of equal motion. NaN for what is not known.
    """

    answer: FrictionAnswer
    form: FrictionForm | None
    before: float
    after: float
    torque: float
    floor: float


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
    """What the logs show of one joint; `unseen` and `friction` are None for a joint without enough motion.

    `units`: of torque, and of travel.
    """

    motion: JointMotion
    units: tuple[str, str]
    unseen: UnseenTorque | None = None
    friction: JointFrictionCurve | None = None


def _rms(residual: FloatArray) -> float:
    known = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def decision_of(done: IdentifiedMachine, joint: int) -> FrictionDecision | None:
    """Return the decision on the friction of a joint; None for an axis."""
    friction, robot = done.joints[joint].robot, done.robot
    if friction is None or robot is None:
        return None
    before = friction.errors.get(FrictionForm.PREVIOUS, math.nan)
    compared = _compared(friction)
    form = compared if friction.form is FrictionForm.PREVIOUS else friction.form
    after = friction.errors.get(form, math.nan) if form else math.nan
    floor = float(robot.repeated.floor[joint])
    answer = _answer(friction, done.joints[joint].refused)
    return FrictionDecision(answer, form, before, after, friction.torque, floor)


def _answer(friction: JointFriction, refused: Mapping[str, str]) -> FrictionAnswer:
    if friction.form is not FrictionForm.PREVIOUS:
        return FrictionAnswer.NEW
    if "friction" in refused:
        return FrictionAnswer.UNEXPLAINED
    if not math.isfinite(friction.errors.get(FrictionForm.PREVIOUS, math.nan)):
        return FrictionAnswer.NOT_MOVED
    return FrictionAnswer.NOT_BETTER if _compared(friction) else FrictionAnswer.NOT_IDENTIFIABLE


def _compared(friction: JointFriction) -> FrictionForm | None:
    """Return the form that was compared with the old friction, by the rule of choose_friction."""
    known = [form for form in _REFITTED if math.isfinite(friction.errors.get(form, math.nan))]
    if known:
        return min(known, key=lambda form: friction.errors[form])
    has_offset = math.isfinite(friction.errors.get(FrictionForm.OFFSET, math.nan))
    return FrictionForm.OFFSET if has_offset else None


def base_set_of(done: IdentifiedMachine) -> NotIdentifiable | None:
    """Return why the full set of base parameters is not identifiable; None if it is, or for an axis."""
    inertias = done.robot.inertias if done.robot else None
    return next(iter(inertias.not_identifiable), None) if inertias else None


def inertia_plan(done: IdentifiedMachine, motions: Sequence[JointMotion]) -> PlannedRobotMotion | None:
    """Return the motion that would show the inertias of all links; None if nothing is missing, or nothing moves."""
    refused = base_set_of(done)
    if refused is None:
        return None
    return plan_robot_motion(motions, int(refused.numbers.get("base_parameters", 0.0)))


def robot_evidence(
    done: IdentifiedMachine, runs: Sequence[RobotRun], machine: CoupledMachine
) -> tuple[RobotJointEvidence, ...]:
    """Return what the logs show of each joint.

    Parameters
    ----------
    done : IdentifiedMachine
        What was identified from these runs.
    runs : sequence of RobotRun
        All usable runs as they were logged.
    machine : CoupledMachine
        The robot as it was before.

    Returns
    -------
    tuple of RobotJointEvidence
        In the order of the joints.

    Raises
    ------
    IdentificationError
        No joint moves.
    """
    motions = measure_joint_motion(runs, machine)
    factors = done.robot.torque_factors if done.robot else 1.0
    scaled = [replace(run, torque=run.torque * factors) for run in runs]
    explained = without_unexplained(scaled, machine, HALF_WIDTH).runs
    fits: dict[FrictionForm, RobotFit] = {}
    units = _units_of(machine)
    evidence = []
    for joint, item in enumerate(done.joints):
        decision = decision_of(done, joint)
        form = decision.form if decision else None
        if item.robot is None or form is None:
            evidence.append(RobotJointEvidence(motions[joint], units[joint]))
            continue
        if form not in fits:
            fits[form] = identify_robot(explained, machine, _FORMS[form])
        shown = _Joint(joint, form, fits[form], explained)
        evidence.append(RobotJointEvidence(motions[joint], units[joint], shown.unseen(), shown.friction(machine)))
    return tuple(evidence)


def _units_of(machine: CoupledMachine) -> list[tuple[str, str]]:
    """Return the units of torque and travel of each joint."""
    if not isinstance(machine, UrdfRobot):
        return [("N m", "rad")] * len(machine.joints)
    slides = {joint.name: joint.prismatic for joint in machine.tree.joints}
    return [("N", "m") if slides[name] else ("N m", "rad") for name in machine.tree.order]


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

    def friction(self, machine: CoupledMachine) -> JointFrictionCurve | None:
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
        before = regressor_of(machine).values
        return JointFrictionCurve(
            points,
            self.form,
            at,
            self._modelled(self.fit.machine, self.fit.parameters, at),
            self._modelled(machine, before, at),
        )

    def _places(self, run: RobotRun, window: Window, times: FloatArray) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return the indices of the windows with these centres."""
        half = len(window.weights) // 2
        return np.rint(((times - run.start) / run.period - half) / window.step).astype(np.int64)

    def _rigid_torque(self, run: RobotRun, window: Window) -> FloatArray:
        """Return the torque (K,) of inertia and gravity of the joint: the machine's own, and what the fit changed."""
        machine, regressor = self.fit.machine, regressor_of(self.fit.machine)
        momentum, velocity_force, gravity = machine.momentum_terms(run.position, run.speed)
        total = (window.rate(momentum) + window.average(gravity - velocity_force))[:, self.joint]
        change = self.fit.parameters - regressor.values
        for column in np.flatnonzero(change).tolist():
            if regressor.columns[column].group in (ColumnGroup.INERTIAL, ColumnGroup.DRIVE_INERTIA):
                total = total + change[column] * window_of_column(run, regressor, window, column)[:, self.joint]
        return np.asarray(total)

    def _modelled(self, machine: CoupledMachine, parameters: FloatArray, speed: FloatArray) -> FloatArray:
        """Return the friction of the joint over the speed (n,)."""
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


def excitation_needs(motion: JointMotion) -> tuple[Missing, ...]:
    """Return what the motion of a joint does not have for its friction: speeds, directions; empty if it has all."""
    if not motion.is_moving:
        return (Missing.OTHER_MOTION,)
    missing = [] if len(motion.excitation.speeds) > 1 else [Missing.SECOND_SPEED]
    missing += [Missing.REVERSALS] if motion.excitation.is_one_way else []
    return tuple(missing)

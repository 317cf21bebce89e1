"""The friction of each joint of a robot, where it predicts parts of the logs left out of the fit better than the old.

The inertias of the links are taken as known, so that no joint's friction depends on that of another one. Each form of
friction is fitted without a run, or without a fifth of the only one, and predicts it. New friction replaces the present
one of a joint only where it predicts better by more than one standard error, over blocks of the log, of the difference
(the one-standard-error rule of Breiman and others, 1984); a drive inertia is added for more than two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.estimate import Estimate, Identified, Missing, NotIdentifiable
from cdtool.commands.identify.robot.robot_dynamics import RobotFit, RobotParameters, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.urdf_robot import UrdfRobot

# With a larger relative standard error viscous friction predicts faster motion wrong, however well that of the logs.
_WORST_VISCOUS = 0.5
_FRICTION = (ColumnGroup.VISCOUS.value, ColumnGroup.COULOMB.value)


class FrictionForm(Enum):
    """What of a joint's friction is new, the inertias of the links as they were unless stated."""

    PREVIOUS = "as before"
    OFFSET = "constant force"
    FRICTION_ALONE = "viscous and Coulomb friction"
    FRICTION = "viscous and Coulomb friction, constant force"
    DRIVE_INERTIA = "viscous and Coulomb friction, constant force, drive inertia"
    WITH_INERTIAS = "viscous and Coulomb friction, constant force, with the inertias of all links"


class FrictionAnswer(Enum):
    """Whether the friction of a joint is new, and why the old one stays."""

    NEW = "new friction"
    NOT_BETTER = "not better by more than one standard error"
    NOT_IDENTIFIABLE = "new friction is not identifiable"
    NOT_MOVED = "the joint does not move"
    UNEXPLAINED = "the machine explains too little of the torque"


@dataclass(frozen=True, eq=False)
class JointFriction:
    """The friction of a joint.

    `identified`: the estimates of the `form`, and what the runs cannot show. `together`: values that are not
    identifiable alone. `errors`: RMS [N m, N] of the torque that each form does not explain in parts left out of its
    fit; NaN: no motion. `torque`: RMS of the joint's torque in motion [N m, N]. `is_explained`: by the machine.
    """

    joint: int
    form: FrictionForm
    identified: Identified
    together: tuple[Estimate, ...]
    errors: Mapping[FrictionForm, float]
    torque: float
    is_explained: bool = True

    @property
    def answer(self) -> FrictionAnswer:
        """Return whether the friction is new, and why the old one stays."""
        if self.form is not FrictionForm.PREVIOUS:
            return FrictionAnswer.NEW
        if not self.is_explained:
            return FrictionAnswer.UNEXPLAINED
        if not math.isfinite(self.before):
            return FrictionAnswer.NOT_MOVED
        return FrictionAnswer.NOT_BETTER if self.compared else FrictionAnswer.NOT_IDENTIFIABLE

    @property
    def compared(self) -> FrictionForm | None:
        """Return the new form, or that which predicted best of those compared with the old one; None without any."""
        if self.form is not FrictionForm.PREVIOUS:
            return self.form
        forms = (FrictionForm.FRICTION_ALONE, FrictionForm.FRICTION)
        known = [form for form in forms if math.isfinite(self.errors.get(form, math.nan))]
        if known:
            return min(known, key=lambda form: self.errors[form])
        has_offset = math.isfinite(self.errors.get(FrictionForm.OFFSET, math.nan))
        return FrictionForm.OFFSET if has_offset else None

    @property
    def before(self) -> float:
        """Return the error with the old friction [N m, N]."""
        return self.errors.get(FrictionForm.PREVIOUS, math.nan)

    @property
    def after(self) -> float:
        """Return the error with the `compared` form [N m, N]."""
        return self.errors.get(self.compared, math.nan) if self.compared else math.nan

    @property
    def summary(self) -> dict[str, Any]:
        """Return the decision, and the RMS errors by form, as JSON values."""
        return {
            "answer": self.answer.name.lower(),
            "form": self.compared.name.lower() if self.compared else None,
            "before": self.before,
            "after": self.after,
            "torque": self.torque,
            "errors": {form.name.lower(): error for form, error in self.errors.items()},
        }

    @property
    def explained_share(self) -> float:
        """Return the share of the torque's power that the best form explains; NaN without motion."""
        known = [error for error in self.errors.values() if np.isfinite(error)]
        return 1.0 - (min(known) / self.torque) ** 2 if known and self.torque > 0.0 else float("nan")


def choose_friction(
    runs: Sequence[RobotRun], machine: CoupledMachine, half_width: float
) -> tuple[tuple[JointFriction, ...], Mapping[FrictionForm, RobotFit]]:
    """Return the friction of each joint from contact-free runs, in the order of the joints, and the fits by form.

    `half_width` [s] as in RobotParameters. The constant force of a joint is kept where that predicts better, and where
    runs in one direction show only its sum with Coulomb friction: then both are known only together.
    Raises IdentificationError without any motion, UsageError for runs of another machine.
    """
    choice = _Choice(runs, machine, RobotParameters(half_width=half_width))
    candidates = (choice.friction, choice.friction_alone, choice.offset, choice.drive)
    joints = tuple(choice.of_joint(joint) for joint in range(len(machine.joints)))
    return joints, {item.form: item.fit for item in candidates}


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A form, its fit, and the keys that it must have identified."""

    form: FrictionForm
    fit: RobotFit
    keys: tuple[str, ...]

    def estimates(self, joint: int) -> tuple[Estimate, ...]:
        """Return the estimates of a joint; empty if one is not identifiable."""
        found = {item.key: item for item in self.fit.identified.estimates if item.joint == joint}
        if not all(key in found for key in self.keys):
            return ()
        return tuple(found[key] for key in self.keys)

    def error(self, joint: int) -> float:
        """Return the RMS on parts left out."""
        return float(self.fit.torque_error.cross_validated[joint])

    def residual(self, joint: int) -> FloatArray:
        """Return the residuals on parts left out."""
        return self.fit.left_out.of_joint(joint)


class _Choice:
    """All forms, fitted once for all joints."""

    def __init__(self, runs: Sequence[RobotRun], machine: CoupledMachine, what: RobotParameters) -> None:
        self._machine = machine
        self._speed = np.concatenate([run.speed for run in runs])
        self._torque = np.concatenate([run.torque for run in runs])
        constant = ColumnGroup.CONSTANT.value

        def candidate(form: FrictionForm, keys: tuple[str, ...], **changes: bool) -> _Candidate:
            return _Candidate(form, identify_robot(runs, machine, replace(what, **changes)), keys)

        self.friction = candidate(FrictionForm.FRICTION, (*_FRICTION, constant))
        self.friction_alone = candidate(FrictionForm.FRICTION_ALONE, _FRICTION, offsets=False)
        self.offset = candidate(FrictionForm.OFFSET, (constant,), friction=False)
        self.drive = candidate(
            FrictionForm.DRIVE_INERTIA, (ColumnGroup.DRIVE_INERTIA.value, *_FRICTION, constant), drive_inertia=True
        )

    def of_joint(self, joint: int) -> JointFriction:
        """Return the friction of a joint."""
        chosen = self._chosen(joint)
        errors = {item.form: item.error(joint) for item in self._candidates(joint)}
        errors[FrictionForm.PREVIOUS] = float(self.friction.fit.torque_error.previous[joint])
        missing = tuple(item for item in self.friction.fit.identified.not_identifiable if item.joint == joint)
        known = chosen.estimates(joint) if chosen else ()
        one_way = self._is_one_way(joint)
        alone = tuple(item for item in known if not one_way and not _is_vague(item))
        missing += tuple(_as_missing(item) for item in known if not one_way and _is_vague(item))
        return JointFriction(
            joint=joint,
            form=FrictionForm.PREVIOUS if chosen is None else chosen.form,
            identified=Identified(alone, missing),
            together=tuple(replace(item, standard_error=math.nan) for item in known if item not in alone),
            errors=errors,
            torque=self._moving_torque(joint),
        )

    def _moving_torque(self, joint: int) -> float:
        moves = np.abs(self._speed[:, joint]) > self._machine.stick_speed[joint]
        torque = self._torque[moves, joint]
        known = torque[np.isfinite(torque)]
        return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")

    def _candidates(self, joint: int) -> Iterator[_Candidate]:
        """Yield each form of which a joint's parameters are all identifiable."""
        for item in (self.friction, self.friction_alone, self.offset, self.drive):
            if item.estimates(joint) and (item is not self.drive or self._has_unknown_drive(joint)):
                yield item

    def _has_unknown_drive(self, joint: int) -> bool:
        """Return whether the machine file can have a drive inertia and has none: a data sheet knows it better."""
        # With load coordinates, only a robot from a URDF has a key for it.
        has_key = self._machine.coordinates == "motor" or isinstance(self._machine, UrdfRobot)
        return has_key and not self._machine.motor_inertia[joint]

    def _chosen(self, joint: int) -> _Candidate | None:
        """Return the form that replaces the present friction; None: it stays."""
        forms = {item.form: item for item in self._candidates(joint)}
        simple = [forms[form] for form in (FrictionForm.FRICTION_ALONE, FrictionForm.FRICTION) if form in forms]
        chosen = min(simple, key=lambda item: item.error(joint)) if simple else forms.get(FrictionForm.OFFSET)
        if chosen is None:
            return None
        drive = forms.get(FrictionForm.DRIVE_INERTIA)
        if drive is not None and drive.fit.left_out.is_better(joint, chosen.residual(joint), 2.0):
            chosen = drive
        previous = chosen.fit.left_out.of_joint(joint, is_previous=True)
        return chosen if chosen.fit.left_out.is_better(joint, previous, 1.0) else None

    def _is_one_way(self, joint: int) -> bool:
        """Return whether a joint moves in one direction only, so that its constant force is not identifiable."""
        refused = [item for item in self.friction.fit.identified.not_identifiable if item.joint == joint]
        return any(Missing.REVERSALS in item.missing for item in refused)


def _is_vague(estimate: Estimate) -> bool:
    """Return whether a viscous friction describes nothing but the speeds of the logs."""
    return estimate.key == ColumnGroup.VISCOUS.value and estimate.relative_error > _WORST_VISCOUS


def _as_missing(item: Estimate) -> NotIdentifiable:
    numbers = {"value": item.value, "standard_error": item.standard_error}
    return NotIdentifiable(item.section, item.key, (Missing.SECOND_SPEED,), numbers, item.joint)

"""The friction of each joint of a robot, where it predicts parts of the logs left out of the fit better than the old.

The inertias of the links are taken as known, so that no joint's friction depends on that of another one. Each form of
friction is fitted without a run, or without a fifth of the only one, and predicts it. New friction replaces the present
one of a joint only where it predicts better by more than one standard error, over blocks of the log, of the difference
(the one-standard-error rule of Breiman and others, 1984); a drive inertia is added for more than two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from cdtool.commands.identify.estimate import Estimate, Identified, Missing, NotIdentifiable
from cdtool.commands.identify.robot.robot_dynamics import LeftOutTorque, RobotFit, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.urdf_robot import UrdfRobot


class FrictionForm(Enum):
    """What of a joint's friction is new, the inertias of the links as they were unless stated."""

    PREVIOUS = "as before"
    FRICTION_ALONE = "viscous and Coulomb friction"
    FRICTION = "viscous and Coulomb friction, constant force"
    DRIVE_INERTIA = "viscous and Coulomb friction, constant force, drive inertia"
    WITH_INERTIAS = "viscous and Coulomb friction, constant force, with the inertias of all links"

    @property
    def groups(self) -> tuple[ColumnGroup, ...]:
        """Return the groups of parameters that are free in its fit."""
        friction = (ColumnGroup.VISCOUS, ColumnGroup.COULOMB)
        return {
            FrictionForm.FRICTION_ALONE: friction,
            FrictionForm.FRICTION: (*friction, ColumnGroup.CONSTANT),
            FrictionForm.DRIVE_INERTIA: (ColumnGroup.DRIVE_INERTIA, *friction, ColumnGroup.CONSTANT),
            FrictionForm.WITH_INERTIAS: (*friction, ColumnGroup.CONSTANT, ColumnGroup.INERTIAL),
        }.get(self, ())


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

    `identified`: the estimates of the `form`, and what the runs cannot show. `compared`: the new form, or the one that
    was compared with the old one; None without any. `together`: values that are not identifiable alone. `errors`: RMS
    [N m, N] of the torque that each form does not explain in parts left out of its fit; NaN: no motion. `torque`: RMS
    of the joint's torque in motion [N m, N]. `is_explained`: by the machine.
    """

    joint: int
    form: FrictionForm
    compared: FrictionForm | None
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
    runs: Sequence[RobotRun], machine: CoupledMachine
) -> tuple[tuple[JointFriction, ...], Mapping[FrictionForm, RobotFit]]:
    """Return the friction of each joint from contact-free runs, in the order of the joints, and the fits by form.

    The constant force of a joint is kept where that predicts better, and where runs in one direction show only its sum
    with Coulomb friction: then both are known only together. Raises IdentificationError without any motion, UsageError
    for runs of another machine.
    """
    fits = {form: identify_robot(runs, machine, frozenset(form.groups)) for form in _TRIED}
    speed, torque = (np.concatenate([getattr(run, name) for run in runs]) for name in ("speed", "torque"))
    joints = []
    for joint, stick in enumerate(machine.stick_speed):
        moving = torque[np.abs(speed[:, joint]) > stick, joint]
        known = moving[np.isfinite(moving)]
        rms = float(np.sqrt(np.mean(known**2))) if len(known) else math.nan
        joints.append(_of_joint(joint, fits, machine, rms))
    return tuple(joints), fits


_TRIED = (FrictionForm.FRICTION, FrictionForm.FRICTION_ALONE, FrictionForm.DRIVE_INERTIA)


def _of_joint(
    joint: int, fits: Mapping[FrictionForm, RobotFit], machine: CoupledMachine, torque: float
) -> JointFriction:
    """Return the friction of a joint; `torque`: its RMS in motion [N m, N]."""
    # A data sheet knows a drive inertia better. With load coordinates, only a robot from a URDF has a key for it.
    has_key = machine.coordinates == "motor" or isinstance(machine, UrdfRobot)
    is_drive_unknown = has_key and not machine.motor_inertia[joint]
    forms = [form for form in _TRIED if form is not FrictionForm.DRIVE_INERTIA or is_drive_unknown]
    estimates = {form: found for form in forms if (found := _estimates(form, fits[form], joint))}
    left_out = {form: fits[form].left_out for form in estimates}
    errors = {form: item.error(joint) for form, item in left_out.items()}
    whole = fits[FrictionForm.FRICTION]
    compared = _compared(joint, errors, left_out)
    is_better = compared is not None and left_out[compared].gain(joint) > 1.0
    known = estimates[compared] if compared and is_better else ()
    missing = tuple(item for item in whole.identified.not_identifiable if item.joint == joint)
    # In one direction only the sum of constant force and Coulomb friction is identifiable.
    one_way = any(Missing.REVERSALS in item.missing for item in missing)
    # Such a viscous friction describes nothing but the speeds of the logs, and predicts faster motion wrong.
    vague = [item for item in known if item.key == ColumnGroup.VISCOUS.value and item.relative_error > 0.5]
    alone = tuple(item for item in known if not one_way and item not in vague)
    for item in () if one_way else vague:
        numbers = {"value": item.value, "standard_error": item.standard_error}
        missing += (NotIdentifiable(item.section, item.key, (Missing.SECOND_SPEED,), numbers, joint),)
    return JointFriction(
        joint=joint,
        form=compared if compared and is_better else FrictionForm.PREVIOUS,
        compared=compared,
        identified=Identified(alone, missing),
        together=tuple(replace(item, standard_error=math.nan) for item in known if item not in alone),
        errors={**errors, FrictionForm.PREVIOUS: whole.left_out.error(joint, is_previous=True)},
        torque=torque,
    )


def _estimates(form: FrictionForm, fit: RobotFit, joint: int) -> tuple[Estimate, ...]:
    """Return the estimates of a joint; empty if one is not identifiable."""
    found = {item.key: item for item in fit.identified.estimates if item.joint == joint}
    keys = [group.value for group in form.groups]
    return tuple(found[key] for key in keys) if all(key in found for key in keys) else ()


def _compared(
    joint: int, errors: Mapping[FrictionForm, float], left_out: Mapping[FrictionForm, LeftOutTorque]
) -> FrictionForm | None:
    """Return the form that predicts best, with a drive inertia only if that is clear; None without any."""
    simple = [form for form in (FrictionForm.FRICTION_ALONE, FrictionForm.FRICTION) if form in errors]
    if not simple:
        return None
    chosen = min(simple, key=lambda form: errors[form])
    drive = left_out.get(FrictionForm.DRIVE_INERTIA)
    if drive is not None and drive.gain(joint, left_out[chosen]) > 2.0:
        return FrictionForm.DRIVE_INERTIA
    return chosen

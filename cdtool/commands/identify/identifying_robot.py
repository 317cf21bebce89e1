"""`cdtool identify` of a robot or planar arm: torque constants, friction, and inertias where the motion shows them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.errors import CdtoolError, ConfigurationError, RecordingError
from cdtool.base.files.bounded_loading import read_text
from cdtool.base.remote.remote_path import joined
from cdtool.commands.identify.estimate import IdentificationError, Identified, Method, NotIdentifiable
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.robot.base_parameters import BaseParameterSet
from cdtool.commands.identify.robot.consistent_inertia import consistent_fit
from cdtool.commands.identify.robot.drive_gains import LoadedRuns, drive_gains
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, FrictionForm, JointFriction, choose_friction
from cdtool.commands.identify.robot.robot_dynamics import (
    RobotFit,
    identify_robot,
    is_prismatic,
    joint_estimates,
)
from cdtool.commands.identify.robot.robot_evidence import joint_evidence, joint_excitations
from cdtool.commands.identify.robot.robot_run import RobotRun, robot_run
from cdtool.commands.identify.robot.unexplained_torque import without_unexplained
from cdtool.commands.identify.robot.updated_urdf import updated_urdf
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.urdf_robot import UrdfRobot
from cdtool.recordings.recording import Recording

# A joint of whose torque the best model explains less than this share has a wrong channel, or the robot a wrong URDF.
_EXPLAINED = 0.5
# Units of inertia, force, travel and viscous friction.
_REVOLUTE, _PRISMATIC = ("kg m2", "N m", "rad", "N m s/rad"), ("kg", "N", "m", "N s/m")


@dataclass(frozen=True, eq=False)
class InertiaIdentification:
    """The inertial parameters of all links: whether the runs determine them, and whether they replace the present ones.

    `base`: the base parameters by least squares, with `condition_number` of the scaled equations. `not_identifiable`:
    why they are no complete set; empty if they are. `refused`: why a complete set does not replace the present
    inertias. `residual_rise`: relative, by links that are physical.
    """

    base: BaseParameterSet
    condition_number: float
    not_identifiable: tuple[NotIdentifiable, ...]
    refused: str = ""
    is_new: bool = False
    residual_rise: float = 0.0


@dataclass(frozen=True, eq=False)
class RobotIdentification:
    """What was identified of a robot; `joints` in the order of the machine's joints.

    `gains`: torque constants, None without loaded runs; with them the logged torques were multiplied.
    `unexplained_share`: of the equations left out, because no friction explains their torque. `urdf`: the text of the
    updated URDF, empty if it stays as it is.
    """

    joints: tuple[JointIdentification, ...]
    inertias: InertiaIdentification
    gains: Identified | None
    unexplained_share: float
    urdf: str

    @property
    def summary(self) -> dict[str, Any]:
        """Return what belongs to the whole robot as JSON values."""
        inertias = self.inertias
        return {
            "base_parameters": {
                "names": list(inertias.base.names),
                "values": inertias.base.values.tolist(),
                "standard_errors": inertias.base.standard_errors.tolist(),
                "excitation": inertias.base.excitation.tolist(),
                "identifiable": list(inertias.base.identifiable),
                "condition_number": inertias.condition_number,
                "not_identifiable": [item.summary for item in inertias.not_identifiable],
                "refused": inertias.refused or None,
                "is_new": inertias.is_new,
                "residual_rise": inertias.residual_rise,
            },
            "torque_constants": self.gains
            and {
                "estimates": [item.summary for item in self.gains.estimates],
                "not_identifiable": [item.summary for item in self.gains.not_identifiable],
            },
            "unexplained_share": self.unexplained_share,
        }


def identify_joints(
    recordings: Sequence[Recording],
    machine: CoupledMachine,
    given: Mapping[str, Any],
    folder: Path,
    loaded: tuple[Sequence[Recording], LoadedRuns] | None = None,
) -> RobotIdentification:
    """Return what contact-free recordings show of a robot.

    Parameters
    ----------
    recordings : sequence of Recording
        On the load side.
    machine : CoupledMachine
        The robot of the machine file.
    given : Mapping
        The values of the machine file.
    folder : Path
        The folder of the machine file.
    loaded : tuple, optional
        Recordings with a known payload, and the payload.

    Returns
    -------
    RobotIdentification
        New friction only where it predicts better than the present one.

    Raises
    ------
    IdentificationError
        No usable recording, or torques that neither the robot's links nor friction explain.
    """
    runs, first_fault = _runs_of(recordings)
    if not runs:
        raise IdentificationError(f"nothing can be identified: {first_fault}", "see docs/identification.md")
    gains, factors = None, np.ones(len(machine.joints))
    if loaded is not None:
        with_payload, fault = _runs_of(loaded[0])
        if not with_payload:
            raise IdentificationError(f"no usable run with the payload: {fault}", "see docs/identification.md")
        present = _present_scale(given, len(machine.joints))
        gains = drive_gains(runs, with_payload, loaded[1], machine, present)
        for item in gains.estimates:
            factors[item.joint] = item.value / present[item.joint]
        runs = [replace(run, torque=run.torque * factors) for run in runs]
    explained = without_unexplained(runs, machine)
    if explained.share > 0.1:  # of the motion: these are no exceptions
        raise IdentificationError(
            f"no friction explains the torque during {100.0 * explained.share:.0f} % of the motion",
            "leave out logs with contacts and stops; check the order, signs and units of the channels",
        )
    joints, fits = choose_friction(explained.runs, machine)
    whole = identify_robot(explained.runs, machine, frozenset(FrictionForm.WITH_INERTIAS.groups))
    inertias, joints, urdf = _with_inertias(whole, joints, given, folder)
    refused: tuple[Mapping[str, str], ...] = ({},) * len(joints)
    if not inertias.is_new:
        joints, refused = _refuse_unexplained(joints, machine)
    fits = {**fits, FrictionForm.WITH_INERTIAS: whole}
    identified = []
    for excitation, friction, reasons in zip(joint_excitations(runs, machine), joints, refused, strict=True):
        shown = None
        if friction.compared is not None:
            is_new = friction.answer is FrictionAnswer.NEW
            shown = joint_evidence(friction.joint, fits[friction.compared], is_new, explained.runs)
        identified.append(
            JointIdentification(
                machine.joints[friction.joint],
                units=_PRISMATIC if is_prismatic(machine, friction.joint) else _REVOLUTE,
                refused=reasons,
                robot=friction,
                evidence=shown,
                excitation=excitation,
            )
        )
    return RobotIdentification(tuple(identified), inertias, gains, explained.share, urdf)


def _runs_of(recordings: Sequence[Recording]) -> tuple[list[RobotRun], str]:
    """Return the usable runs, and why the first of the others is not."""
    runs, fault = [], ""
    for recording in recordings:
        try:
            runs.append(robot_run(recording))
        except RecordingError as error:
            fault = fault or str(error)
    return runs, fault


def torque_table(given: Mapping[str, Any]) -> str:
    """Return the table of the machine file that maps the torque; raises ConfigurationError if there is not one only."""
    channels = given.get("channels", {})
    found = ["channels.torque"] if "torque" in channels else []
    found += ["channels.mcap.torque"] if "torque" in channels.get("mcap", {}) else []
    if len(found) != 1:
        raise ConfigurationError(
            f"torque is mapped in {' and '.join(found) or 'no table'}",
            "to identify torque constants, give a machine file with one table for the torque",
        )
    return found[0]


def _present_scale(given: Mapping[str, Any], count: int) -> list[float]:
    table: Any = given
    for name in torque_table(given).split("."):
        table = table[name]
    scale = table.get("scale", 1.0)
    return [float(item) for item in scale] if isinstance(scale, list) else [float(scale)] * count


def _refuse_unexplained(
    joints: Sequence[JointFriction], machine: CoupledMachine
) -> tuple[tuple[JointFriction, ...], tuple[Mapping[str, str], ...]]:
    """Return the joints with the old friction where the model explains little; raises IdentificationError if half do.

    A joint without motion is no such joint.
    """
    shares = [friction.explained_share for friction in joints]
    known = [share for share in shares if math.isfinite(share)]
    bad = [joint for joint, share in enumerate(shares) if share < _EXPLAINED]
    if bad and 2 * len(bad) >= len(known):
        name, share = machine.joints[bad[0]], shares[bad[0]]
        raise IdentificationError(
            f"the machine explains {100.0 * max(share, 0.0):.0f} % of the torque of joint '{name}' "
            f"(below {100.0 * _EXPLAINED:.0f} % in {len(bad)} of {len(known)} joints)",
            "check order, signs and units of the channels, and the inertias of the machine",
        )
    kept = tuple(_as_before(friction) if joint in bad else friction for joint, friction in enumerate(joints))
    reasons: list[Mapping[str, str]] = [{} for _ in joints]
    for joint in bad:
        reasons[joint] = {"friction": f"the machine explains {100.0 * max(shares[joint], 0.0):.0f} % of the torque"}
    return kept, tuple(reasons)


def _as_before(friction: JointFriction) -> JointFriction:
    nothing = Identified((), friction.identified.not_identifiable)
    return replace(friction, form=FrictionForm.PREVIOUS, identified=nothing, together=(), is_explained=False)


def _with_inertias(
    fit: RobotFit, joints: tuple[JointFriction, ...], given: Mapping[str, Any], folder: Path
) -> tuple[InertiaIdentification, tuple[JointFriction, ...], str]:
    """Return the inertias, the joints, and the text of the URDF, new where the runs determine the inertias."""
    missing = tuple(item for item in fit.identified.not_identifiable if item.key == "base_parameters")
    found = InertiaIdentification(fit.base, fit.condition_number, missing)
    if missing:
        return found, joints, ""
    if not _predicts_better(fit, joints):
        return replace(found, refused="the present inertias predict unseen parts as well"), joints, ""
    if not isinstance(fit.machine, UrdfRobot):
        return replace(found, refused="new ones predict better, but only a URDF has a place for them"), joints, ""
    try:
        return _new_urdf(fit, found, joints, joined(folder, str(given["machine"]["urdf"])))
    except CdtoolError as fault:
        return replace(found, refused=str(fault)), joints, ""


def _predicts_better(fit: RobotFit, joints: Sequence[JointFriction]) -> bool:
    """Return whether inertias and friction predict no joint clearly worse than before, and one clearly better.

    And no joint worse than new friction alone does.
    """
    moving = [item.joint for item in joints if math.isfinite(item.errors[FrictionForm.PREVIOUS])]
    gains = [fit.left_out.gain(joint) for joint in moving]
    if any(gain < -1.0 for gain in gains):
        return False
    new = [fit.left_out.error(joint) for joint in moving]
    alone = [joints[joint].errors[joints[joint].form] for joint in moving]
    worse = sum(math.log(max(error, 1e-300) / max(own, 1e-300)) for error, own in zip(new, alone, strict=True))
    return worse < 0.0 and any(gain > 1.0 for gain in gains)


def _new_urdf(
    fit: RobotFit, found: InertiaIdentification, joints: tuple[JointFriction, ...], path: Path
) -> tuple[InertiaIdentification, tuple[JointFriction, ...], str]:
    consistent = consistent_fit(fit)
    if consistent.residual_rise > 0.1:  # by more than physical links may
        raise IdentificationError(
            f"no physical links explain the torques: their residual is {100.0 * consistent.residual_rise:.0f} % higher",
            "check the signs and units of the channels, and the kinematics of the URDF",
        )
    text = updated_urdf(read_text(path, ConfigurationError), consistent.tree)
    found = replace(found, is_new=True, residual_rise=consistent.residual_rise)
    return found, _joints_with_inertias(consistent.fit, joints), text


def _joints_with_inertias(fit: RobotFit, joints: Sequence[JointFriction]) -> tuple[JointFriction, ...]:
    """Return the joints with the friction that belongs to the new inertias."""
    complete = []
    for item in joints:
        known, together = joint_estimates(fit, item.joint, Method.FEASIBLE_LEAST_SQUARES)
        refused = fit.identified.not_identifiable
        missing = tuple(entry for entry in refused if entry.joint == item.joint and entry.key != "base_parameters")
        errors = {**item.errors, FrictionForm.WITH_INERTIAS: fit.left_out.error(item.joint)}
        complete.append(
            replace(
                item,
                form=FrictionForm.WITH_INERTIAS,
                compared=FrictionForm.WITH_INERTIAS,
                identified=Identified(known, missing),
                together=together,
                errors=errors,
            )
        )
    return tuple(complete)

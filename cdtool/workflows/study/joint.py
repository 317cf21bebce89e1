"""One joint of a machine, referred to the place where it is hit."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.errors import ConfigurationError, UsageError, nearest
from cdtool.machine_file import MachineFile
from cdtool.machines.axis import Axis
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.joint_machine import LINEAR_UNITS, ROTARY_UNITS, JointMachine
from cdtool.workflows.study.number_reader import StudyReader


@dataclass(frozen=True)
class StudiedJoint:
    """A joint referred to the contact: `load_mass` [kg], `motor_inertia` [kg m2], `ratio` [m/rad], `motor_friction`.

    `motor_friction` is at the motor [N m s/rad]. A rotary joint is hit `lever` l [m] from its axis, so that its inertia
    there is J/l^2 and its ratio n l; of a linear one the lever is 1.
    """

    name: str
    load_mass: float
    motor_inertia: float
    ratio: float
    motor_friction: float
    lever: float
    rotary: bool

    @property
    def square(self) -> float:
        """l^2 [m2]: a stiffness of the joint [N m/rad] over it is that at the contact [N/m]."""
        return self.lever**2

    @property
    def mass(self) -> float:
        """Load and motor together at the contact [kg]."""
        return self.load_mass + self.motor_inertia / self.ratio**2

    def unit(self, linear: str) -> str:
        """The load-side unit: N/m of a linear axis is N m/rad of a rotary one."""
        return linear.replace("/m", "/rad").replace("N", "N m") if self.rotary else linear


def studied_joint(file: MachineFile, wanted: str, reader: StudyReader) -> StudiedJoint:
    """The joint `wanted` ("" where there is only one) of any machine with joints.

    Of an arm or a robot, whose joints are coupled, the others are taken to stand: the inertia is the diagonal of M.
    Raises UsageError for an unknown joint and a lever that is missing or without meaning, ConfigurationError where an
    inertia is missing.
    """
    machine = file.machine
    if not isinstance(machine, Axis | CoupledMachine) or machine.load_units not in (LINEAR_UNITS, ROTARY_UNITS):
        raise ConfigurationError(
            f"{file.path}: no joint of this machine can be studied", "its joints have to turn all or slide all"
        )
    if not wanted and len(machine.joints) > 1:
        names = ", ".join(machine.joints)
        raise UsageError(f"{file.path} has {len(machine.joints)} joints", f"name one with --joint: {names}")
    if wanted and wanted not in machine.joints:
        raise UsageError(f"{file.path} has no joint '{wanted}'", nearest(wanted, machine.joints))
    at = machine.joints.index(wanted) if wanted else 0
    load, motor = _load_inertia(machine, at), machine.motor_inertia[at]
    key = machine.inertia_key if isinstance(machine, Axis) else "the load's inertia"
    needs = "a study needs the inertias of load and motor"
    if machine.coordinates == "load":
        needs += ", so coordinates = 'motor' with motor_inertia and transmission_ratio"
    for name, value in ((key, load), ("motor_inertia", motor)):
        if value <= 0.0:
            raise ConfigurationError(f"{file.path}: machine.{name} is missing or 0", needs)
    rotary = machine.load_units == ROTARY_UNITS
    lever = _lever(machine, rotary, reader)
    if not isinstance(machine, Axis):
        inertia = f"{load:.4g} {'kg m2' if rotary else 'kg'}"
        reader.assumed.append(f"the other joints stand: {inertia} at {machine.joints[at]}, without its motor")
    ratio = abs(machine.transmission_ratio[at]) * lever
    return StudiedJoint(machine.joints[at], load / lever**2, motor, ratio, machine.viscous_friction[at], lever, rotary)


def _load_inertia(machine: Axis | CoupledMachine, at: int) -> float:
    """Without the motor [kg m2, kg]; of coupled joints on the diagonal of M, at home."""
    if isinstance(machine, Axis):
        return machine.load_inertia[at]
    return float(machine.nominal_inertia[at] - machine.reflected_inertia[at])


def _lever(machine: JointMachine, rotary: bool, reader: StudyReader) -> float:
    given = "lever" in reader.table("impact")
    if not rotary:
        if given:
            raise UsageError("a lever is given for a linear axis", "it belongs to a rotary axis")
        return 1.0
    if not given and not isinstance(machine, Axis):
        raise UsageError("no lever is given", "--lever: how far from the joint's axis the contact is [m]")
    return reader.number("impact", "lever", 1.0, "m", "contact to axis", above=0.0)

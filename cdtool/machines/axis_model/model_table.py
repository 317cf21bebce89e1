"""The table [model] of a machine file: what the model of each axis has beside the machine's own parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, make_dataclass
from typing import Any, ClassVar

from cdtool.base.errors import ConfigurationError, nearest
from cdtool.base.settings import Place, read
from cdtool.base.value_words import value_in_words
from cdtool.machines.axis import Axis
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction, Sensors
from cdtool.machines.joint_machine import JointMachine, PerJoint, PerJointNotNegative, per_joint

# What [machine] gives, so that it must not be repeated in [model.drive].
_FROM_MACHINE = ("load_mass",)
_NOT_KEYS = (*_FROM_MACHINE, "stated_rigid")


@dataclass(frozen=True, kw_only=True)
class Bristle:
    """Friction near rest as an elastic bristle, for the joints of a robot; 0: a smooth sign in its place.

    F = stiffness z + damping z' + d v, z' = v - stiffness |v| z / G(v), G the Coulomb friction with its Stribeck rise
    (LuGre: de Wit and others, 1995); N m/rad and N m s/rad, or N/m and N s/m. Without it a joint at rest creeps.
    """

    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ConfigurationError(
                    f"model.bristle: {name} is {getattr(self, name)}", "a finite number of at least 0"
                )


_SIGNED = ("offset",)  # all others are at least 0
_PARTS: dict[str, type[Any]] = {
    "drive": ElasticDrive,
    "friction": Friction,
    "controller": Controller,
    "sensors": Sensors,
    "bristle": Bristle,
}
# The keys of a section are the parameters of its part, as numbers per joint.
_NUMBERS = {
    name: tuple(item.name for item in fields(part) if item.name not in _NOT_KEYS) for name, part in _PARTS.items()
}
_RIGID: list[Any] = [("rigid", bool, False)]
_SECTIONS = {
    name: make_dataclass(
        name,
        [(key, PerJoint if key in _SIGNED else PerJointNotNegative, ()) for key in keys] + _RIGID * (name == "drive"),
    )
    for name, keys in _NUMBERS.items()
}


@dataclass(frozen=True)
class ModelTable:
    """The values of [model] by section and key, one per joint; a section that is not given is missing."""

    sections: Mapping[str, Mapping[str, tuple[float, ...]]]

    parts: ClassVar[dict[str, type[Any]]] = _PARTS

    @staticmethod
    def tables() -> dict[str, type[Any]]:
        """Return the model of each section by its name."""
        return _SECTIONS

    @classmethod
    def read(cls, table: Mapping[str, Any], joints: int, place: Place) -> ModelTable:
        """Return [model], with the mistakes in `place`; a number is that of all joints, or a list has one for each."""
        sections: dict[str, dict[str, tuple[float, ...]]] = {}
        for name, values in table.items():
            if name not in cls.parts:
                place.note(name, "unknown key", nearest(name, cls.parts))
                continue
            if not isinstance(values, dict):
                place.note(name, f"is {value_in_words(values)}", f"add a table [model.{name}]")
                continue
            below = place.below(name)
            given = read(_SECTIONS[name], values, below)
            keys = [key for key in values if joints and key in _NUMBERS[name]]
            found: dict[str, tuple[float, ...]] = {key: per_joint(given, key, joints, below) for key in keys}
            if getattr(given, "rigid", False):
                found["stated_rigid"] = (True,) * joints
            sections[name] = found
        return cls(sections)

    def of_joint(self, name: str, joint: int) -> dict[str, float]:
        """Return the given values of a section for one joint."""
        return {key: values[joint] for key, values in self.sections.get(name, {}).items()}


def axis_model(machine: Axis, table: ModelTable | None, joint: int = 0) -> AxisModel:
    """Return the model of one axis: masses and friction of [machine] on the load side, and what [model] has.

    Without [model.drive] stiffness the drive is rigid, and known to be if the log holds the load's motion: the contact
    then acts on the one mass that the drive moves. Without [model.friction] the friction is that of [machine]. A
    Coulomb friction of one direction applies to both. Raises ConfigurationError where the load's mass or inertia is
    missing, or values contradict one another.
    """
    machine.require_inertia("a model of the axis")
    table = table or ModelTable({})
    if "bristle" in table.sections:
        raise ConfigurationError(
            f"machine '{machine.name}': model.bristle applies to robots only", "remove [model.bristle]"
        )
    motor = float(machine.reflected_inertia[joint])
    return joint_model(machine, table, joint, (motor, float(machine.nominal_inertia[joint]) - motor))


def joint_model(machine: JointMachine, table: ModelTable, joint: int, masses: tuple[float, float]) -> AxisModel:
    """Return drive, friction, controller and sensors of one joint with the `masses` of motor and load [kg, kg m2].

    [model.drive] motor_mass is a share of the load's. Raises ConfigurationError for values that contradict one another.
    """
    motor, load = masses
    drive: dict[str, Any] = {**table.of_joint("drive", joint)}
    if "motor_mass" in drive:
        if motor > 0.0:
            raise ConfigurationError(
                f"machine '{machine.name}': model.drive.motor_mass and machine.motor_inertia are both given",
                "remove model.drive.motor_mass",
            )
        motor = drive.pop("motor_mass")
        load -= motor
    controller: dict[str, Any] = {**table.of_joint("controller", joint)}
    if controller:
        _require(machine.name, "model.controller", controller, Controller)
    if "speed_filter_order" in controller:
        controller["speed_filter_order"] = int(controller["speed_filter_order"])
    one_mass = isinstance(machine, Axis) and machine.coordinates == "load" and not motor and "stiffness" not in drive
    return AxisModel(
        drive=ElasticDrive(motor_mass=motor, load_mass=load, **{"stated_rigid": one_mass, **drive}),
        friction=_friction(machine, table, joint),
        controller=Controller(**controller) if controller else None,
        sensors=Sensors(**table.of_joint("sensors", joint)),
    )


def _friction(machine: JointMachine, table: ModelTable, joint: int) -> Friction:
    given = table.of_joint("friction", joint)
    ratio = machine.transmission_ratio[joint]
    coulomb = machine.coulomb_friction[joint] / abs(ratio)
    of_machine = {
        "coulomb_forward": coulomb,
        "coulomb_backward": coulomb,
        "viscous": machine.viscous_friction[joint] / ratio**2,
        "offset": machine.constant_force[joint] / ratio,
    }
    for key, other in (("coulomb_forward", "coulomb_backward"), ("coulomb_backward", "coulomb_forward")):
        if key in given and other not in given:
            of_machine[other] = given[key]
    return Friction(**{**of_machine, **given})


def _require(machine: str, section: str, given: Mapping[str, float], part: type[Any]) -> None:
    for item in fields(part):
        if item.default is MISSING and item.default_factory is MISSING and item.name not in given:
            raise ConfigurationError(f"machine '{machine}': {section}.{item.name} is missing", "give a number")


def finite_values(part: ElasticDrive | Friction | Controller | Sensors) -> dict[str, float]:
    """Return the values of a part of the model that a table can hold: without those that are infinite."""
    values = {item.name: getattr(part, item.name) for item in fields(part)}
    return {name: float(value) for name, value in values.items() if math.isfinite(value) and name not in _NOT_KEYS}

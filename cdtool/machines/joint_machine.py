"""What all machines with joints share: names, drives, friction, and how a log is referred to the load side.

With the transmission ratio r = dx/dtheta (load travel per motor angle) a motor torque tau drives the load with tau / r,
and the motor's inertia J_m is J_m / r^2 there; position = r theta + offset.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.base.settings import NotNegative, Place, Positive, read, setting
from cdtool.recordings.clock import differentiate, integrate
from cdtool.recordings.recording import RIG_UNITS, UNITLESS, Recording, Series

LINEAR_UNITS = {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2"}
ROTARY_UNITS = {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}
_MOTOR_UNITS = {"torque": "N m", "speed": "rad/s", "position": "rad"}


PerJoint = tuple[float, ...]
PerJointNotNegative = tuple[NotNegative, ...]
_ZERO = (0.0,)


@dataclass(frozen=True, kw_only=True)
class JointTable:
    """The keys of [machine] that every type has; a number is that of all joints, or a list has one for each."""

    type: Annotated[str, setting("linear_axis, rotary_axis, planar_arm or urdf_robot")] = ""
    name: Annotated[str, setting("shown in messages and stored in signatures")] = "axis"
    joints: Annotated[
        tuple[str, ...],
        setting(
            "joint names, in the order of the columns; default: the name, of a planar_arm arm and forearm; required "
            "for a urdf_robot"
        ),
    ] = ()
    coordinates: Annotated[
        Literal["motor", "load"] | None,
        setting(
            "motor: logs hold motor torque, speed and angle; load: force, speed and position of the load, or the "
            "joints' own; default: motor, of a urdf_robot load"
        ),
    ] = None
    motor_inertia: Annotated[PerJointNotNegative, setting("at the motor shaft", unit="kg m2")] = ()
    transmission_ratio: Annotated[
        PerJoint,
        setting(
            "load travel per motor angle, not 0; negative where a positive motor angle moves the load backward; "
            "required in motor coordinates",
            unit="m/rad or rad/rad",
        ),
    ] = ()
    position_offset: Annotated[
        PerJoint,
        setting(
            "added to the load's position: load position = ratio x motor angle + offset; a robot's pose must be the "
            "model's, so its encoders' zeros matter",
            unit="m or rad",
        ),
    ] = _ZERO
    viscous_friction: Annotated[
        PerJointNotNegative,
        setting("at the motor; with load coordinates at the load, N s/m or N m s/rad", unit="N m s/rad"),
    ] = _ZERO
    coulomb_friction: Annotated[
        PerJointNotNegative, setting("at the motor; with load coordinates N or N m", unit="N m")
    ] = _ZERO
    coulomb_slope: Annotated[
        PerJointNotNegative,
        setting(
            "above 0: Coulomb friction is coulomb_friction * tanh(coulomb_slope * load speed), without sticking; 0: it "
            "has the sign of the speed, and at rest it balances the drive up to its magnitude",
            unit="s/m or s/rad",
        ),
    ] = _ZERO
    constant_force: Annotated[
        PerJoint,
        setting(
            "a constant drive effort, such as an axis's weight or an offset of the torque; at the motor; with load "
            "coordinates N or N m",
            unit="N m",
        ),
    ] = _ZERO
    stick_speed: Annotated[
        tuple[Positive, ...],
        setting("load speed below which Coulomb friction counts as sticking", unit="m/s or rad/s"),
    ] = (1e-3,)


def per_joint(table: Any, key: str, count: int, place: Place) -> tuple[float, ...]:
    """Return the values of a key, one for each joint; another number of them is a mistake in `place`."""
    values: tuple[float, ...] = getattr(table, key)
    if len(values) not in (0, 1, count):
        place.note(key, f"has {len(values)} values", f"give one number, or {count}: one per joint")
        values = values[:1]
    return values * count if len(values) == 1 else values


@dataclass(frozen=True)
class JointMachine:
    """Parameters as in machine.toml, one per joint; friction at the motor with coordinates "motor", else at the load.

    `coordinates`: "motor" if logs contain motor torque, angle and speed, "load" if they contain those of the load.
    """

    name: str
    joints: tuple[str, ...]
    coordinates: str
    motor_inertia: tuple[float, ...]
    transmission_ratio: tuple[float, ...]
    position_offset: tuple[float, ...]
    viscous_friction: tuple[float, ...]
    coulomb_friction: tuple[float, ...]
    coulomb_slope: tuple[float, ...]
    constant_force: tuple[float, ...]
    stick_speed: tuple[float, ...]

    table: ClassVar[type[Any]] = JointTable
    joints_by_default: ClassVar[tuple[str, ...]] = ()
    coordinates_by_default: ClassVar[str] = "motor"
    derives_position: ClassVar[bool] = True
    ratio_unit: ClassVar[str] = "rad/rad"

    @classmethod
    def of(cls, values: Mapping[str, Any], where: str = "machine.toml") -> Self:
        """Return the machine that the keys of [machine] describe; raises ConfigurationError with every mistake.

        `where` is the machine file, beside which other files are.

        >>> from cdtool.machines.linear_axis import LinearAxis
        >>> LinearAxis.of({"coordinates": "load", "load_mass": 600.0}).nominal_inertia.tolist()
        [600.0]
        """
        place = Place(where, "machine.")
        found = cls.read(values, place)
        place.finish()
        assert found is not None
        return found

    @classmethod
    def read(cls, values: Mapping[str, Any], place: Place) -> Self | None:
        """Return the machine, with the mistakes in `place`; None if it cannot be made."""
        if (table := read(cls.table, values, place)) is None:
            return None
        return place.tried(None, lambda: cls(**cls.parameters(table, place)))

    @classmethod
    def parameters(cls, table: Any, place: Place) -> dict[str, Any]:
        """Return the parameters that every machine has, one per joint, with the mistakes in `place`."""
        joints = table.joints or cls.joints_by_default or (table.name,)
        coordinates = table.coordinates or cls.coordinates_by_default
        if coordinates == "load":
            for key in ("motor_inertia", "transmission_ratio"):
                if getattr(table, key):
                    place.note(key, "has no meaning with coordinates = 'load'", "remove the key or coordinates")
        elif not table.transmission_ratio and place.is_whole:
            place.note("transmission_ratio", "is missing", "give a number")
        if 0.0 in table.transmission_ratio:
            hint = f"give the load travel per motor angle [{cls.ratio_unit}], not 0"
            place.note("transmission_ratio", "is 0", hint)
            table = replace(table, transmission_ratio=())
        every = {
            item.name: per_joint(table, item.name, len(joints), place)
            for item in fields(JointMachine)
            if item.name not in ("name", "joints", "coordinates")
        }
        every["transmission_ratio"] = every["transmission_ratio"] or (1.0,) * len(joints)
        every["motor_inertia"] = every["motor_inertia"] or _ZERO * len(joints)
        if len(set(joints)) != len(joints):
            raise place.fault("joints", "names a joint twice", "joint names must differ")
        return {"name": table.name, "joints": joints, "coordinates": coordinates, **every}

    @property
    def default_sides(self) -> Literal["one", "two"]:
        """ "two" for several joints: the leading one's direction is not that in which the others meet an obstacle."""
        return "one" if len(self.joints) == 1 else "two"

    @property
    def load_units(self) -> dict[str, str]:
        """Units of torque, speed, position and acceleration on the load side."""
        return ROTARY_UNITS

    @property
    def force_unit(self) -> str:
        """Unit of a contact force or torque on the load side."""
        return self.load_units["torque"]

    @property
    def speed_unit(self) -> str:
        """Unit of the load's speed."""
        return self.load_units["speed"]

    @property
    def reflected_inertia(self) -> FloatArray:
        """(J,): the motors' inertias on the load side, J_m / r^2 [kg, kg m2]."""
        inertia: FloatArray = np.array(self.motor_inertia) / np.array(self.transmission_ratio) ** 2
        return inertia

    def accepted_units(self, channel: str) -> tuple[str, ...]:
        """Return the SI units in which a log may contain a channel; the first is that of a scaled raw value."""
        quantity = channel.removeprefix("reference_")
        if channel in RIG_UNITS:
            return (RIG_UNITS[channel],)
        if channel in UNITLESS:
            return ("1",)
        load = self.load_units[quantity]
        if quantity == "acceleration" or self.coordinates == "load":
            return (load,)
        motor = _MOTOR_UNITS[quantity]
        return (motor,) if motor == load else (motor, load)

    def referred_to_load(self, recording: Recording, speed_low_pass: float = 50.0) -> Recording:
        """Return a recording as logged with every channel on the load side (apply it once).

        A missing speed is derived causally from the position, and (except for robots, whose pose must be measured) a
        missing position from the speed, a missing reference position from the reference speed. A finding reports it.
        """
        channels = {name: self._referred(name, series) for name, series in recording.channels.items()}
        findings = list(recording.findings)
        if {"speed", "position"} <= channels.keys() and not np.isfinite(channels["speed"].values).any():
            findings.append(Finding("speed_without_value", "speed"))
        if "speed" not in channels and "position" in channels:
            channels["speed"] = differentiate(channels["position"], speed_low_pass, self.speed_unit)
            findings.append(Finding("derived_speed", "speed", {"low_pass": speed_low_pass}))
        if "position" not in channels and "speed" in channels and self.derives_position:
            channels["position"] = integrate(channels["speed"], self.load_units["position"])
            findings.append(Finding("integrated_position", "position"))
        if "reference_position" not in channels and "reference_speed" in channels and self.derives_position:
            channels["reference_position"] = self._integrated_reference(channels)
            findings.append(Finding("integrated_reference", "reference_position"))
        return replace(recording, channels=channels, findings=tuple(findings))

    def _integrated_reference(self, channels: Mapping[str, Series]) -> Series:
        """Return the travel by the reference speed: from the last position at or before its first sample, else 0."""
        speed = channels["reference_speed"]
        travel = integrate(speed, self.load_units["position"])
        before = channels.get("position", travel).between(-np.inf, float(speed.time[0])).values[-1:]
        return travel.with_values(travel.values + np.nan_to_num(before).sum(axis=0), travel.unit)

    def minus_friction(self, force: FloatArray, speed: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return `force` (n, J), changed in place, minus friction and constant force of each joint.

        Viscous friction acts on `velocity`. Dry friction is Coulomb tanh(slope v) if a slope is given [s/m, s/rad];
        else it is sign(v) Coulomb, and below the stick speed it balances the force up to its magnitude, so that a
        resting machine under static torque leaves no residual.
        """
        ratios = zip(self.viscous_friction, self.transmission_ratio, strict=True)
        viscous = [friction / ratio**2 for friction, ratio in ratios]
        if all(viscous):
            # In place: on long logs allocating memory takes longer than the arithmetic.
            force -= velocity * viscous
        for j, ratio in enumerate(self.transmission_ratio):
            column = force[:, j]
            if viscous[j] and not all(viscous):
                column -= velocity[:, j] * viscous[j]
            if self.constant_force[j]:
                column -= self.constant_force[j] / ratio
            coulomb = self.coulomb_friction[j] / abs(ratio)
            if coulomb and self.coulomb_slope[j]:
                column -= coulomb * np.tanh(self.coulomb_slope[j] * speed[:, j])
            elif coulomb:
                sticking = np.clip(column, -coulomb, coulomb)
                sliding = coulomb * np.sign(speed[:, j])
                column -= np.where(np.abs(speed[:, j]) > self.stick_speed[j], sliding, sticking)
        return force

    def friction(self, speed: FloatArray) -> FloatArray:
        """Return viscous, dry and constant friction in motion (n, J) [N, N m]; at rest only the constant force."""
        return -self.minus_friction(np.zeros_like(speed), speed, speed)

    def drive_power(self, torque: FloatArray, speed: FloatArray) -> FloatArray:
        """Return v (tau - friction) of each joint (n, J) [W]."""
        power = self.minus_friction(torque.copy(), speed, speed)
        power *= speed
        return power

    def load_factor(self, channel: str, unit: str) -> FloatArray:
        """Return (J,): by what a logged value in `unit` is multiplied on its way to the load side; 1 if it is there."""
        quantity = channel.removeprefix("reference_")
        unchanged = np.ones(len(self.joints))
        if quantity not in self.load_units or quantity == "acceleration" or self.coordinates != "motor":
            return unchanged
        # In motor coordinates a log may still contain some channels on the load side.
        if unit != _MOTOR_UNITS[quantity]:
            return unchanged
        ratio = np.array(self.transmission_ratio)
        return 1.0 / ratio if quantity == "torque" else ratio

    def _referred(self, channel: str, series: Series) -> Series:
        quantity = channel.removeprefix("reference_")
        target = self.load_units.get(quantity)
        if target is None or quantity == "acceleration":
            return series
        ratio, offset = np.array(self.transmission_ratio), np.array(self.position_offset)
        values = series.values
        if self.coordinates == "motor" and series.unit == _MOTOR_UNITS[quantity]:
            values = values / ratio if quantity == "torque" else values * ratio
        if quantity == "position" and offset.any():
            values = values + offset
        return series if values is series.values else series.with_values(values, target)

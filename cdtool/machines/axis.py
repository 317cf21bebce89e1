"""One degree of freedom a joint, without coupling: what a linear and a rotary axis share.

Conventions: everything is referred to the load side. With the transmission ratio r = dx/dtheta (load travel per motor
angle) a motor torque tau drives the load with tau / r, and the motor's inertia J_m weighs J_m / r^2 there. The force
balance is (thesis 5.1, 5.2 on the load side, friction and a constant force added)

    m a = F_drive - d v - F_coulomb(v) - F_constant - F_c

with F_c positive when it opposes positive travel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from cdtool.clock import differentiate, integrate
from cdtool.errors import ConfigurationError
from cdtool.recording import Finding, FloatArray, Recording, Series
from cdtool.tables import Table

# A load-side quantity's unit by channel: linear axis, rotary axis.
_MOTOR_UNITS = {"torque": "N m", "speed": "rad/s", "position": "rad"}


@dataclass(frozen=True)
class AxisModel:
    """One joint, load side: inertia [kg, kg m2], viscous [N s/m, N m s/rad], coulomb and constant force [N, N m]."""

    inertia: float
    viscous: float
    coulomb: float
    constant_force: float
    stick_speed: float


@dataclass(frozen=True)
class Axis:
    """Joints that move independently of one another; parameters as in machine.toml, one value a joint.

    `coordinates`: "motor" where logs hold motor torque, angle and speed, "load" where they hold the load's.
    """

    name: str
    joints: tuple[str, ...]
    coordinates: str
    motor_inertia: tuple[float, ...]
    load_inertia: tuple[float, ...]
    transmission_ratio: tuple[float, ...]
    viscous_friction: tuple[float, ...]
    coulomb_friction: tuple[float, ...]
    constant_force: tuple[float, ...]
    stick_speed: tuple[float, ...]

    load_units: ClassVar[Mapping[str, str]]
    default_sides: ClassVar[str] = "one"  # an obstacle on the track opposes the motion
    inertia_key: ClassVar[str]
    ratio_unit: ClassVar[str]

    @classmethod
    def from_table(cls, table: Table) -> Axis:
        """Build from the [machine] table; raises ConfigurationError naming the key."""
        joints = table.texts("joints", (table.text("name", "axis"),))
        if len(set(joints)) != len(joints):
            raise table.fault("joints", "names a joint twice", "joint names must differ")
        count = len(joints)
        coordinates = table.choice("coordinates", ("motor", "load"), "motor")
        if coordinates == "load":
            for key in ("motor_inertia", "transmission_ratio"):
                if key in table:
                    raise table.fault(key, "has no meaning with coordinates = 'load'", "remove the key or coordinates")
            motor = ratio = None
        else:
            motor = table.numbers("motor_inertia", count, 0.0, minimum=0.0)
            ratio = table.numbers("transmission_ratio", count)
            if any(item == 0.0 for item in ratio):
                raise table.fault("transmission_ratio", "is 0", f"load travel per motor angle [{cls.ratio_unit}]")
        return cls(
            name=table.text("name", "axis"),
            joints=joints,
            coordinates=coordinates,
            motor_inertia=motor or (0.0,) * count,
            load_inertia=table.numbers(cls.inertia_key, count, 0.0, minimum=0.0),
            transmission_ratio=ratio or (1.0,) * count,
            viscous_friction=table.numbers("viscous_friction", count, 0.0, minimum=0.0),
            coulomb_friction=table.numbers("coulomb_friction", count, 0.0, minimum=0.0),
            constant_force=table.numbers("constant_force", count, 0.0),
            stick_speed=table.numbers("stick_speed", count, 1e-3, above=0.0),
        )

    @property
    def axes(self) -> tuple[AxisModel, ...]:
        """The load-side model of each joint."""
        models = []
        for j in range(len(self.joints)):
            r = self.transmission_ratio[j]
            models.append(
                AxisModel(
                    inertia=self.load_inertia[j] + self.motor_inertia[j] / r**2,
                    viscous=self.viscous_friction[j] / r**2,
                    coulomb=self.coulomb_friction[j] / abs(r),
                    constant_force=self.constant_force[j] / r,
                    stick_speed=self.stick_speed[j],
                )
            )
        return tuple(models)

    @property
    def force_unit(self) -> str:
        """Unit of a contact force or torque on the load side."""
        return self.load_units["torque"]

    @property
    def speed_unit(self) -> str:
        """Unit of the load's speed."""
        return self.load_units["speed"]

    def require_inertia(self, who: str) -> None:
        """Raise ConfigurationError, naming the key, where a joint's inertia is not given and `who` needs it."""
        for joint, axis in zip(self.joints, self.axes, strict=True):
            if axis.inertia <= 0.0:
                raise ConfigurationError(
                    f"machine '{self.name}': {who} needs the inertia of joint '{joint}'",
                    f"give machine.{self.inertia_key} (and motor_inertia), or use a detector without a model",
                )

    def accepted_units(self, channel: str) -> tuple[str, ...]:
        """SI units in which a log may hold a channel; the first is what a scaled raw value becomes."""
        quantity = channel.removeprefix("reference_")
        if channel in ("force",):
            return ("N",)
        if channel in ("label", "trigger"):
            return ("1",)
        load = self.load_units[quantity]
        if quantity == "acceleration" or self.coordinates == "load":
            return (load,)
        motor = _MOTOR_UNITS[quantity]
        return (motor,) if motor == load else (motor, load)

    def referred_to_load(self, recording: Recording, speed_low_pass: float = 50.0) -> Recording:
        """A recording as logged -> the same with every channel on the load side (apply it once).

        A missing speed or position is derived causally from the other, and a finding says so.
        """
        channels = {name: self._referred(name, series) for name, series in recording.channels.items()}
        findings = list(recording.findings)
        if "speed" not in channels and "position" in channels:
            channels["speed"] = differentiate(channels["position"], speed_low_pass, self.speed_unit)
            text = (
                f"not in the log: derived causally from position (two first-order low-passes at {speed_low_pass:g} Hz)"
            )
            findings.append(Finding(text, "speed", "note"))
        if "position" not in channels and "speed" in channels:
            channels["position"] = integrate(channels["speed"], self.load_units["position"])
            findings.append(Finding("not in the log: the speed, integrated from 0", "position", "note"))
        return replace(recording, channels=channels, findings=tuple(findings))

    def drive_force_minus_known(self, torque: FloatArray, speed: FloatArray, friction_speed: FloatArray) -> FloatArray:
        """(n, J): drive force less friction and constant force [N or N m]: what is left to accelerate or to collide.

        Viscous friction acts on `friction_speed`; below the stick speed Coulomb friction balances the drive force as
        far as it reaches, so that a resting machine under static torque leaves no residual.
        """
        net = np.empty_like(torque)
        for j, axis in enumerate(self.axes):
            force = net[:, j]
            # In place: on long logs the time goes into fresh memory, not into arithmetic.
            np.multiply(friction_speed[:, j], -axis.viscous, out=force)
            force += torque[:, j]
            if axis.constant_force:
                force -= axis.constant_force
            if axis.coulomb:
                sliding = axis.coulomb * np.sign(speed[:, j])
                sticking = np.clip(force, -axis.coulomb, axis.coulomb)
                force -= np.where(np.abs(speed[:, j]) > axis.stick_speed, sliding, sticking)
        return net

    def _referred(self, channel: str, series: Series) -> Series:
        quantity = channel.removeprefix("reference_")
        target = self.load_units.get(quantity)
        if target is None or self.coordinates == "load" or quantity == "acceleration":
            return series
        motor = _MOTOR_UNITS[quantity]
        if series.unit != motor:  # the log holds this one on the load side already
            return series
        ratio = np.array(self.transmission_ratio)
        values = series.values / ratio if quantity == "torque" else series.values * ratio
        return Series(series.time, values, target)

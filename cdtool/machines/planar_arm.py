"""A planar arm of two links, both motors on the base: they set the links' absolute angles (thesis chapter 6)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError, nearest
from cdtool.base.findings import Finding
from cdtool.base.settings import NotNegative, Place, Positive, setting
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.dynamics import JointEquation, Pendulum
from cdtool.machines.joint_machine import JointTable, PerJoint, PerJointNotNegative, per_joint
from cdtool.recordings.clock import previous_value
from cdtool.recordings.recording import Recording, Series


@dataclass(frozen=True, kw_only=True)
class PlanarArmTable(JointTable):
    """The keys of a planar arm."""

    link_mass: Annotated[tuple[Positive, ...], setting("of arm and forearm, each with what is fixed to it", unit="kg")]
    link_length: Annotated[Positive, setting("of the first link: shoulder to elbow", unit="m")]
    centre_of_mass: Annotated[PerJoint, setting("distance from the link's joint, along the link", unit="m")]
    link_inertia: Annotated[PerJointNotNegative, setting("about the centre of mass", unit="kg m2")] = (0.0,)
    imu_position: Annotated[
        PerJointNotNegative, setting("distance of the inertial sensor from the link's joint", unit="m")
    ] = (0.0,)
    gravity: Annotated[NotNegative, setting("0: the arm moves in a horizontal plane", unit="m/s2")] = 9.81


@dataclass(frozen=True)
class PlanarArm(CoupledMachine):
    """Two links with both motors on the base: arm and forearm, with IMUs on the links (thesis chapter 6).

    Absolute link angles q1, q2 [rad], anticlockwise from the horizontal (6.21-6.25, motors' inertias added):

    T1 = M11 a1 + h cos(q2 - q1) a2 - h sin(q2 - q1) v2^2 + g1 cos q1
    T2 = h cos(q2 - q1) a1 + M22 a2 + h sin(q2 - q1) v1^2 + g2 cos q2

    with M11 = J1 + m1 lG1^2 + m2 l1^2 + Ja1/n1^2, M22 = J2 + m2 lG2^2 + Ja2/n2^2, h = m2 l1 lG2, g1 = (m2 l1 + m1 lG1)
    g, g2 = m2 lG2 g and T_i = tau_mi / n_i. An inertial sensor on link i at `imu_position` measures the specific force
    across the link: it becomes the link's angular acceleration after subtracting gravity and the elbow's acceleration.
    """

    link_mass: tuple[float, ...]
    link_length: float
    centre_of_mass: tuple[float, ...]
    link_inertia: tuple[float, ...]
    imu_position: tuple[float, ...]
    gravity_acceleration: float

    table: ClassVar[type[JointTable]] = PlanarArmTable
    joints_by_default: ClassVar[tuple[str, ...]] = ("arm", "forearm")
    link_names: ClassVar[tuple[str, ...]] = joints_by_default

    @classmethod
    def parameters(cls, table: PlanarArmTable, place: Place) -> dict[str, Any]:
        """Return the parameters of the arm; raises ConfigurationError naming the key."""
        if len(table.joints) not in (0, 2):
            place.note("joints", f"names {len(table.joints)} joints", "a planar arm has 2: arm and forearm")
            table = replace(table, joints=())
        found = super().parameters(table, place)
        found |= {
            key: per_joint(table, key, 2, place)
            for key in ("link_mass", "centre_of_mass", "link_inertia", "imu_position")
        }
        found |= {"link_length": table.link_length, "gravity_acceleration": table.gravity}
        if not cls(**found).nominal_inertia[1] > 0.0:
            problem = f"joint '{found['joints'][1]}' moves no inertia"
            raise place.fault("link_inertia", problem, "give it, its centre_of_mass, or motor_inertia")
        return found

    @property
    def nominal_inertia(self) -> FloatArray:
        """(2,): M11 and M22 [kg m2], the same in every pose."""
        (m1, m2), (g1, g2), length = self.link_mass, self.centre_of_mass, self.link_length
        links = np.array([m1 * g1**2 + m2 * length**2, m2 * g2**2]) + np.array(self.link_inertia)
        inertia: FloatArray = links + self.reflected_inertia
        return inertia

    @property
    def coupling(self) -> float:
        """h = m2 l1 lG2 [kg m2]."""
        return self.link_mass[1] * self.link_length * self.centre_of_mass[1]

    @property
    def gravity_torque(self) -> FloatArray:
        """(2,): g1 and g2, the torques that hold the links horizontal [N m]."""
        (m1, m2), (g1, g2) = self.link_mass, self.centre_of_mass
        return np.array([m2 * self.link_length + m1 * g1, m2 * g2]) * self.gravity_acceleration

    def momentum_terms(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """p = M v, C'v = (h s v1 v2, -h s v1 v2) with s = sin(q2 - q1), and g cos q, each (n, 2)."""
        turn = self.coupling * np.sin(position[:, 1] - position[:, 0]) * speed[:, 0] * speed[:, 1]
        momentum = self.inertia_times(position, speed)
        return momentum, np.column_stack((turn, -turn)), self.gravity_torque * np.cos(position)

    def inverse_dynamics(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """M a + (-h s v2^2, h s v1^2) + g cos q (n, 2), thesis 6.23 and 6.24."""
        sine = self.coupling * np.sin(position[:, 1] - position[:, 0])
        torque = self.inertia_times(position, acceleration) + self.gravity_torque * np.cos(position)
        torque[:, 0] -= sine * speed[:, 1] ** 2
        torque[:, 1] += sine * speed[:, 0] ** 2
        return torque

    def inertia_times(self, position: FloatArray, vector: FloatArray) -> FloatArray:
        """M x (n, 2)."""
        cross = self.coupling * np.cos(position[:, 1] - position[:, 0])
        product: FloatArray = self.nominal_inertia * vector + cross[:, np.newaxis] * vector[:, ::-1]
        return product

    def inertia_matrix(self, position: FloatArray) -> FloatArray:
        """M (n, 2, 2)."""
        matrix = np.empty((len(position), 2, 2))
        matrix[:, 0, 1] = matrix[:, 1, 0] = self.coupling * np.cos(position[:, 1] - position[:, 0])
        matrix[:, [0, 1], [0, 1]] = self.nominal_inertia
        return matrix

    def energies(self, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """v'M v / 2 and g1 sin q1 + g2 sin q2, each (n,) [J]."""
        kinetic = 0.5 * np.sum(speed * self.inertia_times(position, speed), axis=1)
        return kinetic, np.sin(position) @ self.gravity_torque

    def contact_jacobian(self, position: FloatArray, link: str, point: tuple[float, float, float]) -> FloatArray:
        """J_c (n, 6, 2) of a point of a link (x along it, z across it, from its joint [m]); base axes x, y, z up.

        Raises ConfigurationError for an unknown link.
        """
        if link not in self.joints:
            raise ConfigurationError(f"machine '{self.name}': unknown link '{link}'", nearest(link, self.joints))
        jacobian = np.zeros((len(position), 6, 2))
        own = self.joints.index(link)
        along, across = point[0], point[2]
        q = position[:, own]
        jacobian[:, 0, own] = -along * np.sin(q) - across * np.cos(q)
        jacobian[:, 2, own] = along * np.cos(q) - across * np.sin(q)
        jacobian[:, 4, own] = -1.0  # anticlockwise seen with x to the right and z up is a turn about -y
        if own == 1:
            jacobian[:, 0, 0] = -self.link_length * np.sin(position[:, 0])
            jacobian[:, 2, 0] = self.link_length * np.cos(position[:, 0])
        return jacobian

    def joint_equations(
        self, torque: FloatArray, position: FloatArray, speed: FloatArray, acceleration: FloatArray
    ) -> list[JointEquation]:
        """Return one equation per link (thesis 6.33, 6.37); the terms of its own angle are left to the filter."""
        force = self.minus_friction(torque.copy(), speed, np.zeros_like(speed))
        equations = []
        for own, other in ((0, 1), (1, 0)):
            columns = (np.ascontiguousarray(array[:, other]) for array in (position, speed, acceleration))
            link = Pendulum(float(self.gravity_torque[own]), self.coupling, *columns)
            viscous = self.viscous_friction[own] / self.transmission_ratio[own] ** 2
            inertia = self.nominal_inertia[own : own + 1]
            equations.append(JointEquation(inertia, np.ascontiguousarray(force[:, own]), viscous, link))
        return equations

    def accepted_units(self, channel: str) -> tuple[str, ...]:
        """Return the units; an acceleration may be that of the sensors [m/s2] or of the links [rad/s2]."""
        units = super().accepted_units(channel)
        return ("m/s2", *units) if channel == "acceleration" else units

    def referred_to_load(self, recording: Recording, speed_low_pass: float = 50.0) -> Recording:
        """Return every channel on the load side; specific forces become angular accelerations of the links.

        Raises RecordingError if a position or speed needed for that is not in the log.
        """
        referred = super().referred_to_load(recording, speed_low_pass)
        if "acceleration" not in referred or referred["acceleration"].unit == "rad/s2":
            return referred
        for needed in ("position", "speed"):
            if needed not in referred:
                raise RecordingError(
                    f"{recording.name}: the links' accelerations need the channel '{needed}'",
                    f"map {needed} in [channels], or give accelerations in rad/s2",
                    channel=needed,
                )
        if not all(self.imu_position):
            raise ConfigurationError(
                f"machine '{self.name}': imu_position is missing for accelerations in m/s2",
                "give the sensors' distances from their joints [m], or accelerations in rad/s2",
            )
        channels = {**referred.channels, "acceleration": self.link_acceleration(referred)}
        findings = (*referred.findings, Finding("link_accelerations", "acceleration"))
        return replace(referred, channels=channels, findings=findings)

    def link_acceleration(self, recording: Recording) -> Series:
        """The links' angular accelerations (n, 2) [rad/s2] from their sensors' specific forces z [m/s2].

        a1 = (z1 - g cos q1) / d1; a2 = (z2 - g cos q2 - l1 (a1 cos(q2 - q1) + v1^2 sin(q2 - q1))) / d2 (thesis 6.7,
        6.26 corrected: the second sensor feels the elbow's acceleration too). Angles and speeds are the last ones
        measured.
        """
        sensed = recording["acceleration"]
        position = previous_value(recording["position"], sensed.time)
        speed = previous_value(recording["speed"], sensed.time)
        free = sensed.values - self.gravity_acceleration * np.cos(position)
        first = free[:, 0] / self.imu_position[0]
        between = position[:, 1] - position[:, 0]
        elbow = self.link_length * (first * np.cos(between) + speed[:, 0] ** 2 * np.sin(between))
        second = (free[:, 1] - elbow) / self.imu_position[1]
        return Series(sensed.time, np.column_stack((first, second)), "rad/s2")

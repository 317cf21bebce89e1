"""The planar arm against Lagrange's equations, its sensors, its contacts, and what its machine file may not say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.machines import ARM, arm_of
from tests.synthetic.motions import moving_recording

RNG = np.random.default_rng(6)
POSITION, SPEED, ACCELERATION = RNG.uniform(-3.0, 3.0, (3, 200, 2))
ELBOW = 0.30


def kinetic_and_potential(arm: PlanarArm, position: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Each (n,) [J], from the centres of mass and the motors: nothing of the arm's own methods."""
    angles, rates = position.T, speed.T
    velocity = [0.0, 0.0]
    kinetic = potential = np.zeros(len(position))
    height = np.zeros(len(position))
    for i in range(2):
        reach = arm.centre_of_mass[i]
        across = velocity[0] - reach * np.sin(angles[i]) * rates[i], velocity[1] + reach * np.cos(angles[i]) * rates[i]
        motor = arm.motor_inertia[i] / arm.transmission_ratio[i] ** 2
        kinetic = kinetic + 0.5 * arm.link_mass[i] * (across[0] ** 2 + across[1] ** 2)
        kinetic = kinetic + 0.5 * (arm.link_inertia[i] + motor) * rates[i] ** 2
        potential = potential + arm.link_mass[i] * 9.81 * (height + reach * np.sin(angles[i]))
        velocity = [-ELBOW * np.sin(angles[0]) * rates[0], ELBOW * np.cos(angles[0]) * rates[0]]
        height = ELBOW * np.sin(angles[0])
    return kinetic, potential


def slope(function, at: FloatArray, step: float = 1e-4) -> FloatArray:
    """(..., 2): derivative by each joint's value, fourth order."""
    columns = []
    for j in range(2):
        move = step * np.eye(2)[j]
        near = function(at + move) - function(at - move)
        far = function(at + 2.0 * move) - function(at - 2.0 * move)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


def test_energies_are_those_of_two_rigid_bodies_and_two_motors(arm):
    for found, wanted in zip(arm.energies(POSITION, SPEED), kinetic_and_potential(arm, POSITION, SPEED), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


def test_6_21_and_6_22_are_lagranges_equations_of_these_energies(arm):
    """d/dt dT/dv - dT/dq + dU/dq, T = v'M v / 2: M from T, the rest by numerical derivatives."""

    def momentum(position: FloatArray, speed: FloatArray) -> FloatArray:
        # T is a quadratic form of v, so that a central difference of any step is exact.
        return slope(lambda v: kinetic_and_potential(arm, position, v)[0], speed, 0.5)

    carried = np.einsum("nij,nj->ni", slope(lambda q: momentum(q, SPEED), POSITION), SPEED)
    kinetic = slope(lambda q: kinetic_and_potential(arm, q, SPEED)[0], POSITION)
    potential = slope(lambda q: kinetic_and_potential(arm, q, SPEED)[1], POSITION)
    wanted = momentum(POSITION, ACCELERATION) + carried - kinetic + potential
    np.testing.assert_allclose(arm.inverse_dynamics(POSITION, SPEED, ACCELERATION), wanted, atol=1e-9)


def sensed(arm: PlanarArm, elbow: bool = True) -> tuple[Recording, FloatArray]:
    """A log whose sensors feel what two accelerometers at imu_position would, and the links' true accelerations.

    The sensors' places are differentiated twice; without `elbow` the second one is taken as if its joint stood still.
    """
    log = moving_recording(arm, seconds=3.0, seed=4)
    position, speed, acceleration = (log[name].values for name in ("position", "speed", "acceleration"))

    def place(link: int, t: float) -> FloatArray:
        angle = position + t * speed + 0.5 * t**2 * acceleration
        own = arm.imu_position[link] * np.array([np.cos(angle[:, link]), np.sin(angle[:, link])])
        joint = ELBOW * np.array([np.cos(angle[:, 0]), np.sin(angle[:, 0])])
        return own + joint if link and elbow else own

    step = 2e-3
    felt = []
    for link in range(2):
        near = place(link, step) - 2.0 * place(link, 0.0) + place(link, -step)
        far = place(link, 2.0 * step) - 2.0 * place(link, 0.0) + place(link, -2.0 * step)
        moved = (16.0 * near - far) / (12.0 * step**2) + np.array([[0.0], [9.81]])
        across = np.array([-np.sin(position[:, link]), np.cos(position[:, link])])
        felt.append(np.sum(across * moved, axis=0))
    series = Series(log["speed"].time, np.column_stack(felt), "m/s2")
    return replace(log, channels={**log.channels, "acceleration": series}), acceleration


def test_the_sensors_specific_forces_become_the_links_angular_accelerations(arm):
    log, true = sensed(arm)
    found = arm.link_acceleration(log)
    assert found.unit == "rad/s2"
    np.testing.assert_allclose(found.values, true, atol=1e-9)


@pytest.mark.parametrize(("lost", "named"), [(("position",), "position"), (("speed", "position"), "position")])
def test_sensors_without_a_pose_are_refused_for_gravity_would_be_unknown(arm, lost, named):
    log, _ = sensed(arm)
    left = {name: series for name, series in log.channels.items() if name not in lost}
    with pytest.raises(RecordingError, match=f"the links' accelerations need the channel '{named}'"):
        arm.referred_to_load(replace(log, channels=left))


def test_sensors_whose_place_is_not_given_are_refused():
    arm = arm_of({key: value for key, value in ARM.items() if key != "imu_position"})
    log, _ = sensed(arm_of(ARM))
    with pytest.raises(ConfigurationError, match="imu_position is missing") as caught:
        arm.referred_to_load(log)
    assert "rad/s2" in caught.value.hint


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("joints", ["arm"], "machine.joints: names 1 joints"),
        ("joints", ["a", "b", "c"], "machine.joints: names 3 joints"),
        ("link_mass", [1.3, -1.6], r"machine.link_mass\[2\]: is -1.6"),
        ("link_mass", 0.0, "machine.link_mass: is 0 "),
        ("link_mass", None, "machine.link_mass: is missing"),
        ("link_length", -0.3, "machine.link_length: is -0.3"),
        ("link_inertia", [0.01, -0.01], r"machine.link_inertia\[2\]: is -0.01"),
        ("imu_position", [0.2, -0.2], r"machine.imu_position\[2\]: is -0.2"),
        ("centre_of_mass", [0.1, 0.1, 0.1], "machine.centre_of_mass: has 3 values"),
        ("gravity", [0.0, 0.0, -9.81], r"machine.gravity: is \[0, 0, -9.81\]"),
        ("gravity", -9.81, "machine.gravity: is -9.81"),
    ],
)
def test_parameters_that_cannot_be_are_refused_by_name(key, value, message):
    values = {name: item for name, item in {**ARM, key: value}.items() if item is not None}
    with pytest.raises(ConfigurationError, match=message):
        arm_of(values)


POINTS = [("arm", (0.28, 0.0, 0.0)), ("forearm", (0.2, 0.0, 0.05))]


def place_of(link: str, point: tuple[float, float, float], position: FloatArray) -> FloatArray:
    """(n, 2): x and height of a point of a link."""
    own = position[:, ("arm", "forearm").index(link)]
    along, across = point[0], point[2]
    here = np.column_stack((along * np.cos(own) - across * np.sin(own), along * np.sin(own) + across * np.cos(own)))
    elbow = ELBOW * np.column_stack((np.cos(position[:, 0]), np.sin(position[:, 0])))
    return here + elbow if link == "forearm" else here


@pytest.mark.parametrize(("link", "point"), POINTS)
def test_the_contact_jacobian_gives_the_velocity_of_its_point(arm, link, point):
    jacobian = arm.contact_jacobian(POSITION, link, point)
    velocity = np.einsum("nij,nj->ni", jacobian, SPEED)
    moved = np.einsum("nij,nj->ni", slope(lambda q: place_of(link, point, q), POSITION), SPEED)
    np.testing.assert_allclose(velocity[:, [0, 2]], moved, atol=1e-9)
    assert not velocity[:, 1].any()
    turning = SPEED[:, ("arm", "forearm").index(link)]
    np.testing.assert_allclose(velocity[:, 3:], np.outer(turning, [0.0, -1.0, 0.0]), atol=1e-12)


def test_a_planar_force_on_the_forearm_is_recovered_from_the_residual_of_both_joints(arm):
    link, point = POINTS[1]
    # Away from the stretched arm, where the two joints move the point the same way.
    bent = np.column_stack((POSITION[:, 0], POSITION[:, 0] + 1.4))
    force = np.zeros((200, 6))
    force[:, [0, 2]] = RNG.normal(size=(200, 2)) * 30.0
    residual = arm.contact_torque(bent, force, link, point)
    np.testing.assert_allclose(arm.contact_force(bent, residual, link, point), force[:, :3], atol=1e-9)


def test_a_forearm_without_inertia_is_refused():
    values = ARM | {"centre_of_mass": [0.1, 0.0], "link_inertia": 0.0, "motor_inertia": 0.0}
    with pytest.raises(ConfigurationError, match=r"machine.link_inertia: joint 'forearm' moves no inertia"):
        arm_of(values)

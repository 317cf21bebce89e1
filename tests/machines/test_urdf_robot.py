"""A robot from its machine file: names, drives, units, gravity, home; and what the file may not say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.detectors.momentum import Momentum
from cdtool.formats.machine_file import fingerprint, read_machine_file
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.motions import moving_recording
from tests.synthetic.robots import JOINTS, six_joint_robot, six_joint_urdf, urdf_robot

pytest.importorskip("pinocchio")

POSE = np.array([[0.3, -0.5, 1.2, 0.1, 0.7, -1.0], [0.0, 0.4, -0.8, -0.2, 2.0, 0.5]])
SLIDES = ("prismatic",) * 6
TURNS = ("revolute",) * 6


def refused(folder: Path, **keys: Any) -> ConfigurationError:
    """What the machine file's reader says to these keys of [machine]; a None takes a key away."""
    values = {"joints": list(JOINTS), **keys}
    with pytest.raises(ConfigurationError) as caught:
        urdf_robot(folder, six_joint_urdf(), {name: value for name, value in values.items() if value is not None})
    assert "\n" not in str(caught.value)
    return caught.value


def test_joint_map_gives_the_urdfs_names_of_the_logs_joints(tmp_path):
    names = ["axis 1", "lift", "axis 3", "reach", "wrist", "tool"]
    mapped = {"joints": names, "joint_map": {"axis 1": "pan", "axis 3": "elbow"}}
    robot, plain = urdf_robot(tmp_path, six_joint_urdf(), mapped), six_joint_robot(tmp_path, drive_inertia=0.0)
    assert robot.joints == tuple(names)
    np.testing.assert_array_equal(robot.gravity(POSE), plain.gravity(POSE))


def test_a_locked_joint_is_gone_and_stands_where_it_is_locked(tmp_path):
    whole = six_joint_robot(tmp_path)
    left = [name for name in JOINTS if name != "elbow"]
    robot = six_joint_robot(tmp_path, left, locked={"elbow": 1.2})
    kept = [i for i, name in enumerate(JOINTS) if name != "elbow"]
    np.testing.assert_allclose(robot.gravity(POSE[:1, kept]), whole.gravity(POSE[:1])[:, kept], atol=1e-12)
    matrix = whole.inertia_matrix(POSE[:1])[:, kept][:, :, kept]
    np.testing.assert_allclose(robot.inertia_matrix(POSE[:1, kept]), matrix, rtol=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("joints", ["pan", "pan"], "machine.joints: names a joint twice"),
        ("drive_inertia", [0.1] * 5, "machine.drive_inertia: has 5 values"),
        ("drive_inertia", -0.1, "machine.drive_inertia: is -0.1"),
        ("home", [0.0] * 7, "machine.home: has 7 values"),
        ("gravity", [0.0, 9.81], "machine.gravity: has 2 values"),
        ("gravity", -9.81, "machine.gravity: is -9.81"),
        ("locked", {"pan": "up"}, "machine.locked.pan: is 'up'"),
        ("transmission_ratio", 0.01, "machine.transmission_ratio: has no meaning with coordinates = 'load'"),
        ("urdf", "other.urdf", "other.urdf: no such file"),
        ("urdf", 3, "machine.urdf: is 3"),
    ],
)
def test_values_that_cannot_be_are_refused_by_name(tmp_path, key, value, message):
    assert message in refused(tmp_path, **{key: value}).message


def test_a_machine_file_may_describe_a_robot_whose_meshes_are_absent(tmp_path):
    (tmp_path / "six.urdf").write_text(six_joint_urdf(), encoding="utf-8")
    names = ", ".join(f'"{name}"' for name in JOINTS)
    text = f"""
    [machine]
    type = "urdf_robot"
    urdf = "six.urdf"
    joints = [{names}]
    drive_inertia = 0.3
    """
    (tmp_path / "machine.toml").write_text(text.replace("\n    ", "\n"), encoding="utf-8")
    robot = read_machine_file(tmp_path / "machine.toml").machine
    assert robot.joints == JOINTS
    assert robot.coordinates == "load"
    assert fingerprint(robot) == fingerprint(read_machine_file(tmp_path / "machine.toml").machine)
    heavier = (tmp_path / "six.urdf").read_text(encoding="utf-8").replace('value="6.0"', 'value="6.5"')
    (tmp_path / "six.urdf").write_text(heavier, encoding="utf-8")
    assert fingerprint(robot) != fingerprint(read_machine_file(tmp_path / "machine.toml").machine)


def test_motors_weigh_their_inertia_by_the_ratio_squared_beside_the_drive_inertia(tmp_path):
    ratio = [0.01, -0.01, 0.02, 0.004, 0.01, 0.02]
    by_motor = six_joint_robot(
        tmp_path, coordinates="motor", transmission_ratio=ratio, motor_inertia=2e-5, drive_inertia=0.1
    )
    wanted = 0.1 + 2e-5 / np.array(ratio) ** 2
    by_joint = six_joint_robot(tmp_path, drive_inertia=wanted.tolist())
    np.testing.assert_allclose(by_motor.inertia_matrix(POSE), by_joint.inertia_matrix(POSE), rtol=1e-12)
    without = six_joint_robot(tmp_path, drive_inertia=0.0)
    np.testing.assert_allclose(by_motor.nominal_inertia - without.nominal_inertia, wanted, rtol=1e-9)


def test_a_log_of_the_motors_gives_the_residual_of_the_joints(tmp_path):
    ratio = np.array([0.01, -0.01, 0.02, 0.004, 0.01, 0.02])
    offset = np.array([0.1, -0.2, 0.3, 0.05, 0.0, -0.4])
    keys = {"viscous_friction": 0.0, "coulomb_friction": 0.0, "coulomb_slope": 0.0}
    motors = six_joint_robot(
        tmp_path,
        coordinates="motor",
        transmission_ratio=ratio.tolist(),
        position_offset=offset.tolist(),
        **keys,
    )
    plain = six_joint_robot(tmp_path, **keys)
    at_joints = moving_recording(plain, seconds=2.0, contact=np.arange(1.0, 7.0), contact_at=1.5)
    channels = {}
    for name, unit in (("torque", "N m"), ("speed", "rad/s"), ("position", "rad")):
        series = at_joints[name]
        values = {"torque": series.values * ratio, "speed": series.values / ratio}.get(name)
        channels[name] = Series(series.time, (series.values - offset) / ratio if values is None else values, unit)
    logged = motors.referred_to_load(Recording("motors", "made up", JOINTS, channels))
    assert logged["position"].unit == logged["torque"].unit == "SI"
    found, expected = Momentum(30.0).signal(logged, motors).values, Momentum(30.0).signal(at_joints, plain).values
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(expected[-1]).max() > 5.0


def test_the_position_offset_turns_the_logs_zero_into_the_urdfs(tmp_path):
    robot = six_joint_robot(tmp_path, position_offset=[0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    log = moving_recording(robot, seconds=1.0)
    referred = robot.referred_to_load(log)
    for channel in ("position", "reference_position"):
        moved = referred[channel].values - log[channel].values
        np.testing.assert_allclose(moved, np.broadcast_to([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], moved.shape), rtol=1e-12)
    np.testing.assert_array_equal(referred["speed"].values, log["speed"].values)


def test_a_gravity_vector_serves_a_base_that_is_mounted_on_a_wall(tmp_path):
    """The base turned by 90 degrees about y: the same robot upright, its first joint's frame turned the other way."""
    wall = six_joint_robot(tmp_path, gravity=[9.81, 0.0, 0.0])
    turned = six_joint_urdf().replace(
        'xyz="0.1 0.0 0.3" rpy="0.0 0.2 0.3"', f'xyz="0.3 0.0 -0.1" rpy="{_turned_by_90_degrees(0.0, 0.2, 0.3)}"'
    )
    assert turned != six_joint_urdf()
    keys = {"joints": list(JOINTS), "drive_inertia": 0.3}
    upright = urdf_robot(tmp_path, turned, keys)
    np.testing.assert_allclose(wall.gravity(POSE), upright.gravity(POSE), atol=1e-9)
    np.testing.assert_allclose(wall.inertia_matrix(POSE), upright.inertia_matrix(POSE), rtol=1e-9, atol=1e-12)
    assert np.abs(wall.gravity(POSE) - six_joint_robot(tmp_path).gravity(POSE)).max() > 10.0


def _turned_by_90_degrees(*rpy: float) -> str:
    """Roll, pitch and yaw of a frame after a further turn of +90 degrees about the base's y axis."""
    import pinocchio

    about_y = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return " ".join(f"{x:.17g}" for x in pinocchio.rpy.matrixToRpy(about_y @ pinocchio.rpy.rpyToMatrix(*rpy)))


@pytest.mark.parametrize(
    ("kinds", "units"),
    [
        (SLIDES, {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2"}),
        (TURNS, {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}),
        (None, {"torque": "SI", "speed": "SI", "position": "SI", "acceleration": "SI"}),
    ],
)
def test_units_are_those_of_its_joints_and_si_where_both_kinds_occur(tmp_path, kinds, units):
    text = six_joint_urdf(kinds) if kinds else six_joint_urdf()
    robot = urdf_robot(tmp_path, text, {"joints": list(JOINTS)})
    assert robot.load_units == units
    assert robot.force_unit == units["torque"]
    assert robot.accepted_units("position") == (units["position"],)
    assert robot.accepted_units("force") == ("N",)


def test_a_force_at_a_known_point_of_the_last_link_is_recovered_from_the_residual(tmp_path):
    robot = six_joint_robot(tmp_path)
    force = np.zeros((2, 6))
    force[:, :3] = [[30.0, -20.0, 10.0], [-5.0, 0.0, 40.0]]
    residual = robot.contact_torque(POSE, force, "link6", (0.05, 0.0, 0.1))
    np.testing.assert_allclose(robot.contact_force(POSE, residual, "link6", (0.05, 0.0, 0.1)), force[:, :3], atol=1e-9)

"""A contact of a point of a link: the simulated arm's own contacts, and closed forms on a robot of six joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, DriveBeyond
from cdtool.commands.inject.injected_contact import Doubt, InjectedContact
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.commands.inject.robot_contact import RobotLog, StruckPoint, robot_contact
from cdtool.commands.simulate.arm_model import Impact, simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial
from cdtool.machines.axis_model.axis_run import axis_run
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.robot_model.parameters import RobotModel, robot_model
from cdtool.machines.urdf_robot import UrdfRobot
from cdtool.recordings.recording import Recording, Series
from tests.data_folder import UR10E_LOGS
from tests.machines.robot_model.arm_as_model import arm_as_model, arm_obstacle, arm_point
from tests.machines.robot_model.test_chain import planar_arm
from tests.synthetic.arm_as_recording import as_recording
from tests.synthetic.robot_motion import robot_recording
from tests.synthetic.robots import six_joint_robot

ARM = ArmParameters()
QUIET = replace(
    ARM,
    torque_ripple=0.0,
    disturbance_torque=0.0,
    friction_scatter=0.0,
    torque_noise=0.0,
    vibration_acceleration=0.0,
    imu_noise=0.0,
    imu_resolution=0.0,
    encoder_counts=2_000_000_000,
)
MACHINE: PlanarArm = planar_arm(motor_inertia=1.5e-5, transmission_ratio=1 / 60)
FROZEN = Assumption(ControllerReaction.FROZEN)
STIFF = Assumption(ControllerReaction.STIFF)
TRAVEL = np.array([0.8, 0.5, -0.4, 0.2, 0.6, -0.5])
POINT = StruckPoint("link6", (0.0, 0.0, 0.1))


def arm_log(recording: Recording) -> RobotLog:
    loaded = MACHINE.referred_to_load(recording)
    return RobotLog(tuple(axis_run(loaded, joint) for joint in (0, 1)), recording["acceleration"].unit)


def arm_twins(arm: ArmParameters, trial: Trial, kind: Impact, seed: int) -> tuple[Recording, Recording, float]:
    """Return the run with the injected contact, its true twin, and the time of the contact [s]."""
    hit = simulate_arm_run(arm, np.random.default_rng(seed), trial, kind)
    free = as_recording(simulate_arm_run(arm, np.random.default_rng(seed), trial, "none"), "free")
    assert hit.contact_start is not None
    model, point = arm_as_model(MACHINE, arm), arm_point(arm, trial)
    contact = robot_contact(arm_log(free), model, point, arm_obstacle(arm, kind), hit.contact_start, 0.5)
    injected = injected_recording(free, MACHINE, contact.changes, contact.force, (0, 1))
    return injected, as_recording(hit, "hit"), hit.contact_start


def worst(injected: Recording, true: Recording, free: Recording, channel: str, start: float) -> FloatArray:
    """Return the largest error of the contact's effect within 0.15 s, as a share of the largest effect."""
    count = min(len(injected[channel]), len(true[channel]))
    time = true[channel].time[:count]
    within = (time > start) & (time < start + 0.15)
    found, expected, before = (item[channel].values[:count][within] for item in (injected, true, free))
    return np.asarray(np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected - before)))


@pytest.mark.parametrize("trial", [1, 2])
@pytest.mark.parametrize("kind", ["stiff", "soft"])
def test_without_noise_every_channel_changes_exactly_as_in_the_true_contact(trial: Trial, kind: Impact) -> None:
    injected, true, start = arm_twins(QUIET, trial, kind, 5)
    free = as_recording(simulate_arm_run(QUIET, np.random.default_rng(5), trial, "none"), "free")
    for channel in ("torque", "speed", "position", "acceleration"):
        assert np.max(worst(injected, true, free, channel, start)) < 0.01, channel


@pytest.mark.parametrize(("trial", "kind", "share"), [(1, "stiff", 0.25), (2, "stiff", 0.25), (1, "soft", 0.4)])
def test_with_noise_the_struck_joint_changes_as_in_the_true_contact(trial: Trial, kind: Impact, share: float) -> None:
    injected, true, start = arm_twins(ARM, trial, kind, 7)
    free = as_recording(simulate_arm_run(ARM, np.random.default_rng(7), trial, "none"), "free")
    for channel in ("torque", "speed"):
        assert worst(injected, true, free, channel, start)[trial - 1] < share, channel


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> UrdfRobot:
    return six_joint_robot(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def recording(robot: UrdfRobot) -> Recording:
    return robot_recording(robot, TRAVEL)


def log_of(recording: Recording) -> RobotLog:
    return RobotLog(tuple(axis_run(recording, joint) for joint in range(6)))


def struck(
    recording: Recording, model: RobotModel, assumption: Assumption, stiffness: float = 1e4, point: StruckPoint = POINT
) -> InjectedContact:
    return robot_contact(log_of(recording), model, point, Obstacle.spring(stiffness), 1.4, 0.3, assumption)


def at(contact: InjectedContact, channel: str, after: float) -> FloatArray:
    return contact.changes[channel].at(np.array([contact.start + after]))[0]


def motion_at_contact(robot: UrdfRobot, recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pose (1, 6), the Jacobian (3, 6) of the point, and the direction in which it moves."""
    index = int(np.searchsorted(recording["position"].time, 1.4))
    position = recording["position"].values[index : index + 1]
    jacobian = robot.contact_jacobian(position, "link6", POINT.point)[0, :3]
    velocity = jacobian @ recording["speed"].values[index]
    return position, jacobian, velocity / np.linalg.norm(velocity)


def test_with_a_frozen_controller_the_torques_stay_and_the_force_accelerates_the_joints(
    robot: UrdfRobot, recording: Recording
) -> None:
    """At first the change of the acceleration is -M^-1 J' n F."""
    sensors = ModelTable({"sensors": {"accelerometer_hz": (1e6,) * 6}})
    contact = struck(recording, robot_model(robot, sensors), FROZEN)
    for channel in ("torque", "reference_torque"):
        np.testing.assert_array_equal(contact.changes[channel].values, 0.0)
    position, jacobian, normal = motion_at_contact(robot, recording)
    force = float(contact.force.at(np.array([contact.start + 2e-3]))[0, 0])
    expected = -np.linalg.solve(robot.inertia_matrix(position)[0], jacobian.T @ normal) * force
    found = at(contact, "acceleration", 2e-3)
    assert np.max(np.abs(found - expected)) < 0.05 * np.max(np.abs(expected))
    assert Doubt.CONTROLLER_UNKNOWN in contact.doubts
    assert Doubt.ACCELEROMETER_UNKNOWN not in contact.doubts


def test_the_force_is_that_of_the_obstacle_at_the_speed_of_the_point(robot: UrdfRobot, recording: Recording) -> None:
    contact = struck(recording, robot_model(robot, None), FROZEN, stiffness=1e3)
    index = int(np.searchsorted(recording["position"].time, 1.4))
    _, jacobian, _ = motion_at_contact(robot, recording)
    speed = float(np.linalg.norm(jacobian @ recording["speed"].values[index]))
    assert contact.speed == pytest.approx(speed, rel=0.01)
    force = float(contact.force.at(np.array([1.404]))[0, 0])
    assert force == pytest.approx(1e3 * speed * 4e-3, rel=0.03)
    assert contact.force.at(np.array([1.4]))[0, 0] == 0.0


def test_a_known_controller_lies_between_the_brackets(robot: UrdfRobot, recording: Recording) -> None:
    gains = {"period": (0.001,) * 6, "speed_gain": (30.0,) * 6, "integral_gain": (100.0,) * 6}
    known = robot_model(robot, ModelTable({"controller": gains}))
    unknown = robot_model(robot, None)
    torques = [
        float(at(struck(recording, model, assumption, 1e3), "torque", 0.03)[0])
        for model, assumption in ((unknown, FROZEN), (known, Assumption()), (unknown, STIFF))
    ]
    assert 0.0 == torques[0] < torques[1] < torques[2]
    with pytest.raises(RecordingError, match="no controller"):
        struck(recording, unknown, Assumption())


def test_an_elastic_joint_hides_the_contact_from_the_motor_at_first(robot: UrdfRobot, recording: Recording) -> None:
    drive = {"stiffness": (2e3,) * 6, "damping": (5.0,) * 6}
    elastic = struck(recording, robot_model(robot, ModelTable({"drive": drive})), FROZEN)
    rigid = struck(recording, robot_model(robot, None), FROZEN)
    early = [np.max(np.abs(at(item, "speed", 5e-3))) for item in (elastic, rigid)]
    assert early[0] < 0.5 * early[1]
    assert Doubt.RIGID_DRIVE in rigid.doubts
    assert Doubt.RIGID_DRIVE not in elastic.doubts
    assert Doubt.WIND_UP_BEYOND_FREE_RUNS in elastic.doubts
    known = {**drive, "observed_wind_up": (1e-9,) * 5 + (0.0,)}
    model = robot_model(robot, ModelTable({"drive": known}))
    beyond = struck(recording, model, replace(FROZEN, drive=DriveBeyond.RIGID))
    assert np.max(np.abs(at(beyond, "speed", 5e-3))) > 1.2 * early[0]


UR10E = ("joint1", "joint2", "joint3", "joint4", "joint5", "joint6")


def test_a_point_that_was_beyond_the_obstacle_before_meets_it_at_the_contact_only() -> None:
    """A real motion in which the tool crosses every plane several times, without a rest between."""
    keys = {"urdf": "ur10e.urdf", "joints": list(UR10E), "drive_inertia": [0.0, 3.7434, 0.0, 0.0708, 0.2342, 0.4365]}
    keys |= {"viscous_friction": 10.0, "coulomb_friction": 5.0, "coulomb_slope": 50.0}
    machine = UrdfRobot.of(keys, str(UR10E_LOGS / "machine.toml"))
    table = np.loadtxt(UR10E_LOGS / "no_torque.csv.gz", delimiter=",", usecols=range(19))
    series = {
        name: Series(table[:, 0] - table[0, 0], table[:, first : first + 6], machine.load_units[name])
        for name, first in (("position", 1), ("speed", 7), ("torque", 13))
    }
    log = log_of(Recording("no_torque", "no_torque", UR10E, series))
    point = StruckPoint("link6", (0.0, 0.0, 0.1))
    contact = robot_contact(log, robot_model(machine, None), point, Obstacle.spring(25e3), 3.5, 0.3, FROZEN)
    assert contact.speed > 1.0
    assert contact.separation > contact.start
    before = contact.force.time <= contact.start
    for change in (contact.force, *contact.changes.values()):
        assert not np.any(change.values[before])
    # 1/2 m v^2 = F^2 / 2 k with the mass that the point moves, a few kg.
    assert 1.0 < (contact.peak_force / contact.speed) ** 2 / 25e3 < 20.0

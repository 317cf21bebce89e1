"""What the observers of the contact torque share, on motions that are known exactly: one, two and six joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import detect_operation
from cdtool.base.arrays import FloatArray
from cdtool.detectors.desired_dynamics import DesiredDynamics
from cdtool.detectors.detection import WHOLE_MACHINE, Status
from cdtool.detectors.direct import Direct
from cdtool.detectors.energy import Energy
from cdtool.detectors.inertial_momentum import InertialMomentum
from cdtool.detectors.kalman_momentum import KalmanMomentum
from cdtool.detectors.momentum import Momentum
from cdtool.detectors.velocity import Velocity
from cdtool.recordings.operations import operations_of
from cdtool.thresholds.limit import Limit
from tests.synthetic.machines import ARM, arm_of, machine_of
from tests.synthetic.motions import moving_recording, resting_recording
from tests.synthetic.robots import six_joint_robot

BANDWIDTH = 30.0  # [rad/s], of all of them
OBSERVERS: dict[str, Any] = {
    "momentum": Momentum(BANDWIDTH),
    "inertial_momentum": InertialMomentum(BANDWIDTH),
    "velocity": Velocity(BANDWIDTH),
    "direct": Direct(BANDWIDTH / (2.0 * pi)),
    "desired_dynamics": DesiredDynamics(BANDWIDTH / (2.0 * pi)),
    "kalman_momentum": KalmanMomentum(sigma_speed=1e-2, sigma_torque=1.0, contact_drift=30.0),
}
AXIS = {"coordinates": "load", "load_mass": 12.0, "viscous_friction": 5.0, "coulomb_friction": 2.0, "coulomb_slope": 50}
MACHINES = ("axis", "arm", "robot")
# Allowed error [N, N m] beside contacts of 5 to 2 on axis, arm and robot: what the sampling costs, and the lag of the
# reference's cubic of `desired_dynamics`. None: the estimate depends on M, which changes with the robot's pose.
ALLOWED = {
    "momentum": (5e-4, 5e-4, 5e-4),
    "inertial_momentum": (5e-4, 5e-4, 5e-4),
    "velocity": (5e-4, 1e-3, None),
    "direct": (1e-3, 5e-2, None),
    "desired_dynamics": (5e-2, 5e-2, 5e-2),
    "kalman_momentum": (5e-4, 5e-4, 5e-4),
}
CONTACT_AT = 4.0


@pytest.fixture(scope="module")
def machines(tmp_path_factory) -> Callable[[str], Any]:
    """machines(kind), each built once; the robot needs pinocchio."""

    @cache
    def build_results(kind: str) -> Any:
        if kind != "robot":
            return machine_of(AXIS) if kind == "axis" else arm_of(ARM)
        pytest.importorskip("pinocchio")
        return six_joint_robot(tmp_path_factory.mktemp("robot"))

    return build_results


def contacts(machine: Any) -> FloatArray:
    return np.linspace(5.0, 2.0, len(machine.joints))


@pytest.mark.parametrize(
    ("name", "kind", "allowed"),
    [(name, *pair) for name, of in ALLOWED.items() for pair in zip(MACHINES, of, strict=True) if pair[1]],
)
def test_before_a_contact_it_is_zero_and_after_it_the_contact_torque(name, kind, allowed, machines):
    machine = machines(kind)
    contact = contacts(machine)
    log = moving_recording(machine, seconds=6.0, seed=1, contact=contact, contact_at=CONTACT_AT)
    signal = OBSERVERS[name].signal(log, machine)
    before, after = (signal.time < CONTACT_AT) & signal.valid[:, 0], signal.time > CONTACT_AT + 0.5
    assert before.mean() > 0.5
    assert signal.valid[after].all()
    np.testing.assert_allclose(signal.values[before], 0.0, atol=allowed)
    np.testing.assert_allclose(signal.values[after] - contact, 0.0, atol=allowed)


@pytest.mark.parametrize(("kind", "joint"), [("axis", 0), ("arm", 0), ("arm", 1), ("robot", 1), ("robot", 4)])
@pytest.mark.parametrize("name", OBSERVERS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_alarm_names_the_joint_that_feels_the_contact_and_its_side(name, kind, joint, sign, machines):
    machine = machines(kind)
    contact = np.zeros(len(machine.joints))
    contact[joint] = 6.0 * sign
    log = moving_recording(machine, seconds=6.0, seed=1, contact=contact, contact_at=CONTACT_AT)
    (operation,) = operations_of(log)
    detection = detect_operation(operation, machine, OBSERVERS[name], [Limit.given([3.0])], Activation())
    assert detection.verdict.outcome == "alarm"
    (alarm,) = detection.verdict.alarms
    assert (alarm.joint, detection.statistic.joints[alarm.column]) == (machine.joints[joint],) * 2
    assert alarm.side == ("above" if sign > 0.0 else "below")
    assert CONTACT_AT < alarm.time < CONTACT_AT + 0.15


def test_of_a_machine_with_constant_inertia_velocity_and_momentum_observer_are_the_same(gate, simulated):
    recording = simulated("stiff", 3)
    one, other = Momentum(12.0).signal(recording, gate), Velocity(12.0).signal(recording, gate)
    np.testing.assert_allclose(other.values, one.values, rtol=1e-12, atol=1e-12 * np.abs(one.values).max())
    np.testing.assert_array_equal(other.status, one.status)


SLIDE = """<robot name="slide"><link name="rail"/><link name="cart"><inertial><mass value="7"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="drive" type="prismatic">
<parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/><limit effort="1" velocity="1" lower="-1" upper="1"/>
</joint></robot>"""


@pytest.mark.parametrize(("kind", "pose"), [("arm", (0.4, 1.1)), ("robot", (0.3, -0.5, 1.2, 0.1, 0.7, -1.0))])
def test_in_a_frozen_pose_the_velocity_observer_is_the_filter_k_over_m(kind, pose, machines):
    """Step response I - exp(-K M^-1 t) of 2.15: joints leak into one another while the estimate settles."""
    machine = machines(kind)
    contact = contacts(machine)
    log = resting_recording(machine, pose, machine.gravity(np.array([pose]))[0] + contact, seconds=0.3)
    found = Velocity(BANDWIDTH).signal(log, machine).values
    gains = np.diag(BANDWIDTH * machine.nominal_inertia)
    rate = gains @ np.linalg.inv(machine.inertia_matrix(np.array([pose]))[0])
    expected = np.array([contact - expm(-rate * t) @ contact for t in log["speed"].time[::10]])
    np.testing.assert_allclose(found[::10], expected, rtol=1e-9, atol=1e-9)
    alone = contact * (1.0 - np.exp(-BANDWIDTH * 0.1))
    assert np.max(np.abs(found[100] - alone)) > 0.01


@pytest.mark.parametrize("kind", MACHINES)
def test_the_energy_observer_is_the_filtered_power_of_the_contact(kind, machines):
    """It differs by the trapezoid with which the free motion's own power is summed: a quarter for half the period."""
    machine = machines(kind)
    contact, worst = contacts(machine), []
    for period in (1e-3, 5e-4):
        log = moving_recording(machine, seconds=3.0, seed=2, contact=contact, contact_at=-np.inf, period=period)
        power = np.sum(log["speed"].values * contact, axis=1)
        a = np.exp(-BANDWIDTH * period)
        expected = lfilter([1.0 - a], [1.0, -a], 0.5 * (power[1:] + power[:-1]))
        signal = Energy(BANDWIDTH, 1e-3).signal(log, machine)
        worst.append(np.max(np.abs(signal.values[1:, 0] - expected)))
        assert np.abs(expected).max() > 1.0
    assert worst[0] < 1e-3
    assert worst[0] / worst[1] == pytest.approx(4.0, rel=0.25)
    assert signal.joints == (WHOLE_MACHINE if machine.coupled else ())


@pytest.mark.parametrize("name", OBSERVERS)
@pytest.mark.parametrize("share", [0.9, -0.9, 0.0])
def test_a_robot_that_rests_within_its_dry_friction_leaves_no_residual(name, share, tmp_path):
    """Held by friction, the drives may give anything between gravity less and gravity plus the friction."""
    pytest.importorskip("pinocchio")
    robot = six_joint_robot(tmp_path, coulomb_friction=4.0, coulomb_slope=0.0)
    pose = np.array([0.3, -0.5, 1.2, 0.1, 0.7, -1.0])
    gravity = robot.gravity(pose[np.newaxis])[0]
    signal = OBSERVERS[name].signal(resting_recording(robot, pose, gravity + 4.0 * share), robot)
    assert (signal.status[-1] == Status.VALID).all()
    np.testing.assert_allclose(signal.values, 0.0, atol=1e-9)
    pushed = OBSERVERS[name].signal(resting_recording(robot, pose, gravity + 6.0), robot)
    np.testing.assert_allclose(pushed.values[-1], 2.0, rtol=1e-3)


@pytest.mark.parametrize("name", [Energy, Momentum, KalmanMomentum, InertialMomentum, Velocity, Direct])
def test_lost_samples_of_the_pose_move_the_signal_of_coupled_joints_no_more_than_those_of_the_speed(name):
    # Held while the speed goes on, the pose would be that of another instant: the energy would stand still, then jump.
    machine = arm_of(ARM)
    whole = moving_recording(machine, seconds=3.0)
    expected = name().signal(whole, machine)

    def moved(channel: str) -> float:
        largest = 0.0
        for at in (0.75, 1.1, 1.4, 2.0):
            series = whole[channel]
            keep = (series.time < at) | (series.time >= at + 0.012)
            cut = replace(series, time=series.time[keep], values=series.values[keep])
            found = name().signal(replace(whole, channels={**whole.channels, channel: cut}), machine)
            rows = np.searchsorted(expected.time, found.time)
            off = np.abs(found.values - expected.values[rows])
            largest = max(largest, float(off[found.valid & expected.valid[rows]].max()))
        return largest

    assert moved("position") <= 6.0 * moved("speed")

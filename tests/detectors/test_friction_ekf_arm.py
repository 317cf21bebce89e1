"""The friction-estimating EKF of coupled joints: Riccati equation, a plain filter of matrices, known frictions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import read_only
from cdtool.detectors.base import drive_on_speed_clock
from cdtool.detectors.detection import Status
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.friction_ekf_arm_kernel import predict_covariance, update_covariance
from cdtool.detectors.friction_ekf_kernel import Samples
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.dynamics import JointEquation
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recordings.recording import Recording
from tests.synthetic.motions import PERIOD, moving_recording
from tests.synthetic.robots import six_joint_robot

EKF = FrictionEkf(
    sigma_acceleration=0.4,
    sigma_speed=0.01,
    friction_drift=2.5,
    drift_acceleration=0.0375,
    drift_speed=1e-3,
    sigma_position=1e-3,
    drift_position=1e-4,
    minimum_speed=0.05,
)
PROCESS = (2.5**2 * PERIOD, 0.0375**2, 1e-3**2, 1e-4**2)
NOISE = (0.4**2, 0.01**2, 1e-3**2)
START = (2.5**2 * 10.0, 0.0, 0.0, 0.0, NOISE[0], 0.0, 0.0, NOISE[1], 0.0, NOISE[2])
UPPER = np.triu_indices(4)
# Where each measured state's column stands in the upper triangle.
COLUMNS = ((1, 4, 5, 6), (2, 5, 7, 8), (3, 6, 8, 9))


def square(p) -> FloatArray:
    matrix = np.zeros((4, 4))
    matrix[UPPER] = p
    return matrix + matrix.T - np.diag(np.diag(matrix))


def measured(p, observable: bool = True):
    """The three scalar updates with the filter's own functions."""
    for state, (places, noise) in enumerate(zip(COLUMNS, NOISE, strict=True), start=1):
        column = tuple(p[place] for place in places)
        innovation = column[state] + noise
        gains = tuple(item / innovation for item in column)
        p = update_covariance(p, column, gains if observable else (0.0, *gains[1:]), innovation)
    return p


def transition(f21: float, f23: float, f24: float) -> FloatArray:
    return np.array([[1.0, 0.0, 0.0, 0.0], [f21, 0.0, f23, f24], [0.0, PERIOD, 1.0, 0.0], [0.0, 0.0, PERIOD, 1.0]])


@pytest.mark.parametrize("slopes", [(-0.28 / 0.235, -2.0 / 0.235, 20.0), (-1.2, 0.0, -15.0)])
def test_the_covariance_settles_on_the_solution_of_the_riccati_equation(slopes):
    p = START
    for _ in range(20_000):
        p = predict_covariance(p, *slopes, PERIOD, *PROCESS)
        predicted = p
        p = measured(p)
    observation = np.eye(4)[1:]
    # In units in which every state's variance is near 1, so that the solver loses no digits.
    unit = np.sqrt(np.diag(square(predicted)))
    scaled = transition(*slopes) * unit / unit[:, np.newaxis]
    process, noise = np.diag(PROCESS) / np.outer(unit, unit), np.diag(NOISE) / np.outer(unit[1:], unit[1:])
    expected = solve_discrete_are(scaled.T, observation.T, process, noise)
    assert np.max(np.abs(square(predicted) / np.outer(unit, unit) - expected)) < 5e-14


def joint_of(arm: PlanarArm, log: Recording, joint: int) -> tuple[FloatArray, list[tuple[Samples, JointEquation]]]:
    """One joint's angle; its samples with the angle as a state, and with everything that is known as an input."""
    drive = drive_on_speed_clock(log, arm)
    acceleration = log["acceleration"]
    inputs = (drive.torque, drive.position, drive.speed, acceleration.values)
    missing = np.zeros(len(drive.time), dtype=np.uint8)
    equations = (arm.joint_equations(*inputs)[joint], CoupledMachine.joint_equations(arm, *inputs)[joint])
    columns = [
        (drive.time, equation.force, drive.speed[:, joint], missing, acceleration.time, acceleration.values[:, joint])
        for equation in equations
    ]
    samples = [Samples(*map(read_only, column)) for column in columns]
    return drive.position[:, joint], list(zip(samples, equations, strict=True))


def plain_filter(samples: Samples, equation: JointEquation, position: FloatArray) -> FloatArray:
    """Friction (n,) by matrices, the transition's Jacobian by numerical differentiation; all channels on one clock."""
    link, inertia = equation.pendulum, float(equation.inertia[0])
    assert link is not None

    def following(x: FloatArray, k: int) -> FloatArray:
        d, a, v, q = x
        between = q - link.other_position[k]
        coupled = np.cos(between) * link.other_acceleration[k] + np.sin(between) * link.other_speed[k] ** 2
        force = samples.force[k] - d * v - link.gravity * np.cos(q) - link.coupling * coupled
        return np.array([d, force / inertia, v + PERIOD * a, q + PERIOD * v])

    x = np.array([equation.viscous, samples.acceleration[0], samples.speed[0], position[0]])
    p = square(START)
    applicable = abs(samples.speed[0]) >= EKF.minimum_speed
    found = [x[0]]
    for k in range(1, len(samples.time)):
        # A step into the imaginary plane: a numerical derivative without cancellation.
        jacobian = np.array([following(x + 1e-30j * unit, k - 1).imag / 1e-30 for unit in np.eye(4)]).T
        x = following(x, k - 1)
        p = jacobian @ p @ jacobian.T + np.diag([PROCESS[0] if applicable else 0.0, *PROCESS[1:]])
        readings = (samples.acceleration[k], samples.speed[k], position[k])
        for state, (reading, noise) in enumerate(zip(readings, NOISE, strict=True), start=1):
            if state == 2:
                applicable = abs(reading) >= EKF.minimum_speed
            gains = p[:, state] / (p[state, state] + noise)
            gains[0] *= applicable
            x = x + gains * (reading - x[state])
            rest = np.eye(4) - np.outer(gains, np.eye(4)[state])
            p = rest @ p @ rest.T + noise * np.outer(gains, gains)
        found.append(x[0])
    return np.array(found)


@pytest.mark.parametrize("joint", [0, 1])
def test_it_equals_a_filter_of_matrices_with_a_numerical_jacobian(arm, joint):
    log = moving_recording(arm, seconds=3.0, seed=2, noise=5e-3, contact=[3.0, 2.0], contact_at=2.0)
    position, (own_angle, _) = joint_of(arm, log, joint)
    found, _ = EKF.estimate(*own_angle, position)
    expected = plain_filter(*own_angle, position)
    assert np.ptp(expected) > 1.0
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def with_friction(log: Recording, friction: FloatArray) -> Recording:
    """The same motion against more viscous friction (J,)."""
    torque = log["torque"]
    more = replace(torque, values=torque.values + friction * log["speed"].values)
    return replace(log, channels={**log.channels, "torque": more})


def fast(log: Recording) -> FloatArray:
    """(n, J): where the speed is well above the minimum."""
    return np.abs(log["speed"].values) > 0.3


def test_it_finds_the_virtual_friction_of_both_joints_of_an_arm(arm):
    more = np.array([1.5, 0.7])
    log = with_friction(moving_recording(arm, seconds=6.0, seed=3), more)
    signal = EKF.signal(log, arm)
    judged = signal.valid & fast(log)
    own = 0.4  # what the machine file has [N m s/rad]
    for j in range(2):
        assert judged[:, j].mean() > 0.2
        np.testing.assert_allclose(signal.values[judged[:, j], j], own + more[j], rtol=0.01)


def test_it_finds_the_virtual_friction_of_each_joint_of_a_robot_whose_other_joints_move(tmp_path):
    pytest.importorskip("pinocchio")
    robot = six_joint_robot(tmp_path)
    more = np.array([6.0, 5.0, 4.0, 30.0, 2.0, 3.0])
    log = with_friction(moving_recording(robot, seconds=6.0, seed=3), more)
    signal = replace(EKF, friction_drift=50.0).signal(log, robot)
    judged = signal.valid & fast(log)
    for j in range(6):
        assert judged[:, j].mean() > 0.2
        np.testing.assert_allclose(signal.values[judged[:, j], j], 2.0 + more[j], rtol=0.1)


def test_an_angle_as_a_state_and_everything_known_as_an_input_give_the_same_friction(arm):
    """Both equations are the same one; the angle's own noise and the first-order prediction of it differ."""
    log = with_friction(moving_recording(arm, seconds=6.0, seed=5, noise=1e-3), np.array([1.5, 0.7]))
    for joint in (0, 1):
        position, (own_angle, all_known) = joint_of(arm, log, joint)
        (one, status), (other, _) = EKF.estimate(*own_angle, position), EKF.estimate(*all_known, position)
        judged = (status == Status.VALID) & fast(log)[:, joint]
        assert judged.sum() > 1000
        assert np.max(np.abs(one - other)[judged]) < 5e-3


def test_at_rest_it_is_not_applicable_and_its_estimate_holds(arm):
    log = moving_recording(arm, seconds=4.0, seed=1, rest=2.0)
    signal = EKF.signal(log, arm)
    resting = signal.time < 2.0
    assert (signal.status[resting] == Status.NOT_APPLICABLE).all()
    assert np.ptp(signal.values[resting], axis=0).max() == 0.0


def test_however_long_the_rest_the_frictions_variance_has_not_grown(arm):
    """With a variance that had grown the estimate would move faster after a longer rest."""
    after = []
    for rest in (1.0, 41.0):
        log = with_friction(moving_recording(arm, seconds=rest + 1.2, rest=rest), np.array([1.5, 0.7]))
        after.append(EKF.signal(log, arm).values[round(rest / PERIOD) :])
    assert np.ptp(after[0], axis=0).min() > 0.5
    np.testing.assert_allclose(after[1], after[0], atol=1e-9)

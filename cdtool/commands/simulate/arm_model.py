"""A light two-link robot arm that runs against an obstacle: a run's measured channels and truth.

Both motors sit on the base and turn the links' absolute angles through elastic drives; a cascade of position and
speed loops commands their torques (thesis 6.2). Its numbers are assumptions: see `arm_parameters`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import UsageError
from cdtool.commands.simulate import arm_kernel, sensors
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial, require_trial

Array = npt.NDArray[np.float64]
Impact = Literal["none", "stiff", "soft"]


@dataclass(frozen=True)
class ArmRun:
    """One stroke at the log rate, (n, 2) where both joints count; the last eight fields are the simulator's truth."""

    time: Array  # [s]
    motor_torque: Array  # from PWM, at the motor [N m]
    motor_speed: Array  # from the encoder, filtered [rad/s]
    motor_position: Array  # encoder, quantised [rad]
    imu: Array  # specific force across each link [m/s2]
    reference_position: Array  # of the motors [rad]
    reference_speed: Array  # of the motors [rad/s]
    load_cell: Array  # [N]
    contact_start: float | None  # instant of first touch [s]; None without one
    contact_force: Array  # what the arm exerts on the obstacle [N]
    joint_position: Array  # of the links [rad]
    joint_speed: Array  # [rad/s]
    joint_acceleration: Array  # [rad/s2]
    drive_position: Array  # of the motors, on the joint side [rad]
    drive_speed: Array  # [rad/s]
    drive_torque: Array  # of the motors, on the joint side [N m]


def simulate_arm_run(
    parameters: ArmParameters,
    rng: np.random.Generator,
    trial: Trial,
    impact: Impact,
    substeps: int = 5,
) -> ArmRun:
    """Simulate one stroke from rest, free or against a stiff or soft (bumper) obstacle.

    Trial 1: the arm's own contact point meets the obstacle, the forearm upright. Trial 2: the level forearm is
    carried up against a horizontal plate. All random numbers are drawn before the integration, sample by sample:
    the same seed gives the same run up to the contact whatever `impact` is, and the same noise whatever `substeps`
    (of a log period) is. Raises `UsageError` for unknown `trial` or `impact`, `substeps` < 1.
    """
    require_trial(trial)
    if impact not in arm_kernel.CONTACT_KINDS:
        raise UsageError(f"unknown impact {impact!r}", "Choose one of: none, stiff, soft.")
    if substeps < 1:
        raise UsageError(f"substeps is {substeps}", "A log period needs at least one integration step.")
    durations = parameters.free_duration if impact == "none" else parameters.impact_duration
    period = parameters.sample_period
    time = np.arange(round(durations[trial - 1] / period), dtype=np.float64) * period
    scatter = rng.standard_normal(3)
    friction = 1.0 + parameters.friction_scatter * scatter[:2]
    angle = parameters.obstacle_angle[trial - 1] + parameters.obstacle_scatter * float(scatter[2])
    noise = rng.standard_normal((time.size, 9))
    deviation, rate = parameters.disturbance_torque, parameters.disturbance_rate
    disturbance = np.array([sensors.coloured_noise(noise[:, joint], deviation, rate, period) for joint in (0, 1)])
    reference = parameters.reference(trial, time)
    obstacle = parameters.obstacle(trial, angle)
    start = parameters.equilibrium(trial)
    stroke = ArmStroke(reference, disturbance, friction, obstacle, trial, impact)
    truth, first_contact = integrate_arm(parameters, start, stroke, substeps)
    return _measure(parameters, time, reference, truth, noise, first_contact)


@dataclass(frozen=True)
class ArmStroke:
    """The reference motion of an arm, and what acts on it.

    `reference` position [rad] and speed [rad/s] and `disturbance` [N m] (2, n) hold a value per sample; `friction` (2,)
    is each joint's factor on its Coulomb and static friction [-]; `obstacle` is that of `ArmParameters.obstacle`.
    """

    reference: tuple[Array, Array]
    disturbance: Array
    friction: Array
    obstacle: float
    trial: Trial
    impact: Impact


def integrate_arm(
    parameters: ArmParameters, initial_state: Array, stroke: ArmStroke, substeps: int
) -> tuple[dict[str, Array], float]:
    """Return the true motion and the time of the first contact [s], NaN without one.

    The motion by name: `arm_kernel.ROWS`, each (2, n), and contact_force (n,). `initial_state` (6, 2) is in the order
    of `ROWS`.
    """
    log = np.zeros((len(arm_kernel.ROWS), *stroke.disturbance.shape))
    contact_force = np.zeros(stroke.disturbance.shape[1])
    numbers = arm_kernel.Numbers(*(float(getattr(parameters, name)) for name in arm_kernel.Numbers._fields))
    pairs = arm_kernel.Pairs(*(tuple(map(float, getattr(parameters, name))) for name in arm_kernel.Pairs._fields))
    kind = arm_kernel.CONTACT_KINDS[stroke.impact]
    scratch = (*np.zeros((3, 6, 2)), np.zeros((arm_kernel.HELD, 2)))
    first_contact = arm_kernel.integrate_arm(
        *(numbers, pairs, initial_state.copy(), *scratch, *stroke.reference),
        *(stroke.disturbance, stroke.friction, stroke.obstacle, stroke.trial, kind, substeps, log, contact_force),
    )
    return {**dict(zip(arm_kernel.ROWS, log, strict=True)), "contact_force": contact_force}, first_contact


def specific_force(parameters: ArmParameters, position: Array, speed: Array, acceleration: Array) -> Array:
    """Return what ideal IMUs measure across their links, (2, n) [m/s2], gravity included (thesis 6.7, 6.26 corrected).

    a1 = l_IMU1 qdd1 + g cos q1; a2 = l_IMU2 qdd2 + g cos q2 + l1 (qdd1 cos(q2 - q1) + qd1^2 sin(q2 - q1)): the second
    rides on the elbow. `position` [rad], `speed` [rad/s] and `acceleration` [rad/s2] are (2, n).
    """
    lengths = np.array(parameters.imu_position)[:, np.newaxis]
    felt = lengths * acceleration + parameters.gravity * np.cos(position)
    between = position[1] - position[0]
    felt[1] += parameters.arm_length * (acceleration[0] * np.cos(between) + speed[0] ** 2 * np.sin(between))
    return np.asarray(felt, dtype=np.float64)


def _measure(
    parameters: ArmParameters,
    time: Array,
    reference: tuple[Array, Array],
    truth: dict[str, Array],
    noise: Array,
    first_contact: float,
) -> ArmRun:
    """Return what sensors and drives log; columns 0 and 1 of `noise` were the disturbances."""
    ratio, period = np.array(parameters.transmission_ratio), parameters.sample_period
    felt = specific_force(parameters, truth["link_position"], truth["link_speed"], truth["link_acceleration"])
    moving = np.minimum(np.abs(truth["link_speed"][0]) / parameters.nominal_speed, 1.0)
    imu, torque = np.empty((time.size, 2)), np.empty((time.size, 2))
    sensor = sensors.Accelerometer(
        noise=parameters.imu_noise,
        bias=parameters.imu_bias,
        frequency=parameters.imu_frequency,
        damping=parameters.imu_damping,
        resolution=parameters.imu_resolution,
        period=period,
    )
    for joint in (0, 1):
        torque[:, joint] = sensors.measured_torque(
            truth["motor_torque"][joint],
            noise[:, 2 + joint],
            parameters.torque_noise,
            parameters.torque_filter_time,
            period,
        )
        vibration = sensors.resonance(
            noise[:, 4 + joint],
            parameters.vibration_acceleration,
            parameters.vibration_frequency,
            parameters.vibration_damping,
            period,
        )
        imu[:, joint] = sensor.reading(
            felt[joint], vibration * moving, noise[:, 6 + joint], settled=float(felt[joint, 0])
        )
    return ArmRun(
        time=time,
        motor_torque=torque * ratio,
        motor_speed=truth["measured_speed"].T / ratio,
        motor_position=truth["measured_position"].T / ratio,
        imu=imu,
        reference_position=reference[0].T / ratio,
        reference_speed=reference[1].T / ratio,
        load_cell=truth["contact_force"] + parameters.load_cell_noise * noise[:, 8],
        contact_start=None if math.isnan(first_contact) else first_contact,
        contact_force=truth["contact_force"],
        joint_position=truth["link_position"].T,
        joint_speed=truth["link_speed"].T,
        joint_acceleration=truth["link_acceleration"].T,
        drive_position=truth["motor_position"].T,
        drive_speed=truth["motor_speed"].T,
        drive_torque=truth["motor_torque"].T,
    )

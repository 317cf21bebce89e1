"""Simulate a robot in closed loop along the references of a log, free or with a point against an obstacle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import ElasticDrive
from cdtool.machines.axis_model.simulation import LARGEST_STEP, NEVER, integration_steps
from cdtool.machines.robot_model import robot_loop_kernel
from cdtool.machines.robot_model.parameters import RobotModel, Vector, largest_rate


@dataclass(frozen=True, eq=False)
class RobotInputs:
    """What drives the model, one value per controller period; arrays (n, J) on the load side, in the joints' order.

    `command` [N m, N] replaces the controllers if it is given. The robot starts in steady motion from
    `initial_position` with `initial_speed` (J,): of the motors, which are what a log shows.
    """

    reference_speed: FloatArray
    reference_position: FloatArray
    initial_position: FloatArray
    initial_speed: FloatArray
    command: FloatArray | None = None


@dataclass(frozen=True)
class PointContact:
    """An obstacle whose plane n . x = obstacle.position [m] (base axes) a point of a tree's joint moves into.

    `joint`: index of the tree's joint, `point` in its frame [m]. The plane, which has no edges, is there from
    `first_sample` on: the path of the point may have crossed it elsewhere before.
    """

    joint: int
    point: Vector
    normal: Vector
    obstacle: Obstacle
    first_sample: int = 0


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """The simulated motion by name (`robot_loop_kernel.ROWS`), (n, J) every `period` [s].

    `contact_force` (n,): what the robot exerts on the obstacle [N]. `first_contact` [s] counts from the first sample;
    NaN without a contact.
    """

    period: float
    rows: FloatArray
    contact_force: FloatArray
    first_contact: float = math.nan

    def __getitem__(self, name: str) -> FloatArray:
        row: FloatArray = self.rows[robot_loop_kernel.ROWS.index(name)].T
        return row


def simulate_robot(model: RobotModel, inputs: RobotInputs, contact: PointContact | None = None) -> RobotMotion:
    """Simulate the robot with the controllers of its joints.

    Raises ConfigurationError where the model has no controllers, needs more integration steps than are reasonable, or
    has inertias that no robot has.
    """
    controllers = [axis.controller for axis in model.axes if axis.controller is not None]
    if len(controllers) < len(model.axes):
        raise ConfigurationError("the model has no controller", "give [model.controller]")
    period = controllers[0].period
    count, joints = inputs.reference_speed.shape
    table = np.zeros((len(robot_loop_kernel.INPUTS), joints, count))
    table[0], table[1] = inputs.reference_speed.T, inputs.reference_position.T
    if inputs.command is not None:
        table[2] = inputs.command.T
    rows, force = np.zeros((len(robot_loop_kernel.ROWS), joints, count)), np.zeros(count)
    against: tuple[float, ...] = (0.0,) * 11
    curve = np.array([[0.0, 1.0], [0.0, 0.0]])
    if contact is not None:
        obstacle = contact.obstacle
        plane = (*contact.normal, obstacle.position, obstacle.damping, float(contact.first_sample))
        against = (1.0, float(contact.joint), *contact.point, *plane)
        curve = obstacle.penetration_curve
    # Seven poses, at which the fastest motion of the robot is looked for.
    poses = inputs.reference_position[:: max(count // 7, 1)]
    model = with_smooth_friction(model, poses, period)
    first_contact = robot_loop_kernel.integrate_robot(
        model.bodies,
        np.array(model.combination),
        model.tree.gravity,
        _numbers(model, period),
        period,
        curve,
        _initial_state(model, inputs),
        table,
        against,
        _mode(model, inputs),
        substeps(model, poses, period, contact),
        rows,
        force,
    )
    if not np.all(np.isfinite(rows)):
        raise ConfigurationError(
            f"machine '{model.name}': the simulated motion has no bounds",
            "check the inertias, [model.drive] motor_mass and the gains of [model.controller]",
        )
    return RobotMotion(period, rows, force, first_contact)


def _mode(model: RobotModel, inputs: RobotInputs) -> int:
    if inputs.command is not None:
        return robot_loop_kernel.REPLAYED
    return robot_loop_kernel.INERTIAL if model.gains_of_inertia else robot_loop_kernel.CONTROLLED


def substeps(model: RobotModel, poses: FloatArray, period: float, contact: PointContact | None = None) -> int:
    """Return the number of integration steps per period that the fastest motion needs at any of the poses (m, J)."""
    motors = np.array([axis.drive.motor_mass for axis in model.axes])
    rigid = np.array([axis.drive.is_rigid for axis in model.axes])
    fastest = max(_rate_at(model, pose, motors, rigid, contact) for pose in poses)
    lags = [axis.controller.force_lag for axis in model.axes if axis.controller is not None]
    fastest = max(fastest, *(1.0 / lag for lag in lags if lag > 0.0), 0.0)
    return integration_steps(fastest, period)


def with_smooth_friction(model: RobotModel, poses: FloatArray, period: float) -> RobotModel:
    """Return the model with a smooth sign of its friction that 16 integration steps per period can follow."""
    if model.smoothing_stated:
        return model
    most = 16 * LARGEST_STEP / period
    axes = []
    for joint, axis in enumerate(model.axes):
        friction = axis.friction
        highest = max(friction.coulomb_forward, friction.coulomb_backward, friction.static)
        inertia = axis.drive.motor_mass
        if axis.drive.is_rigid:
            inertia = min(_moved_inertia(model, pose, joint) for pose in poses)
        # Joints add up: each has its share of the rate.
        least = len(model.axes) * highest / (inertia * most) if axis.drive.is_rigid else highest / (inertia * most)
        axes.append(replace(axis, friction=replace(friction, smoothing_speed=max(friction.smoothing_speed, least))))
    return replace(model, axes=tuple(axes))


def _moved_inertia(model: RobotModel, pose: FloatArray, joint: int) -> float:
    """Return the inertia that a torque of a joint accelerates while the others are free, 1 / (M^-1)_jj."""
    return 1.0 / float(np.linalg.inv(inertia_with_rigid_motors(model, pose))[joint, joint])


def inertia_with_rigid_motors(model: RobotModel, pose: FloatArray) -> FloatArray:
    """Return M (J, J) of the links at a pose, with the motors that are rigidly coupled to them."""
    matrix, _ = model.dynamics(pose, np.zeros(len(pose)))
    matrix[np.diag_indices(len(pose))] += [axis.drive.motor_mass * axis.drive.is_rigid for axis in model.axes]
    return matrix


def _rate_at(
    model: RobotModel, pose: FloatArray, motors: FloatArray, rigid: FloatArray, contact: PointContact | None
) -> float:
    """Return the fastest rate of the model at a pose [1/s]."""
    matrix = inertia_with_rigid_motors(model, pose)
    damping, bristles = [], []
    for axis, bristle in zip(model.axes, model.bristles, strict=True):
        friction = axis.friction
        highest = max(friction.coulomb_forward, friction.coulomb_backward, friction.static)
        slope = bristle.damping if bristle.stiffness > 0.0 else highest / friction.smoothing_speed
        damping.append(slope + friction.viscous)
        bristles.append(bristle.stiffness)
    of_links, of_motors = np.where(rigid, damping, 0.0), np.where(rigid, 0.0, damping)
    springs_of_links = np.where(rigid, bristles, 0.0)
    rates = [largest_rate(matrix, of_links.tolist()), math.sqrt(largest_rate(matrix, springs_of_links.tolist()))]
    for joint in np.flatnonzero(~rigid.astype(bool)):
        drive = model.axes[joint].drive
        stiffest = max(drive.stiffness, drive.end_stiffness if math.isfinite(drive.end_stiffness) else 0.0)
        reduced = 1.0 / (1.0 / motors[joint] + 1.0 / _moved_inertia(model, pose, int(joint)))
        rates += [
            math.sqrt(stiffest / reduced),
            max(drive.damping, drive.end_damping) / reduced,
            of_motors[joint] / motors[joint],
        ]
        rates.append(math.sqrt(bristles[joint] / motors[joint]))
    if contact is not None:
        _, lever = model.point_along(pose, contact.joint, contact.point, contact.normal)
        compliance = float(lever @ np.linalg.solve(matrix, lever))
        rates.append(math.sqrt(contact.obstacle.steepest * compliance))
    return max(rates)


def wind_up_at(drive: ElasticDrive, torque: float) -> float:
    """Return the wind-up of a joint's drive, the same in both directions, at a static torque; 0 if it is rigid."""
    if drive.is_rigid:
        return 0.0
    size = abs(torque)
    taken_up = drive.stiffness * min(drive.take_up_travel, NEVER)
    found = size / drive.stiffness if size <= taken_up else drive.take_up_travel
    if size > taken_up:
        found += (size - taken_up) / drive.end_stiffness
    return math.copysign(found, torque)


def _numbers(model: RobotModel, period: float) -> FloatArray:
    """Return the parameters (row of `PARAMETERS`, joint) as the kernel reads them."""
    table = np.zeros((len(robot_loop_kernel.PARAMETERS), len(model.axes)))
    for joint, (axis, bristle) in enumerate(zip(model.axes, model.bristles, strict=True)):
        drive, friction, controller = axis.drive, axis.friction, axis.controller
        values = {
            "rigid": float(drive.is_rigid),
            "stated_inertia": -model.motor_in_links[joint],
            "stiffness": 0.0 if drive.is_rigid else drive.stiffness,
            "take_up_travel": min(drive.take_up_travel, NEVER),
            "end_stiffness": drive.end_stiffness if math.isfinite(drive.end_stiffness) else 0.0,
            "end_damping": max(drive.end_damping, drive.damping),
            "bristle_stiffness": bristle.stiffness,
            "bristle_damping": bristle.damping,
            "delay_samples": round(controller.delay / period) if controller else 0.0,
        }
        for row, name in enumerate(robot_loop_kernel.PARAMETERS):
            owner = next(part for part in (drive, friction, controller) if name in values or hasattr(part, name))
            table[row, joint] = values[name] if name in values else float(getattr(owner, name))
    return table


def _initial_state(model: RobotModel, inputs: RobotInputs) -> FloatArray:
    """Return the states and the controllers' integrals (STATES + 1, J) in steady motion with the initial speed."""
    motor, speed = inputs.initial_position, inputs.initial_speed
    link = motor.copy()
    for _ in range(10):  # the load's torque depends on the pose that it winds up
        _, load = model.dynamics(link, speed)
        link = motor - [wind_up_at(axis.drive, float(torque)) for axis, torque in zip(model.axes, load, strict=True)]
    state = np.zeros((robot_loop_kernel.STATES + 1, len(motor)))
    state[0], state[1], state[2], state[3] = motor, speed, link, speed
    for joint, (axis, bristle) in enumerate(zip(model.axes, model.bristles, strict=True)):
        friction, own = axis.friction, float(speed[joint])
        dry = 0.0
        if own:
            coulomb = friction.coulomb_forward if own > 0.0 else friction.coulomb_backward
            rise = max(friction.static - coulomb, 0.0) * math.exp(-((own / friction.stribeck_speed) ** 2))
            dry = math.copysign(coulomb + rise, own)
            if bristle.stiffness > 0.0:
                state[5, joint] = dry / bristle.stiffness
            else:
                dry *= abs(math.tanh(own / friction.smoothing_speed))
        state[4, joint] = load[joint] + dry + friction.viscous * own + friction.offset
    state[6] = 0.0 if model.gains_of_inertia else state[4]
    return state

"""The simulated arm's parameters as a model of a robot: what both have in common."""

from __future__ import annotations

from dataclasses import replace

from cdtool.commands.inject.robot_contact import StruckPoint
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial
from cdtool.machines.axis_model.model_table import Bristle
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction, Sensors
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.robot_model.parameters import RobotModel, robot_model


def arm_as_model(machine: PlanarArm, arm: ArmParameters) -> RobotModel:
    rigid = robot_model(machine, None)
    axes = tuple(_joint(arm, rigid.axes[joint], joint) for joint in (0, 1))
    bristles = (Bristle(stiffness=arm.bristle_stiffness, damping=arm.bristle_damping),) * 2
    return replace(rigid, axes=axes, bristles=bristles)


def _joint(arm: ArmParameters, rigid: AxisModel, joint: int) -> AxisModel:
    drive = ElasticDrive(
        motor_mass=arm.reflected_inertia[joint],
        load_mass=rigid.drive.load_mass,
        stiffness=arm.soft_stiffness,
        damping=arm.drive_damping,
        take_up_travel=arm.soft_travel,
        end_stiffness=arm.drive_stiffness,
    )
    friction = Friction(
        coulomb_forward=arm.coulomb_friction[joint],
        coulomb_backward=arm.coulomb_friction[joint],
        static=arm.static_friction[joint],
        stribeck_speed=arm.stribeck_speed,
        viscous=arm.viscous_friction,
    )
    controller = Controller(
        period=arm.sample_period,
        speed_gain=arm.speed_gain,
        integral_gain=arm.integral_gain,
        position_gain=arm.position_gain,
        anti_windup_rate=arm.anti_windup_rate,
        force_limit=arm.torque_limit,
        speed_filter_hz=arm.speed_filter_frequency,
        force_lag=arm.torque_lag,
    )
    sensors = Sensors(
        torque_filter_time=arm.torque_filter_time,
        accelerometer_hz=arm.imu_frequency,
        accelerometer_damping=arm.imu_damping,
    )
    return AxisModel(drive=drive, friction=friction, controller=controller, sensors=sensors)


def arm_obstacle(arm: ArmParameters, kind: str) -> Obstacle:
    """The stiff obstacle, or the bumper; its last section is as stiff as the bottomed bumper."""
    if kind == "stiff":
        return Obstacle.spring(arm.obstacle_stiffness, arm.obstacle_damping)
    bottom = arm.bumper_stiffness * arm.bumper_travel
    return Obstacle(
        (0.0, arm.bumper_travel, arm.bumper_travel + 0.01),
        (0.0, bottom, bottom + 0.01 * arm.bumper_bottom_stiffness),
        arm.bumper_damping,
    )


def arm_point(arm: ArmParameters, trial: Trial) -> StruckPoint:
    """Trial 1: a point of the arm, along its path; trial 2: one of the forearm, against a horizontal plate."""
    if trial == 1:
        return StruckPoint("arm", (arm.contact_position[0], 0.0, 0.0))
    return StruckPoint("forearm", (arm.contact_position[1], 0.0, 0.0), (0.0, 0.0, 1.0))

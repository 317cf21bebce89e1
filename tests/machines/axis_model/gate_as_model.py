"""The simulated gate's parameters as a model of one axis: what both have in common."""

from __future__ import annotations

from cdtool.commands.simulate.gate_model import GateParameters
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction, Sensors


def gate_as_model(gate: GateParameters, *, front: bool = True) -> AxisModel:
    drive = ElasticDrive(
        motor_mass=gate.motor_mass,
        load_mass=gate.leaf_mass,
        stiffness=gate.take_up_stiffness,
        damping=gate.take_up_damping,
        take_up_travel=gate.take_up_travel,
        end_stiffness=gate.drive_stiffness,
        end_damping=gate.drive_damping,
        backlash=gate.backlash,
        motor_friction=gate.motor_friction,
        front_mass=gate.post_mass if front else 0.0,
        front_stiffness=gate.post_stiffness,
        front_damping=gate.post_damping,
    )
    friction = Friction(
        coulomb_forward=gate.coulomb_friction,
        coulomb_backward=gate.coulomb_friction,
        static=gate.static_friction,
        stribeck_speed=gate.stribeck_speed,
        viscous=gate.viscous_friction,
    )
    controller = Controller(
        period=gate.sample_period,
        speed_gain=gate.speed_gain,
        integral_gain=gate.integral_gain,
        anti_windup_rate=gate.anti_windup_rate,
        slew_limit=gate.force_slew_limit,
        force_limit=gate.force_limit,
        speed_filter_hz=gate.speed_filter_frequency,
        force_lag=gate.current_lag,
    )
    sensors = Sensors(
        torque_filter_time=gate.torque_filter_time,
        accelerometer_hz=gate.accelerometer_frequency,
        accelerometer_damping=gate.accelerometer_damping,
    )
    return AxisModel(drive=drive, friction=friction, controller=controller, sensors=sensors)


def stiff_obstacle(gate: GateParameters) -> Obstacle:
    return Obstacle.spring(gate.load_cell_stiffness, gate.load_cell_damping)


def soft_obstacle(gate: GateParameters) -> Obstacle:
    """The bumper before the load cell; its last section is as stiff as the bottomed bumper."""
    buckling = gate.bumper_stiffness * gate.bumper_buckling_travel
    bottom = buckling + gate.bumper_buckled_stiffness * (gate.bumper_bottom_travel - gate.bumper_buckling_travel)
    return Obstacle(
        (0.0, gate.bumper_buckling_travel, gate.bumper_bottom_travel, gate.bumper_bottom_travel + 0.01),
        (0.0, buckling, bottom, bottom + 0.01 * gate.bumper_bottom_stiffness),
        gate.bumper_damping,
        gate.load_cell_stiffness,
    )

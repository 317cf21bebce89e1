"""The sensors of a study file, with the noise, steps and filters that they have or are assumed to have."""

from __future__ import annotations

import math

from cdtool.impact.sensors import Sensor
from cdtool.workflows.study.joint import StudiedJoint
from cdtool.workflows.study.number_reader import StudyReader

_GRAVITY = 9.80665


def studied_sensors(part: StudiedJoint, reader: StudyReader) -> tuple[Sensor, ...]:
    """From the contact to the controller; an encoder gives two, the motor's position and its speed."""
    lever = part.lever
    why = f"what accelerates the whole mass by 1 m/s2{' at the contact' if part.rotary else ''}"
    rated = reader.number("drive", "rated_force", part.mass * lever, part.unit("N"), why, above=0.0) / lever
    torque = (part, reader, rated, lever)
    return (
        _force_sensor("load_cell", "at the contact", "contact_force", (part, reader, rated, 1.0), 0.001, 500.0),
        _force_sensor("torque_sensor", "in the drive", "drive_force", torque, 0.002, 500.0),
        _accelerometer(reader),
        *_encoder(part, reader),
        _force_sensor("motor_torque", "control action", "motor_force", torque, 0.01, 200.0),
    )


def _force_sensor(
    name: str,
    place: str,
    quantity: str,
    scales: tuple[StudiedJoint, StudyReader, float, float],
    share: float,
    bandwidth: float,
) -> Sensor:
    part, reader, rated, lever = scales
    table, unit = f"sensors.{name}", "N" if lever == 1.0 and name == "load_cell" else part.unit("N")
    why = f"{100.0 * share:g} % of the rated force"
    return Sensor(
        name,
        place,
        quantity,
        "N",
        reader.number(table, "noise", share * rated * lever, unit, why, minimum=0.0) / lever,
        reader.number(table, "resolution", 0.0, unit, minimum=0.0) / lever,
        reader.number(table, "bandwidth", bandwidth, "Hz", above=0.0),
        reader.number(table, "sample_rate", 1000.0, "Hz", above=0.0),
    )


def _accelerometer(reader: StudyReader) -> Sensor:
    table, unit = "sensors.accelerometer", "m/s2"
    bandwidth = reader.number(table, "bandwidth", 100.0, "Hz", above=0.0)
    density = reader.number(table, "noise_density", 300e-6 * _GRAVITY, "m/s2/sqrt(Hz)", "300 ug/sqrt(Hz)", minimum=0.0)
    vibration = reader.number(table, "vibration", 0.1, unit, "of the moving structure, rms", minimum=0.0)
    # A first-order low-pass lets noise of pi/2 times its corner through.
    noise = math.hypot(density * math.sqrt(0.5 * math.pi * bandwidth), vibration)
    resolution = reader.number(table, "resolution", _GRAVITY / 4096, unit, "1/4096 g", minimum=0.0)
    rate = reader.number(table, "sample_rate", 1000.0, "Hz", above=0.0)
    return Sensor("accelerometer", "on the load", "load_acceleration", unit, noise, resolution, bandwidth, rate)


def _encoder(part: StudiedJoint, reader: StudyReader) -> tuple[Sensor, Sensor]:
    table = "sensors.encoder"
    counts = reader.number(table, "counts_per_turn", 4096.0, "", "12 bit, on the motor", minimum=1.0)
    rate = reader.number(table, "sample_rate", 1000.0, "Hz", above=0.0)
    bandwidth = reader.number(table, "speed_bandwidth", 60.0, "Hz", "low-pass after the difference", above=0.0)
    speed_noise = reader.number(table, "speed_noise", 0.0, "m/s", "ripple of the speed", minimum=0.0)
    noise = reader.number(table, "position_noise", 0.0, "m", "scatter of the impact-free position", minimum=0.0)
    step = 2.0 * math.pi * part.ratio / counts
    return (
        Sensor("motor_position", "on the motor", "motor_position", "m", noise, step, math.inf, rate),
        Sensor("motor_speed", "on the motor", "motor_position", "m/s", speed_noise, step, bandwidth, rate, True),
    )

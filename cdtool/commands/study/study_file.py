"""Read the impact to simulate and the sensors to rank from a machine and a study file; defaults are reported.

All values are on the load side. A rotary axis is referred to the contact: with the lever l inertia J/l^2, ratio n l,
stiffness k/l^2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.remote.remote_path import location
from cdtool.base.settings import NotNegative, Place, Positive, read, setting
from cdtool.commands.judging.settings_table import apply_settings
from cdtool.formats.machine_file import MachineFile
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.drives import SpeedController
from cdtool.impact.sensor_ranking import ImpactCase
from cdtool.impact.sensors import Sensor
from cdtool.impact.transmissions.transmission import ElasticTransmission
from cdtool.machines.axis import Axis
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.joint_machine import LINEAR_UNITS, ROTARY_UNITS, JointMachine
from cdtool.recordings.units import STANDARD_GRAVITY

# Defaults [Hz] where a study states none, of the size that gates and axes have; each is reported.
_DRIVE_FREQUENCY, _LOOP_FREQUENCY = 10.0, 2.0


# A number that has a default, which depends on the machine and is reported.
_Above = Positive | None
_AtLeast = NotNegative | None


@dataclass(frozen=True, kw_only=True)
class ImpactTable:
    """[impact]: the contact; SI units, at the contact."""

    speed: _Above = None
    stiffness: _Above = None
    damping_factor: _AtLeast = None
    window: _Above = None
    first_frequency: _Above = None
    lever: _Above = None


@dataclass(frozen=True, kw_only=True)
class DriveTable:
    """[drive]: between motor and load."""

    stiffness: _Above = None
    damping_ratio: _AtLeast = None
    rated_force: _Above = None


@dataclass(frozen=True, kw_only=True)
class ControllerTable:
    """[controller]: of the speed."""

    proportional: _Above = None
    integral: _AtLeast = None
    actuator_time: _Above = None
    derivative: _AtLeast = None
    derivative_time: _Above = None
    slew_limit: _Above = None
    force_limit: _Above = None


@dataclass(frozen=True, kw_only=True)
class ForceSensorTable:
    """[sensors.NAME] of a force or torque."""

    noise: _AtLeast = None
    resolution: _AtLeast = None
    bandwidth: _Above = None
    sample_rate: _Above = None


@dataclass(frozen=True, kw_only=True)
class AccelerometerTable:
    """[sensors.accelerometer]."""

    bandwidth: _Above = None
    noise_density: _AtLeast = None
    vibration: _AtLeast = None
    resolution: _AtLeast = None
    sample_rate: _Above = None


@dataclass(frozen=True, kw_only=True)
class EncoderTable:
    """[sensors.encoder]."""

    counts_per_turn: Annotated[float, Meta(ge=1.0)] | None = None
    sample_rate: _Above = None
    speed_bandwidth: _Above = None
    speed_noise: _AtLeast = None
    position_noise: _AtLeast = None


@dataclass(frozen=True, kw_only=True)
class SensorsTable:
    """[sensors]."""

    load_cell: ForceSensorTable = ForceSensorTable()
    torque_sensor: ForceSensorTable = ForceSensorTable()
    accelerometer: AccelerometerTable = AccelerometerTable()
    encoder: EncoderTable = EncoderTable()
    motor_torque: ForceSensorTable = ForceSensorTable()


@dataclass(frozen=True, kw_only=True)
class StudyTable:
    """A study file as it is written; docs/study.md has the meaning of each key and its default."""

    joint: Annotated[
        str, setting("the joint that is hit while the others are at rest; required if there are several")
    ] = ""
    factor: Annotated[
        Positive, setting("a sensor has responded beyond this many standard deviations of its noise", key="k")
    ] = 5.0
    impact: ImpactTable = ImpactTable()
    drive: DriveTable = DriveTable()
    controller: ControllerTable = ControllerTable()
    sensors: SensorsTable = SensorsTable()


@dataclass(frozen=True)
class Study:
    """What to simulate and rank, the load's first natural frequency [Hz] if known, and the assumptions made."""

    joint: str
    factor: float
    case: ImpactCase
    sensors: tuple[Sensor, ...]
    first_frequency: float | None
    assumptions: tuple[str, ...]


def read_study(machine: MachineFile, file: str | Path | None, settings: Mapping[str, Any] | None = None) -> Study:
    """Read the impact and the sensors; `settings` take the place of keys of the file, as "impact.speed".

    Raises UsageError, or ConfigurationError naming file and key; the inertias are required.
    """
    given = settings or {}
    place = Place(str(file or "study"), by_option=frozenset(given))
    values = read_toml(location(file), "a study file") if file else {}
    table = read(StudyTable, apply_settings(values, given), place)
    place.finish()
    assert table is not None
    reader = StudyReader(table)
    part = _studied_joint(machine, table.joint, reader)
    case = _case(part, reader)
    frequency = reader.optional("impact", "first_frequency", "the load is rigid except for its drive")
    sensors = _sensors(part, reader)
    return Study(part.name, table.factor, case, sensors, frequency, tuple(reader.assumed))


def _case(part: StudiedJoint, reader: StudyReader) -> ImpactCase:
    speed = reader.number("impact", "speed", 0.2, "m/s", "at the contact")
    stiffness = reader.number("impact", "stiffness", 5e5, "N/m")
    factor = reader.number("impact", "damping_factor", 0.0, "s/m")
    obstacle = HuntCrossley(stiffness, factor * stiffness, 1.0)
    window = reader.number("impact", "window", 0.5, "s", "length of the simulation")
    angular = 2.0 * math.pi * _DRIVE_FREQUENCY
    why = f"the load oscillates at {_DRIVE_FREQUENCY:g} Hz on the drive with the motor at rest"
    default = part.load_mass * angular**2 * part.square
    drive = reader.number("drive", "stiffness", default, part.unit("N/m"), why) / part.square
    ratio = reader.number("drive", "damping_ratio", 0.05, "", "of that oscillation")
    square = part.ratio**2
    transmission = ElasticTransmission(
        part.motor_inertia,
        part.load_mass,
        part.ratio,
        drive * square,
        2.0 * ratio * math.sqrt(drive * part.load_mass) * square,
        part.motor_friction,
    )
    controller = _controller(part, reader)
    needed = transmission.steady_torque(speed)
    if controller.torque_limit < needed:
        unit = part.unit("N")
        limit, steady = (value / part.ratio * part.lever for value in (controller.torque_limit, needed))
        raise UsageError(
            f"controller.force_limit is {limit:.4g} {unit}, but steady motion requires {steady:.4g} {unit}",
            "use a larger limit, or less friction or speed",
        )
    return ImpactCase(transmission, controller, obstacle, speed, window)


def _controller(part: StudiedJoint, reader: StudyReader) -> SpeedController:
    angular = 2.0 * math.pi * _LOOP_FREQUENCY
    why = f"a speed loop of {_LOOP_FREQUENCY:g} Hz for the whole mass"
    default = part.mass * angular * part.square
    proportional = reader.number("controller", "proportional", default, part.unit("N s/m"), why)
    default = 0.25 * angular * proportional
    integral = reader.number("controller", "integral", default, part.unit("N/m"), "critically damped")
    lag = reader.number("controller", "actuator_time", 0.002, "s", "lag of the current loop")
    derivative = reader.number("controller", "derivative", 0.0, part.unit("N s2/m"))
    filtered = reader.number("controller", "derivative_time", 0.002, "s", "low-pass of the derivative")
    slew = reader.tables["controller"].slew_limit or math.inf
    limit = reader.optional("controller", "force_limit", "the drive is not stopped") or math.inf
    to_motor, to_torque = part.ratio**2 / part.square, part.ratio / part.lever
    return SpeedController(
        0.0,
        proportional * to_motor,
        integral * to_motor,
        lag,
        slew_limit=slew * to_torque,
        derivative=derivative * to_motor,
        derivative_time=filtered,
        torque_limit=limit * to_torque,
    )


def _sensors(part: StudiedJoint, reader: StudyReader) -> tuple[Sensor, ...]:
    """Return the sensors from the contact to the controller, with stated or assumed noise, steps and filters.

    An encoder counts as two sensors: the motor's position and its speed.
    """
    lever = part.lever
    why = f"accelerates the whole mass by 1 m/s2{' at the contact' if part.rotary else ''}"
    rated = reader.number("drive", "rated_force", part.mass * lever, part.unit("N"), why) / lever
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
        reader.number(table, "noise", share * rated * lever, unit, why) / lever,
        reader.number(table, "resolution", 0.0, unit) / lever,
        reader.number(table, "bandwidth", bandwidth, "Hz"),
        reader.number(table, "sample_rate", 1000.0, "Hz"),
    )


def _accelerometer(reader: StudyReader) -> Sensor:
    table, unit = "sensors.accelerometer", "m/s2"
    bandwidth = reader.number(table, "bandwidth", 100.0, "Hz")
    density = reader.number(table, "noise_density", 300e-6 * STANDARD_GRAVITY, "m/s2/sqrt(Hz)", "300 ug/sqrt(Hz)")
    vibration = reader.number(table, "vibration", 0.1, unit, "of the moving structure, rms")
    # A first-order low-pass has a noise bandwidth of pi/2 times its corner frequency.
    noise = math.hypot(density * math.sqrt(0.5 * math.pi * bandwidth), vibration)
    resolution = reader.number(table, "resolution", STANDARD_GRAVITY / 4096, unit, "1/4096 g")
    rate = reader.number(table, "sample_rate", 1000.0, "Hz")
    return Sensor("accelerometer", "on the load", "load_acceleration", unit, noise, resolution, bandwidth, rate)


def _encoder(part: StudiedJoint, reader: StudyReader) -> tuple[Sensor, Sensor]:
    table = "sensors.encoder"
    counts = reader.number(table, "counts_per_turn", 4096.0, "", "12 bit, on the motor")
    rate = reader.number(table, "sample_rate", 1000.0, "Hz")
    bandwidth = reader.number(table, "speed_bandwidth", 60.0, "Hz", "low-pass after the difference")
    speed_noise = reader.number(table, "speed_noise", 0.0, "m/s", "ripple of the speed")
    noise = reader.number(table, "position_noise", 0.0, "m", "variation of the impact-free position")
    step = 2.0 * math.pi * part.ratio / counts
    return (
        Sensor("motor_position", "on the motor", "motor_position", "m", noise, step, math.inf, rate),
        Sensor("motor_speed", "on the motor", "motor_position", "m/s", speed_noise, step, bandwidth, rate, True),
    )


@dataclass(frozen=True)
class StudiedJoint:
    """A joint referred to the contact: `load_mass` [kg], `motor_inertia` [kg m2], `ratio` [m/rad], `motor_friction`.

    `motor_friction` is at the motor [N m s/rad]. The contact with a rotary joint is at `lever` l [m] from its axis, so
    its inertia there is J/l^2 and its ratio n l; the lever of a linear joint is 1.
    """

    name: str
    load_mass: float
    motor_inertia: float
    ratio: float
    motor_friction: float
    lever: float
    rotary: bool

    @property
    def square(self) -> float:
        """Return l^2 [m2]: a joint stiffness [N m/rad] divided by it is that at the contact [N/m]."""
        return self.lever**2

    @property
    def mass(self) -> float:
        """Return the mass of load and motor at the contact [kg]."""
        return self.load_mass + self.motor_inertia / self.ratio**2

    def unit(self, linear: str) -> str:
        """Return the load-side unit: N/m of a linear axis is N m/rad of a rotary one."""
        return linear.replace("/m", "/rad").replace("N", "N m") if self.rotary else linear


def _studied_joint(file: MachineFile, wanted: str, reader: StudyReader) -> StudiedJoint:
    """Return the joint `wanted` ("" if there is only one) of a machine with joints.

    For an arm or a robot with coupled joints, the others are assumed at rest: the inertia is the diagonal of M. Raises
    UsageError for an unknown joint and a missing or meaningless lever, ConfigurationError for a missing inertia.
    """
    machine = file.machine
    if not isinstance(machine, Axis | CoupledMachine) or machine.load_units not in (LINEAR_UNITS, ROTARY_UNITS):
        raise ConfigurationError(
            f"{file.path}: no joint of this machine can be studied", "its joints must all rotate or all slide"
        )
    if not wanted and len(machine.joints) > 1:
        names = ", ".join(machine.joints)
        raise UsageError(f"{file.path} has {len(machine.joints)} joints", f"set joint to one of them: {names}")
    if wanted and wanted not in machine.joints:
        raise UsageError(f"{file.path} has no joint '{wanted}'", nearest(wanted, machine.joints))
    at = machine.joints.index(wanted) if wanted else 0
    load, motor = _load_inertia(machine, at), machine.motor_inertia[at]
    key = machine.inertia_key if isinstance(machine, Axis) else "the load's inertia"
    needs = "a study requires the inertias of load and motor"
    if machine.coordinates == "load":
        needs += ": set coordinates = 'motor' with motor_inertia and transmission_ratio"
    for name, value in ((key, load), ("motor_inertia", motor)):
        if value <= 0.0:
            raise ConfigurationError(f"{file.path}: machine.{name} is missing or 0", needs)
    rotary = machine.load_units == ROTARY_UNITS
    lever = _lever(machine, rotary, reader)
    if not isinstance(machine, Axis):
        inertia = f"{load:.4g} {'kg m2' if rotary else 'kg'}"
        reader.assumed.append(f"the other joints are at rest: {inertia} at {machine.joints[at]}, without its motor")
    ratio = abs(machine.transmission_ratio[at]) * lever
    return StudiedJoint(machine.joints[at], load / lever**2, motor, ratio, machine.viscous_friction[at], lever, rotary)


def _load_inertia(machine: Axis | CoupledMachine, at: int) -> float:
    """Return the inertia without the motor [kg m2, kg]; for coupled joints the diagonal of M in the home position."""
    if isinstance(machine, Axis):
        return machine.load_inertia[at]
    return float(machine.nominal_inertia[at] - machine.reflected_inertia[at])


def _lever(machine: JointMachine, rotary: bool, reader: StudyReader) -> float:
    given = reader.tables["impact"].lever is not None
    if not rotary:
        if given:
            raise UsageError("a lever is given for a linear axis", "use it only for a rotary axis")
        return 1.0
    if not given and not isinstance(machine, Axis):
        raise UsageError("no lever is given", "set impact.lever, the distance from the joint's axis to the contact [m]")
    return reader.number("impact", "lever", 1.0, "m", "contact to axis")


class StudyReader:
    """Tables of a study by their names; `assumed` has a line for every default used."""

    def __init__(self, table: StudyTable) -> None:
        self.tables: dict[str, Any] = {name: getattr(table, name) for name in ("impact", "drive", "controller")}
        self.tables |= {f"sensors.{item.name}": getattr(table.sensors, item.name) for item in fields(SensorsTable)}
        self.assumed: list[str] = []

    def number(self, table: str, key: str, default: float, unit: str, why: str = "") -> float:
        """Return a number of a table; a default is reported with its reason."""
        given: float | None = getattr(self.tables[table], key)
        if given is None:
            self.assumed.append(f"{table}.{key} = {default:.4g} {unit}".rstrip() + (f": {why}" if why else ""))
            return default
        return given

    def optional(self, table: str, key: str, none: str) -> float | None:
        """Return a positive number that may be missing; the consequence of a missing one is reported."""
        given: float | None = getattr(self.tables[table], key)
        if given is None:
            self.assumed.append(f"{table}.{key} = none: {none}")
        return given

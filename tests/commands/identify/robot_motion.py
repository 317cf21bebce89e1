"""Exciting motion of robots, the robots that perform it, and the recordings of the UR10e, for several test modules."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError
from importlib.metadata import files as files_of_package
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.robot.robot_dynamics import RobotFit
from cdtool.commands.identify.robot.robot_regressor import regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun, robot_run
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot
from tests.data_folder import UR10E_LOGS

FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
PANDA_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))


@dataclass(frozen=True, eq=False)
class Motion:
    """A finite Fourier series: position, speed, acceleration (n, J), every `period` [s]."""

    period: float
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    def run(self, machine: CoupledMachine, noise: FloatArray | float = 0.0, name: str = "run") -> RobotRun:
        torque = machine.required_torque(self.position, self.speed, self.acceleration)
        return RobotRun(name, 0.0, self.period, torque + noise, self.position, self.speed)


def fourier(seed: int, joints: int, duration: float = 20.0, period: float = 0.005, amplitude: float = 0.5) -> Motion:
    """Five harmonics of 0.1 Hz with random amplitudes [rad] about a random pose (Swevers and others, 1997)."""
    rng = np.random.default_rng(seed)
    phase = 2.0 * np.pi * 0.1 * period * np.arange(round(duration / period))[:, np.newaxis]
    position = np.zeros((len(phase), joints)) + rng.uniform(-1.0, 1.0, joints)
    speed, acceleration = np.zeros_like(position), np.zeros_like(position)
    for harmonic in range(1, 6):
        a, b = rng.normal(size=(2, joints)) * amplitude / math.sqrt(harmonic)
        rate = 2.0 * np.pi * 0.1 * harmonic
        sine, cosine = np.sin(harmonic * phase), np.cos(harmonic * phase)
        position += a * sine + b * cosine
        speed += rate * (a * cosine - b * sine)
        acceleration -= rate**2 * (a * sine + b * cosine)
    return Motion(period, position, speed, acceleration)


def coloured(seed: int, shape: tuple[int, int], samples: float) -> FloatArray:
    """First-order noise of variance 1 with this correlation time [samples]; white for 0."""
    from scipy.signal import lfilter

    white = np.random.default_rng(seed).normal(size=shape)
    pole = math.exp(-1.0 / samples) if samples else 0.0
    return np.asarray(lfilter([math.sqrt(1.0 - pole**2)], [1.0, -pole], white, axis=0))


def panda_urdf() -> Path:
    """The URDF of a robot with seven joints; skips the test if example-robot-data is not installed."""
    try:
        found = files_of_package("example-robot-data") or []
    except PackageNotFoundError:
        found = []
    for file in found:
        if file.as_posix().endswith("panda_description/urdf/panda.urdf"):
            return Path(str(file.locate()))
    pytest.skip("example-robot-data is not installed")


def panda(folder: Path, **keys: object) -> UrdfRobot:
    values = {
        "urdf": str(panda_urdf()),
        "joints": list(PANDA_JOINTS),
        "locked": FINGERS,
        "viscous_friction": [3.0, 3.0, 2.0, 2.0, 1.0, 1.0, 0.5],
        "coulomb_friction": [4.0, 4.0, 3.0, 3.0, 1.5, 1.5, 1.0],
        "coulomb_slope": 50.0,
        "constant_force": [0.3, -0.2, 0.1, 0.2, -0.1, 0.05, 0.1],
        **keys,
    }
    return UrdfRobot.of(values, str(folder / "machine.toml"))


def planar_arm(**keys: object) -> PlanarArm:
    """The arm of thesis chapter 6, motor inertias and friction at the motors."""
    values = {
        "link_mass": [1.3, 1.6],
        "link_length": 0.3,
        "centre_of_mass": [0.14, 0.18],
        "link_inertia": [0.012, 0.018],
        "motor_inertia": 1.5e-5,
        "transmission_ratio": 1.0 / 60.0,
        "viscous_friction": [1.1e-4, 0.8e-4],
        "coulomb_friction": [0.04, 0.03],
        "constant_force": [0.005, -0.002],
        **keys,
    }
    return PlanarArm.of(values)


# Seconds after the first row, as in docs/examples/ur10e_collisions.py: where an abrupt stop begins, and contacts.
UR10E_ENDS = {"no_torque.csv.gz": 5.0, "link4.csv.gz": 16.93, "ur-static.csv.gz": math.inf}
_UR10E_CONTACTS = {
    "no_torque.csv.gz": (),
    "link4.csv.gz": ((3.46, 4.14), (9.67, 9.96), (16.63, 16.93)),
    "ur-static.csv.gz": ((3.4, 5.7), (11.8, 15.9), (25.6, 31.0), (38.0, 43.0)),
}
_BEFORE, _AFTER = 0.25, 0.5


def ur10e(folder: Path) -> MachineFile:
    """The machine with the URDF's inertias, and friction and drive inertias as published with it."""
    values = json.loads((UR10E_LOGS / "parameters.json").read_text(encoding="utf-8"))
    friction = values["friction"]
    text = f"""[machine]
type = "urdf_robot"
urdf = "{(UR10E_LOGS / "ur10e.urdf").as_posix()}"
joints = {json.dumps(values["joints"])}
drive_inertia = {values["drive_inertia"]["value"]}
viscous_friction = {friction["viscous"]["value"]}
coulomb_friction = {friction["coulomb"]["value"]}
coulomb_slope = {friction["tanh_slope"]["value"]}
constant_force = {friction["offset"]["value"]}

[channels]
time = {{ column = 0, unit = "s" }}
position = {{ columns = [1, 2, 3, 4, 5, 6], unit = "rad" }}
speed = {{ columns = [7, 8, 9, 10, 11, 12], unit = "rad/s" }}
torque = {{ columns = [13, 14, 15, 16, 17, 18], unit = "A", scale = {values["torque_gain"]["value"]} }}
"""
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return read_machine_file(path)


def ur10e_run(machine: MachineFile, name: str) -> RobotRun:
    """A recording without its stop; torques near contacts are NaN."""
    recording = cdtool.read(UR10E_LOGS / f"{name}", machine)
    run = robot_run(recording.between(recording.start, recording.start + UR10E_ENDS[name]))
    time = run.time - recording.start
    near: BoolArray = np.zeros(len(run), dtype=np.bool_)
    for start, end in _UR10E_CONTACTS[name]:
        near |= (time > start - _BEFORE) & (time < end + _AFTER)
    return run.without(near)


def predicted_torque(fit: RobotFit, run: RobotRun) -> FloatArray:
    """The torque (n, J) that a fit needs for a run's motion; NaN for a joint at rest."""
    machine, regressor, acceleration = fit.machine, regressor_of(fit.machine), run.acceleration()
    torque = machine.required_torque(run.position, run.speed, acceleration)
    change = fit.parameters - regressor.values
    for column in np.flatnonzero(change).tolist():
        torque += change[column] * regressor.torque(column, run.position, run.speed, acceleration)
    torque[np.abs(run.speed) < np.array(machine.stick_speed)] = np.nan
    return torque


def write_log(path: Path, run: RobotRun) -> Path:
    """Write a run as a CSV log: time [s], then torques t0.., positions q0.., speeds v0.. on the load side."""
    joints = range(run.joint_count)
    header = ",".join(["t", *(f"{name}{j}" for name in "tqv" for j in joints)])
    table = np.column_stack((run.time, run.torque, run.position, run.speed))
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=header, comments="")
    return path


def channels_of(joints: int, scale: str = "") -> str:
    """The [channels] of `write_log`; with a scale the torques are currents."""
    unit = f'unit = "A", scale = {scale}' if scale else 'unit = "N m"'
    columns = {name: str([f"{name}{j}" for j in range(joints)]).replace("'", '"') for name in "tqv"}
    return f"""
[channels]
time = {{ column = "t", unit = "s" }}
torque = {{ columns = {columns["t"]}, {unit} }}
position = {{ columns = {columns["q"]}, unit = "rad" }}
speed = {{ columns = {columns["v"]}, unit = "rad/s" }}
"""


# The file of the planar arm on the load side.
ARM = """[machine]
type = "planar_arm"
coordinates = "load"
link_mass = [1.3, 1.6]
link_length = 0.3
centre_of_mass = [0.14, 0.18]
link_inertia = [0.012, 0.018]
coulomb_slope = 50.0
"""
# The arm as it is: friction on the load side, which the file does not have.
TRUE = replace(
    planar_arm(),
    coordinates="load",
    motor_inertia=(0.0, 0.0),
    transmission_ratio=(1.0, 1.0),
    viscous_friction=(0.4, 0.3),
    coulomb_friction=(2.4, 1.8),
    coulomb_slope=(50.0, 50.0),
    constant_force=(0.3, -0.1),
)


def files(folder: Path, machine: CoupledMachine, text: str, motions: list[Motion], noise: float = 0.05) -> Path:
    """The machine file, and a log of each motion; returns the machine file."""
    for number, motion in enumerate(motions):
        run = motion.run(machine, noise * coloured(number, motion.position.shape, 5.0))
        write_log(folder / f"run{number}.csv", run)
    path = folder / "machine.toml"
    path.write_text(text + channels_of(motions[0].position.shape[1]), encoding="utf-8")
    return path

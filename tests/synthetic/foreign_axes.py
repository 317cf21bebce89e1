"""Axes with drives that wind up, simulated without anything of cdtool: parameters that are drawn, and their logs.

Two masses (motor, leaf) with a drive of one stiffness, with a take-up before a second stiffness, or one that stiffens
with the cube of the wind-up; Coulomb friction on both sides, Stribeck and viscous friction and waves along the track on
the leaf; a PI speed controller with a torque limit; an encoder with steps, torque noise and a clock that jitters.
Integrated by the semi-implicit Euler method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from cdtool.commands.identify.identifying import IdentifiedMachine

FloatArray = npt.NDArray[np.float64]

STEP = 2.5e-4  # of the integration [s]
CONTROL = 4  # steps of the integration per period of the controller
REST, PAUSE, HELD = 0.5, 0.6, 1.5  # before the motion, between the directions, at the speed of a run [s]
DRIVES = ("one stiffness", "take-up", "stiffening")
MOTIONS = ("3 speeds, both ways", "1 speed, one way")


@dataclass(frozen=True, kw_only=True)
class ForeignAxis:
    """What is drawn of one axis, on the load side in SI units; `motion` is one of `MOTIONS`."""

    number: int
    drive: str
    motion: str
    motor_mass: float
    leaf_mass: float
    stiffness: float
    end_stiffness: float
    take_up: float
    damping: float
    coulomb: float
    motor_coulomb: float
    rise: float
    stribeck_speed: float
    viscous: float
    waviness: float
    speed: float
    acceleration: float
    gain: float
    integral_gain: float
    rate: float
    jitter: float
    encoder_step: float
    torque_noise: float
    references: bool
    ratio: float = 2e-3

    @property
    def truth(self) -> dict[str, float]:
        """What `cdtool identify` can print of it, by key; friction of the motor adds to that of the leaf."""
        coulomb = self.coulomb + self.motor_coulomb
        stiffness = {"model.drive.stiffness": self.stiffness} if self.drive != "stiffening" else {}
        return stiffness | {
            "machine.load_mass": self.leaf_mass,
            "machine.coulomb_friction": coulomb * self.ratio,
            "machine.viscous_friction": self.viscous * self.ratio**2,
            "model.friction.coulomb_forward": coulomb,
            "model.friction.viscous": self.viscous,
            "model.friction.static": coulomb + self.rise,
        }

    def friction_at(self, speed: float) -> float:
        """The mean friction in steady motion [N]."""
        rise = self.rise * math.exp(-((speed / self.stribeck_speed) ** 2))
        return self.coulomb + self.motor_coulomb + rise + self.viscous * speed


def drawn(number: int) -> ForeignAxis:
    """Axis `number`: drive and motion follow from the number, everything else is drawn."""
    rng = np.random.default_rng([37, number])
    stiffness = rng.uniform(6e4, 12e4)
    return ForeignAxis(
        number=number,
        drive=DRIVES[number % 3],
        motion=MOTIONS[number // 3 % 2],
        motor_mass=rng.uniform(200.0, 500.0),
        leaf_mass=rng.uniform(450.0, 800.0),
        stiffness=stiffness,
        end_stiffness=stiffness * rng.uniform(6.0, 15.0),
        take_up=rng.uniform(1.5e-3, 4e-3),
        damping=rng.uniform(100.0, 400.0),
        coulomb=rng.uniform(80.0, 200.0),
        motor_coulomb=rng.uniform(5.0, 30.0),
        rise=rng.uniform(0.0, 50.0),
        stribeck_speed=rng.uniform(0.01, 0.04),
        viscous=rng.uniform(100.0, 400.0),
        waviness=rng.uniform(0.01, 0.06),
        speed=rng.uniform(0.2, 0.4),
        acceleration=rng.uniform(0.25, 0.6),
        gain=rng.uniform(4e3, 1e4),
        integral_gain=rng.uniform(6e3, 3e4),
        rate=float(rng.choice([250.0, 500.0, 1000.0], p=[0.6, 0.3, 0.1])),
        jitter=rng.uniform(0.0, 0.1),
        encoder_step=float(rng.choice([2e-7, 1e-6, 3e-6])),
        torque_noise=rng.uniform(1.0, 8.0),
        references=bool(rng.random() < 0.5),
    )


def _references(axis: ForeignAxis) -> list[FloatArray]:
    """The speed reference (n,) of each run: a ramp up to its speed and down again, and back if it goes both ways."""
    both = axis.motion == MOTIONS[0]
    profiles = []
    for share in (0.4, 0.7, 1.0) * 2 if both else (1.0,) * 6:
        speed = share * axis.speed
        ramp = speed / axis.acceleration
        corners = np.cumsum([REST, ramp, HELD / share, ramp, PAUSE])
        values = np.array([0.0, speed, speed, 0.0, 0.0])
        if both:
            corners = np.concatenate((corners, corners[-1] - REST + corners))
            values = np.concatenate((values, -values))
        profiles.append(np.interp(np.arange(round(corners[-1] / STEP)) * STEP, corners, values))
    return profiles


def _integrated(
    reference: FloatArray, masses: FloatArray, drive: FloatArray, friction: FloatArray, control: FloatArray
) -> FloatArray:
    """Motor torque and motor position (2, n) of one run along its reference (n,)."""
    motor_mass, leaf_mass = masses
    stiffness, end_stiffness, take_up, cubic, damping = drive
    coulomb, motor_coulomb, rise, stribeck_speed, viscous, factor, waviness = friction[:7]
    gain, integral_gain, limit, encoder_step = control
    logged = np.empty((2, len(reference)))
    x_motor = v_motor = x_leaf = v_leaf = integral = torque = measured = before = 0.0
    for index in range(len(reference)):
        if index % CONTROL == 0:
            # The controller sees the encoder's steps through a low-pass of 80 Hz.
            position = np.round(x_motor / encoder_step) * encoder_step
            measured += 0.4 * ((position - before) / (CONTROL * STEP) - measured)
            before = position
            error = reference[index] - measured
            wanted = gain * error + integral
            torque = min(max(wanted, -limit), limit)
            integral += (integral_gain * error + 10.0 * (torque - wanted)) * CONTROL * STEP
        wind_up = x_motor - x_leaf
        force = stiffness * wind_up * (1.0 + cubic * wind_up**2) + damping * (v_motor - v_leaf)
        force += np.sign(wind_up) * (end_stiffness - stiffness) * max(abs(wind_up) - take_up, 0.0)
        track = 1.0
        for wave in range(7, len(friction), 2):
            track += waviness * np.sin(2.0 * np.pi * x_leaf / friction[wave] + friction[wave + 1])
        dry = factor * (coulomb * track + rise * np.exp(-((v_leaf / stribeck_speed) ** 2)))
        v_motor += STEP * (torque - force - motor_coulomb * np.tanh(v_motor / 1e-3)) / motor_mass
        v_leaf += STEP * (force - dry * np.tanh(v_leaf / 1e-3) - viscous * v_leaf) / leaf_mass
        x_motor, x_leaf = x_motor + STEP * v_motor, x_leaf + STEP * v_leaf
        logged[:, index] = torque, x_motor
    return logged


_compiled: Any = njit(_integrated)


def _run(axis: ForeignAxis, reference: FloatArray, factor: float, waves: FloatArray) -> FloatArray:
    """Motor torque and motor position (2, n) of a run whose friction is `factor` times the usual one."""
    total = axis.motor_mass + axis.leaf_mass
    limit = 1.5 * (total * axis.acceleration + axis.friction_at(axis.speed) + axis.rise)
    end = axis.end_stiffness if axis.drive == "take-up" else axis.stiffness
    cubic = 1.0 / axis.take_up**2 if axis.drive == "stiffening" else 0.0
    friction = (axis.coulomb, axis.motor_coulomb, axis.rise, axis.stribeck_speed, axis.viscous, factor, axis.waviness)
    logged: FloatArray = _compiled(
        reference,
        np.array([axis.motor_mass, axis.leaf_mass]),
        np.array([axis.stiffness, end, axis.take_up, cubic, axis.damping]),
        np.array([*friction, *waves]),
        np.array([axis.gain, axis.integral_gain, limit, axis.encoder_step]),
    )
    return logged


MACHINE = """[machine]
type = "linear_axis"
name = "axis {number}"
motor_inertia = {inertia!r}
load_mass = 1.0
transmission_ratio = {ratio!r}
viscous_friction = 0.0
coulomb_friction = 0.0

[channels]
time = {{ column = "Time", unit = "s" }}
torque = {{ column = "Trq", unit = "N m" }}
speed = {{ column = "ActVel", unit = "rad/s" }}
position = {{ column = "ActPos", unit = "rad" }}
"""


def write_logs(axis: ForeignAxis, folder: Path) -> tuple[list[Path], Path]:
    """Write a log of each run and the machine file, which knows the motor's inertia; return their paths."""
    rng = np.random.default_rng([38, axis.number])
    waves = np.ravel([(length, rng.uniform(0.0, 2.0 * np.pi)) for length in rng.uniform(0.06, 0.4, 3)])
    logs = []
    for run, reference in enumerate(_references(axis)):
        torque, position = _run(axis, reference, rng.normal(1.0, 0.02), waves)
        time = np.arange(len(reference)) * STEP
        stamps = np.arange(0.02, time[-1], 1.0 / axis.rate)
        stamps += rng.uniform(-axis.jitter, axis.jitter, len(stamps)) / axis.rate
        noise = rng.normal(0.0, axis.torque_noise, len(stamps))
        now, before = (np.interp(stamps - ago, time, position) for ago in (0.0, 4e-3))
        steps, earlier = (np.round(item / axis.encoder_step) * axis.encoder_step for item in (now, before))
        columns = [stamps, (np.interp(stamps, time, torque) + noise) * axis.ratio]
        columns += [(steps - earlier) / 4e-3 / axis.ratio, steps / axis.ratio]
        header = "Time,Trq,ActVel,ActPos"
        if axis.references:
            columns.append(np.interp(stamps, time, reference) / axis.ratio)
            header += ",SetVel"
        logs.append(folder / f"run{run}.csv")
        np.savetxt(logs[-1], np.stack(columns, axis=1), fmt="%.7g", delimiter=",", header=header, comments="")
    text = MACHINE.format(number=axis.number, inertia=axis.motor_mass * axis.ratio**2, ratio=axis.ratio)
    if axis.references:
        text += 'reference_speed = { column = "SetVel", unit = "rad/s" }\n'
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return logs, folder / "machine.toml"


def errors_by_key(truth: Mapping[str, float], done: IdentifiedMachine) -> dict[str, float]:
    """The error of each value in standard errors, by key; NaN if it was refused."""
    printed = {f"{item.section}.{item.key}": (item.values[0], item.standard_errors[0]) for item in done.changes}
    return {
        key: (printed[key][0] - value) / printed[key][1] if key in printed else math.nan for key, value in truth.items()
    }


def errors_of(axis: ForeignAxis, done: IdentifiedMachine) -> dict[str, float]:
    """The errors of the axis's values, and of its friction at speed, as of `errors_by_key`."""
    found = errors_by_key(axis.truth, done)
    (joint,) = done.joints
    levels = {item.direction: item for item in joint.rigid.levels} if joint.rigid else {}
    for direction, name in ((1, "forward"), (-1, "backward")) if axis.motion == MOTIONS[0] else ((1, "forward"),):
        level = levels.get(direction)
        error = math.nan if level is None else (level.force - axis.friction_at(level.speed)) / level.standard_error
        found[f"friction at speed, {name}"] = error
    return found

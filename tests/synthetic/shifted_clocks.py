"""Contacts of a rigid axis whose channels are logged on clocks with a known offset and drift.

The force of a contact is prescribed, and position and speed follow from it by integration: the data satisfy the balance
m dv/dt = u - friction - F, before noise, steps, filters and clocks are added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.machines.linear_axis import LinearAxis
from cdtool.recordings.recording import Contact, Recording, Series

MASS, FRICTION = 40.0, 25.0
# Below about this speed the axis sticks [m/s].
_STICK = 1e-3
# Integration step [s], and the length of a simulated stroke [s].
_STEP, _STROKE = 1e-4, 3.0


@dataclass(frozen=True)
class Clocks:
    """The load cell's clock against the machine's: offset [s], drift [s/s]; their rates [Hz] and jitter [s]."""

    offset: float = 0.0
    drift: float = 0.0
    machine_rate: float = 1000.0
    cell_rate: float = 1000.0
    jitter: float = 0.0

    def at(self, time: float) -> float:
        """Return by how much the load cell's stamps are late at a true time [s]."""
        return self.offset + self.drift * time


@dataclass(frozen=True)
class Sensors:
    """Noise and steps of the sensors, and the time constant of the load cell's low-pass [s]."""

    force_noise: float = 1.0
    force_step: float = 0.5
    torque_noise: float = 5.0
    speed_noise: float = 2e-3
    position_step: float = 1e-5
    cell_filter: float = 0.0


def axis() -> LinearAxis:
    """Return the machine: a mass with dry friction that the machine file knows only roughly."""
    return LinearAxis(
        name="axis", joints=("axis",), coordinates="load", motor_inertia=(0.0,), transmission_ratio=(1.0,),
        position_offset=(0.0,), viscous_friction=(0.0,), coulomb_friction=(0.8 * FRICTION,), coulomb_slope=(0.0,),
        constant_force=(0.0,), stick_speed=(1e-3,), load_inertia=(MASS,),
    )  # fmt: skip


def collisions(
    rng: np.random.Generator,
    starts: FloatArray,
    clocks: Clocks,
    sensors: Sensors = Sensors(),
    rises: tuple[float, float] = (0.004, 0.04),
    rebound: float = 0.1,
) -> tuple[Recording, list[Contact]]:
    """Return a log with one stroke per start time [s], each with a contact, and the contacts on the cell's clock.

    Between the strokes nothing is logged. `rises` [s] are the shortest and longest rise times of the force, `rebound`
    is the mean speed after the contact, by the one before it.
    """
    machine: dict[str, list[FloatArray]] = {"time": [], "speed": [], "position": [], "torque": []}
    cell: list[tuple[FloatArray, FloatArray]] = []
    contacts = []
    for start in starts:
        time, force, drive, speed, position, touch, end = _stroke(rng, rises, rebound)
        own = _stamps(rng, clocks.machine_rate, clocks.jitter)
        machine["time"].append(start + own)
        moved = np.interp(own, time, position)
        machine["position"].append(_rounded(moved, sensors.position_step))
        machine["speed"].append(np.interp(own, time, speed) + sensors.speed_noise * rng.standard_normal(len(own)))
        machine["torque"].append(np.interp(own, time, drive) + sensors.torque_noise * rng.standard_normal(len(own)))
        if sensors.cell_filter:
            force = _low_pass(force, sensors.cell_filter)
        true = _stamps(rng, clocks.cell_rate, clocks.jitter)
        reading = np.interp(true, time, force) + sensors.force_noise * rng.standard_normal(len(true))
        late = clocks.at(start + touch)
        cell.append(
            (start + true + clocks.at(0.0) + clocks.drift * (start + true), _rounded(reading, sensors.force_step))
        )
        contacts.append(Contact(start + touch + late, start + end + late, 1e-3, float(force.max()), rest=0.0))
    joined = {name: np.concatenate(parts) for name, parts in machine.items()}
    channels = {
        "position": Series(joined["time"], joined["position"], "m"),
        "speed": Series(joined["time"], joined["speed"], "m/s"),
        "torque": Series(joined["time"], joined["torque"], "N"),
        "force": Series(np.concatenate([t for t, _ in cell]), np.concatenate([f for _, f in cell]), "N"),
    }
    return Recording("log", "log", ("axis",), channels), contacts


def _stroke(rng: np.random.Generator, rises: tuple[float, float], rebound: float) -> tuple[FloatArray, ...]:
    """Return time, force, drive force, speed and position of a stroke, and the start and end of the contact [s]."""
    time = np.arange(0.0, _STROKE, _STEP)
    low, high = np.log(rises)
    rise = float(np.exp(rng.uniform(low, high)))
    touch, speed = rng.uniform(1.4, 1.9), rng.uniform(0.1, 0.3)
    fall = rise * rng.uniform(1.0, 3.0)
    end = touch + 2.0 * (rise + fall)
    # The load is stopped and pushed back: the impulse is that of its momentum.
    shape = np.where(time < touch + 2.0 * rise, np.sin(0.25 * np.pi * np.clip(time - touch, 0.0, None) / rise), 0.0)
    back = np.clip((time - touch - 2.0 * rise) / (2.0 * fall), 0.0, 1.0)
    shape = np.where(time >= touch + 2.0 * rise, 0.5 * (1.0 + np.cos(np.pi * back)), shape)
    shape[time < touch] = 0.0
    force = shape * MASS * speed * (rng.uniform(0.9, 1.1) + rebound) / (shape.sum() * _STEP)
    ramp = np.clip((time - 0.2) / 0.5, 0.0, 1.0)
    drive = MASS * np.gradient(speed * (3.0 * ramp**2 - 2.0 * ramp**3), _STEP) + FRICTION * (ramp > 0.0)
    # The drive pushes harder after the contact, slowly, then gives up.
    drive = drive + 60.0 * np.clip((time - touch) / 0.1, 0.0, 1.0) * (time < end)
    drive = np.where(time > end, FRICTION, drive)
    motion = _speed(drive - force)
    return time, force, drive, motion, _integral(motion), touch, end


def _speed(balance: FloatArray) -> FloatArray:
    """Return the speed that a force leads to, against dry friction that turns round with the motion."""
    speed, now = np.empty(len(balance)), 0.0
    for k, force in enumerate(balance.tolist()):
        now += _STEP * (force - FRICTION * math.tanh(now / _STICK)) / MASS
        speed[k] = now
    return speed


def _integral(values: FloatArray) -> FloatArray:
    steps = 0.5 * _STEP * (values[1:] + values[:-1])
    return np.concatenate(([0.0], np.cumsum(steps)))


def _stamps(rng: np.random.Generator, rate: float, jitter: float) -> FloatArray:
    regular = np.arange(rng.uniform(0.0, 1.0 / rate), _STROKE - 2.0 / rate, 1.0 / rate)
    moved = regular + np.clip(jitter * rng.standard_normal(len(regular)), -0.45 / rate, 0.45 / rate)
    return np.asarray(np.maximum(moved, 0.0) + 1e-9 * np.arange(len(regular)))


def _rounded(values: FloatArray, step: float) -> FloatArray:
    return np.round(values / step) * step if step else values


def _low_pass(values: FloatArray, constant: float) -> FloatArray:
    from scipy.signal import lfilter

    keep = np.exp(-_STEP / constant)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values))

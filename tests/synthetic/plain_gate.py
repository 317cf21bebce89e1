"""A sliding gate in a few lines that shares nothing with the package: twins of free and struck strokes.

Motor and leaf with a drive that stiffens as it winds up, another law of friction than the package's models, with a
profile along the track of its own, and a sampled PI speed controller whose integral stops at the limit of the torque.
All strokes of a call are integrated at once, one array element per stroke.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.recordings.recording import Recording, Series

Array = npt.NDArray[np.float64]

PERIOD, STEPS = 1e-3, 5  # s of control and log; integration steps per period
CONTACT_DAMPING = 0.5  # s/m
WAVES = np.array([0.5, 0.23, 0.13])  # m, of the friction along the track
CHANNELS = {"torque": "N", "speed": "m/s", "position": "m", "acceleration": "m/s2", "reference_speed": "m/s"}


@dataclass(frozen=True)
class PlainGate:
    """The gate on the load side (SI units); an infinite stiffness is a rigid drive."""

    motor_mass: float = 350.0
    leaf_mass: float = 500.0
    stiffness: float = 1.2e5
    stiffening: float = 0.0  # of the drive's stiffness per m of wind-up and N/m [1/m]
    drive_damping: float = 400.0
    friction: float = 120.0
    static: float = 150.0
    viscous: float = 100.0
    waviness: float = 0.05  # of the friction along the track [-]
    scatter: float = 0.02  # of the friction from stroke to stroke [-]
    speed: float = 0.25
    ramp: float = 1.2  # s, a half cosine
    gain: float = 5000.0
    integral: float = 12000.0
    force_limit: float = 1500.0
    torque_noise: float = 20.0
    torque_filter: float = 5e-3
    accelerometer_hz: float = 40.0
    accelerometer_noise: float = 0.05
    speed_noise: float = 5e-4
    duration: float = 5.5
    place: float = 0.75  # of the obstacle, with a deviation of 0.03 m from stroke to stroke

    @property
    def is_rigid(self) -> bool:
        return bool(np.isinf(self.stiffness))


def drawn_gate(seed: int) -> PlainGate:
    """Return a gate with parameters drawn at random; the drive of every second one stiffens as it winds up."""
    rng = np.random.default_rng(90_000 + seed)
    motor, leaf, friction = rng.uniform(250.0, 550.0), rng.uniform(450.0, 800.0), rng.uniform(90.0, 200.0)
    return PlainGate(
        motor_mass=motor,
        leaf_mass=leaf,
        stiffness=rng.uniform(6e4, 12e4),
        stiffening=rng.uniform(20.0, 100.0) * (seed % 2),
        drive_damping=rng.uniform(100.0, 500.0),
        friction=friction,
        static=friction * rng.uniform(1.05, 1.35),
        viscous=rng.uniform(40.0, 200.0),
        waviness=rng.uniform(0.02, 0.07),
        scatter=rng.uniform(0.01, 0.03),
        speed=rng.uniform(0.18, 0.3),
        ramp=rng.uniform(0.8, 1.5),
        gain=(motor + leaf) * rng.uniform(4.0, 8.0),
        integral=(motor + leaf) * rng.uniform(8.0, 18.0),
        torque_noise=rng.uniform(10.0, 50.0),
    )


@dataclass(frozen=True)
class Strokes:
    """Recordings on the load side, and the time of first touch of each [s], NaN without a contact."""

    recordings: tuple[Recording, ...]
    contacts: Array


def strokes(gate: PlainGate, seed: int, numbers: Sequence[int], stiffness: Array | float = 0.0) -> Strokes:
    """Return strokes by number, each free or with an obstacle of a stiffness [N/m] and force k p (1 + damping p').

    A number is the same stroke with the same noise, whatever the obstacle is.
    """
    count, samples = len(numbers), round(gate.duration / PERIOD)
    streams = [np.random.default_rng([seed, number]) for number in numbers]
    level, place = np.array([rng.standard_normal(2) for rng in streams]).T
    noise = np.array([rng.standard_normal((4, samples)) for rng in streams])
    waves = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(WAVES))
    wall = gate.place + 0.03 * place
    time: Array = PERIOD * np.arange(samples, dtype=np.float64)
    reference = 0.5 * gate.speed * (1.0 - np.cos(np.pi * np.clip((time - 0.4) / gate.ramp, 0.0, 1.0)))
    pushed = _coloured(noise[:, 3], 0.02) * 10.0  # N

    xm, vm, x, v, force, integral, filtered = (np.zeros(count) for _ in range(7))
    touched = np.full(count, np.nan)
    rows = np.zeros((5, count, samples))
    step = PERIOD / STEPS
    for sample in range(samples):
        filtered += (vm - filtered) * (1.0 - np.exp(-2.0 * np.pi * 80.0 * PERIOD))
        error = reference[sample] - filtered
        wanted = gate.gain * error + integral
        force = np.clip(wanted, -gate.force_limit, gate.force_limit)
        integral += np.where(force == wanted, gate.integral * error * PERIOD, 0.0)
        before = v
        for substep in range(STEPS):
            profile = np.sin(2.0 * np.pi * x[:, np.newaxis] / WAVES + waves).sum(axis=1)
            level_here = (1.0 + gate.scatter * level) * (1.0 + gate.waviness * profile)
            rise = gate.friction + (gate.static - gate.friction) / (1.0 + (v / 0.03) ** 2)
            drag = level_here * rise * v / np.sqrt(v * v + 4e-6) + gate.viscous * v - pushed[:, sample]
            deep = x - wall
            contact = stiffness * np.maximum(deep, 0.0) * np.maximum(1.0 + CONTACT_DAMPING * v, 0.0)
            if gate.is_rigid:
                v = vm = v + step * (force - drag - contact) / (gate.motor_mass + gate.leaf_mass)
                x = xm = x + step * v
            else:
                wound = xm - x
                drive = gate.stiffness * wound * (1.0 + gate.stiffening * np.abs(wound))
                drive = drive + gate.drive_damping * (vm - v)
                vm = vm + step * (force - drive) / gate.motor_mass
                v = v + step * (drive - drag - contact) / gate.leaf_mass
                xm, x = xm + step * vm, x + step * v
            first = (np.asarray(stiffness) > 0.0) & np.isnan(touched) & (x > wall)
            at = time[sample] + step * (substep + 1) - np.divide(x - wall, v, where=first, out=np.zeros(count))
            touched = np.where(first, at, touched)
        rows[:, :, sample] = force, filtered, xm, (v - before) / PERIOD, contact
    torque = _low_pass(rows[0] + gate.torque_noise * noise[:, 0], gate.torque_filter)
    vibration = gate.accelerometer_noise * noise[:, 1] + 0.02 + 0.1 * _coloured(noise[:, 1], 0.01) * rows[1]
    logged = {
        "torque": torque,
        "speed": rows[1] + gate.speed_noise * _coloured(noise[:, 2], 3e-3),
        "position": np.round(rows[2] / 2e-6) * 2e-6,
        "acceleration": _second_order(rows[3] + vibration, gate.accelerometer_hz),
        "reference_speed": np.broadcast_to(reference, (count, samples)),
    }
    clock: Array = time + PERIOD  # a sample is written at the end of its period
    recordings = []
    for index, number in enumerate(numbers):
        channels = {name: Series(clock, logged[name][index], unit) for name, unit in CHANNELS.items()}
        channels["force"] = Series(clock, rows[4][index], "N")
        recordings.append(Recording(f"stroke {number}", "", ("gate",), channels))
    return Strokes(tuple(recordings), touched)


def _low_pass(values: Array, seconds: float) -> Array:
    from scipy.signal import lfilter

    share = 1.0 - np.exp(-PERIOD / seconds)
    return np.asarray(lfilter([share], [1.0, share - 1.0], values))


def _second_order(values: Array, frequency: float) -> Array:
    from scipy.signal import bilinear, lfilter

    rate = 2.0 * np.pi * frequency
    numerator, denominator = bilinear([rate**2], [1.0, 1.6 * rate, rate**2], 1.0 / PERIOD)
    return np.asarray(lfilter(numerator, denominator, values))


def _coloured(noise: Array, seconds: float) -> Array:
    """Return white noise of deviation 1 through a low-pass, with the deviation 1 again."""
    share = np.exp(-PERIOD / seconds)
    return np.asarray(_low_pass(noise, seconds) * np.sqrt((1.0 + share) / (1.0 - share)))

"""A smooth motion of a robot from rest to rest, as a log without noise or as a recording with it."""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.machines.coupled import CoupledMachine
from cdtool.recordings.recording import Recording, Series


def rest_to_rest(
    period: float, duration: float, travel: FloatArray, rest: float = 0.4
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return time (n,), position, speed and acceleration (n, J): a polynomial without jerk at its ends."""
    time = np.arange(round((duration + 2.0 * rest) / period)) * period
    part = np.clip((time - rest) / duration, 0.0, 1.0)[:, np.newaxis]
    shape = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    first = 30.0 * part**2 * (1.0 - part) ** 2 / duration
    second = 60.0 * part * (1.0 - part) * (1.0 - 2.0 * part) / duration**2
    return time, travel * shape, travel * first, travel * second


def robot_recording(
    machine: CoupledMachine, travel: FloatArray, period: float = 2e-3, noise: float = 0.0, seed: int = 0
) -> Recording:
    """Return the log of a robot that follows the motion exactly; `noise` [N m, N] of the torque."""
    time, position, speed, acceleration = rest_to_rest(period, 2.0, travel)
    rng = np.random.default_rng(seed)
    torque = machine.required_torque(position, speed, acceleration)
    torque += noise * rng.standard_normal(torque.shape)
    units = machine.load_units
    channels = {
        "torque": Series(time, torque, units["torque"]),
        "speed": Series(time, speed + 1e-3 * noise * rng.standard_normal(speed.shape), units["speed"]),
        "position": Series(time, position, units["position"]),
    }
    return Recording("motion", "motion", machine.joints, channels)

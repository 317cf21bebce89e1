"""Synthetic, exact recordings of any machine: a smooth motion, the torque it requires, and a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cdtool.recordings.recording import Recording, Series

PERIOD = 1e-3


def moving_recording(
    machine: Any,
    *,
    seconds: float = 6.0,
    seed: int = 0,
    contact: Sequence[float] = (),
    contact_at: float = np.inf,
    noise: float = 0.0,
    amplitude: float = 0.4,
    period: float = PERIOD,
    rest: float = 0.5,
) -> Recording:
    """Return a recording in which all joints oscillate after `rest` s at standstill.

    From `contact_at` [s] on, the drives also apply the contact torque `contact` (J,) [N m], which does not change the
    motion, and which the reference torque does not contain. Torque, speed, position and acceleration are exact except
    for `noise`, as a share of each channel's standard deviation.
    """
    joints = len(machine.joints)
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds / period)) * period
    rates, start = rng.uniform(0.8, 1.6, joints), rng.uniform(-0.5, 0.5, joints)
    phase = rates * np.maximum(time - rest, 0.0)[:, np.newaxis]
    sine, cosine = np.sin(phase), np.cos(phase)
    # sin^3 starts from standstill with two derivatives of 0.
    position = start + amplitude * sine**3
    speed = 3.0 * amplitude * rates * sine**2 * cosine
    acceleration = 3.0 * amplitude * rates**2 * (2.0 * sine * cosine**2 - sine**3)
    required = torque = machine.required_torque(position, speed, acceleration)
    if len(contact):
        torque = required + np.where(time[:, np.newaxis] >= contact_at, np.asarray(contact), 0.0)
    units = machine.load_units
    channels = {}
    for name, values, unit in (
        ("torque", torque, units["torque"]),
        ("speed", speed, units["speed"]),
        ("position", position, units["position"]),
        ("acceleration", acceleration, units["acceleration"]),
        ("reference_position", position, units["position"]),
        ("reference_speed", speed, units["speed"]),
        ("reference_torque", required, units["torque"]),
    ):
        measured = values
        if noise and not name.startswith("reference"):
            measured = values + noise * values.std(axis=0) * rng.standard_normal(values.shape)
        channels[name] = Series(time, measured, unit)
    return Recording(f"moving{seed}", "synthetic", machine.joints, channels, digest=f"moving{seed}")


def resting_recording(
    machine: Any, position: Sequence[float], torque: Sequence[float], seconds: float = 3.0
) -> Recording:
    """Return a recording of a machine at rest in a pose (J,), with a constant torque (J,) of the drives."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    zeros = np.zeros((len(time), len(machine.joints)))
    units = machine.load_units
    pose = Series(time, zeros + np.asarray(position), units["position"])
    drive = Series(time, zeros + np.asarray(torque), units["torque"])
    channels = {
        "torque": drive,
        "reference_torque": drive,
        "position": pose,
        "reference_position": pose,
        "speed": Series(time, zeros, units["speed"]),
        "acceleration": Series(time, zeros, units["acceleration"]),
    }
    return Recording("resting", "synthetic", machine.joints, channels)

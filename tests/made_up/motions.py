"""Made-up but exact recordings of any machine: a smooth motion, the torque that it needs, and a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cdtool.recording import Recording, Series

PERIOD = 1e-3


def moving(
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
    """All joints swing after `rest` s at a standstill; from `contact_at` on the contact takes `contact` (J,) [N m].

    Torque, speed, position and acceleration are exact but for `noise`, a share of each channel's own spread: the motion
    is as it is, and the drives give what it needs and what the contact takes.
    """
    joints = len(machine.joints)
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds / period)) * period
    rates, start = rng.uniform(0.8, 1.6, joints), rng.uniform(-0.5, 0.5, joints)
    phase = rates * np.maximum(time - rest, 0.0)[:, np.newaxis]
    sine, cosine = np.sin(phase), np.cos(phase)
    # sin^3 leaves its rest with two derivatives that are 0.
    position = start + amplitude * sine**3
    speed = 3.0 * amplitude * rates * sine**2 * cosine
    acceleration = 3.0 * amplitude * rates**2 * (2.0 * sine * cosine**2 - sine**3)
    torque = machine.required_torque(position, speed, acceleration)
    if len(contact):
        torque = torque + np.where(time[:, np.newaxis] >= contact_at, np.asarray(contact), 0.0)
    units = machine.load_units
    channels = {}
    for name, values, unit in (
        ("torque", torque, units["torque"]),
        ("speed", speed, units["speed"]),
        ("position", position, units["position"]),
        ("acceleration", acceleration, units["acceleration"]),
        ("reference_position", position, units["position"]),
        ("reference_speed", speed, units["speed"]),
    ):
        spoilt = values
        if noise and not name.startswith("reference"):
            spoilt = values + noise * values.std(axis=0) * rng.standard_normal(values.shape)
        channels[name] = Series(time, spoilt, unit)
    return Recording(f"moving{seed}", "made up", machine.joints, channels, digest=f"moving{seed}")


def standing(machine: Any, position: Sequence[float], torque: Sequence[float], seconds: float = 3.0) -> Recording:
    """A machine at rest in a pose (J,) while its drives give a constant torque (J,)."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    nothing = np.zeros((len(time), len(machine.joints)))
    units = machine.load_units
    pose = Series(time, nothing + np.asarray(position), units["position"])
    channels = {
        "torque": Series(time, nothing + np.asarray(torque), units["torque"]),
        "position": pose,
        "reference_position": pose,
        "speed": Series(time, nothing, units["speed"]),
        "acceleration": Series(time, nothing, units["acceleration"]),
    }
    return Recording("standing", "made up", machine.joints, channels)

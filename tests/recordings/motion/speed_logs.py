"""A log of a speed that a test chooses."""

from __future__ import annotations

import numpy as np

from cdtool.recordings.recording import Recording, Series

PERIOD = 1e-3
RAMP = 0.4  # m/s2


def log(*parts: tuple[float, float], noise: float = 0.005, seed: int = 0, rest: float = 0.5) -> Recording:
    """A rest, then for each part (speed, seconds) a ramp to the speed, which lasts with it the seconds."""
    speed = [np.zeros(round(rest / PERIOD))]
    now = 0.0
    for target, seconds in parts:
        ramp = now + np.sign(target - now) * RAMP * PERIOD * np.arange(1, round(seconds / PERIOD) + 1)
        bounded = np.minimum(ramp, target) if target >= now else np.maximum(ramp, target)
        speed.append(bounded)
        now = float(bounded[-1])
    true = np.concatenate(speed)
    time = PERIOD * np.arange(len(true))
    rng = np.random.default_rng(seed)
    channels = {
        "speed": Series(time, true + noise * rng.standard_normal(len(true)), "m/s"),
        "position": Series(time, PERIOD * np.cumsum(true), "m"),
    }
    return Recording(f"log{seed}", "made up", ("axis",), channels)

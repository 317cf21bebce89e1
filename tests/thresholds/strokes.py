"""Recordings and signals that the tests of thresholds share: a clean stroke, white noise, any clock."""

from __future__ import annotations

import numpy as np

from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording, Series

N = 4000
TIME = np.arange(N) * 1e-3
STILL = Recording("still", "still", ("axis",), {})


def stroke(direction: int = 1, speed: float = 0.2, time: np.ndarray = TIME, start: float = 0.3) -> Recording:
    """A clean stroke: a ramp of 0.2 m/s2 from `start` [s] to the nominal speed, with its reference."""
    v = direction * np.clip(0.2 * (time - start), 0.0, speed)
    x = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(time))))
    channels = {
        "speed": Series(time, v, "m/s"),
        "position": Series(time, x, "m"),
        "reference_speed": Series(time, v, "m/s"),
    }
    return Recording("stroke", "stroke", ("axis",), channels)


def signal(values: np.ndarray, time: np.ndarray = TIME, signed: bool = True) -> Signal:
    """One column of valid samples in N."""
    column = np.asarray(values, dtype=np.float64).reshape(-1, 1)
    return Signal(time, column, np.zeros(column.shape, dtype=np.uint8), "N", signed, ("axis",))


def noise_runs(count: int, direction: int = 1, mean: float = 100.0, seed: int = 0):
    """White noise of 1 N about a mean, on clean strokes."""
    rng = np.random.default_rng(seed)
    return [(stroke(direction), signal(mean + rng.normal(size=N))) for _ in range(count)]


def jittering_clock(count: int, share: float, seed: int = 0) -> np.ndarray:
    """Steps of 1 ms that vary by up to +-`share`."""
    steps = 1e-3 * (1.0 + share * np.random.default_rng(seed).uniform(-1.0, 1.0, count))
    return np.concatenate(([0.0], np.cumsum(steps[1:])))

"""The peer of `whole_benchmark.py`: the script that an engineer would write for one gate with pandas and numba.

It reads a log by column names that it knows, computes five detectors in one loop, learns a band over the stroke from
impact-free runs and prints each detector's latency. It checks nothing: units, gaps, lost samples, clocks, drift of the
load cell, classes of motion and repeated logs are not its business, so its cost is what the arithmetic alone costs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import numpy as np
import numpy.typing as npt
import pandas as pd
from numba import njit

FloatArray = npt.NDArray[np.float64]

RATIO, MOTOR_INERTIA, LOAD_MASS, VISCOUS = 0.001333, 0.00095, 620.0, 0.00026653
MASS = LOAD_MASS + MOTOR_INERTIA / RATIO**2  # kg
FRICTION = VISCOUS / RATIO**2  # N s/m
GAIN, PERIOD = 50.0, 1e-3
DEBOUNCE = 9
BINS = 400
DETECTORS = 5


@njit("float64[:,::1](float64[::1], float64[::1], float64[::1])", cache=True)
def detectors(force: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Return the signals (5, n) [N]: torque, inertia, momentum, inertial momentum, friction EKF."""
    n = len(force)
    signals = np.empty((DETECTORS, n))
    momentum = inertial = integral = inertial_integral = 0.0
    state, friction = speed[0], FRICTION
    p11, p12, p22 = 1.0, 0.0, 1.0
    share = PERIOD / MASS
    for i in range(n):
        driven = force[i] - FRICTION * speed[i]
        signals[0, i] = force[i]
        signals[1, i] = MASS * acceleration[i]
        integral += (driven + momentum) * PERIOD
        momentum = GAIN * (MASS * (speed[i] - speed[0]) - integral)
        signals[2, i] = momentum
        inertial_integral += (MASS * acceleration[i] + inertial) * PERIOD
        inertial = GAIN * (MASS * (speed[i] - speed[0]) - inertial_integral)
        signals[3, i] = inertial
        slope = 1.0 - friction * share
        state += (force[i] - friction * state) * share
        a12 = -state * share
        p11, p12, p22 = (
            slope * (slope * p11 + a12 * p12) + a12 * (slope * p12 + a12 * p22) + 1e-8,
            slope * p12 + a12 * p22,
            p22 + 1e2,
        )
        gain = 1.0 / (p11 + 1e-6)
        error = speed[i] - state
        state += p11 * gain * error
        friction += p12 * gain * error
        p11, p12, p22 = p11 - p11 * gain * p11, p12 - p11 * gain * p12, p22 - p12 * gain * p12
        signals[4, i] = friction * state
    return signals


@njit("float64(float64[::1], float64[::1], float64[::1], float64[::1], float64[::1])", cache=True)
def first_alarm(time: FloatArray, place: FloatArray, signal: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Return when the signal has been outside its band for nine samples [s], infinite if never."""
    outside = 0
    for i in range(len(time)):
        at = min(int(place[i] * BINS), BINS - 1)
        outside = outside + 1 if signal[i] < lower[at] or signal[i] > upper[at] else 0
        if outside == DEBOUNCE:
            return float(time[i])
    return np.inf


def read(path: Path) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return time [s], share of the stroke from 0 to 1, the signals (5, n), and the load cell [N]."""
    table = pd.read_csv(path)
    column = {name: np.ascontiguousarray(table[name].to_numpy(), dtype=np.float64) for name in table.columns}
    time = 1e-3 * column["t"]
    force = column["i_motor"] * 0.56 / RATIO
    speed = column["n_motor"] * (2.0 * np.pi / 60.0) * RATIO
    position = column["phi"] * RATIO
    place = np.clip((position - position[0]) / (np.abs(position - position[0]).max() + 1e-9), 0.0, 1.0)
    return time, place, detectors(force, speed, -9.80665 * column["acc_x"]), 1e3 * column["load_cell"]


def learn(paths: Sequence[Path]) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper limits (5, 400) over the stroke."""
    total, square, count = np.zeros((DETECTORS, BINS)), np.zeros((DETECTORS, BINS)), np.zeros(BINS)
    for path in paths:
        _, place, signals, _ = read(path)
        at = np.minimum((place * BINS).astype(np.int64), BINS - 1)
        count += np.bincount(at, minlength=BINS)
        for i in range(DETECTORS):
            total[i] += np.bincount(at, signals[i], minlength=BINS)
            square[i] += np.bincount(at, signals[i] ** 2, minlength=BINS)
    mean = total / np.maximum(count, 1.0)
    spread = 6.0 * np.sqrt(np.maximum(square / np.maximum(count, 1.0) - mean**2, 0.0)) + 1.0
    return mean - spread, mean + spread


def score(path: Path, lower: FloatArray, upper: FloatArray) -> list[float]:
    """Return the latency of each detector [s]."""
    time, place, signals, cell = read(path)
    touched = np.flatnonzero(np.abs(cell - np.median(cell[:200])) > 20.0)
    onset = time[touched[0]] if len(touched) else np.nan
    return [first_alarm(time, place, signals[i], lower[i], upper[i]) - onset for i in range(DETECTORS)]


def cost(learned: Sequence[Path], scored: Sequence[Path]) -> float:
    """Return the CPU time of a scored log [s]."""
    lower, upper = learn(learned)
    score(scored[0], lower, upper)
    begin = process_time()
    for path in scored:
        score(path, lower, upper)
    return (process_time() - begin) / len(scored)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    logs = [path for group in ("holdout", "stiff", "soft") for path in sorted((folder / group).glob("*.csv"))]
    print(1e3 * cost(sorted((folder / "free").glob("*.csv")), logs))

"""The arrays for timing kernels: an axis that moves back and forth, on the load side, as logged by a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.machines.linear_axis import LinearAxis
from cdtool.recordings.recording import Recording, Series

Array = npt.NDArray[np.float64]

# Back and forth at 0.2 m/s with ramps of 1 s and rests of 0.5 s: (time [s], speed [m/s]) of one period.
_STROKES = ((0.0, 0.5, 1.5, 6.5, 7.5, 8.0, 9.0, 14.0, 15.0), (0.0, 0.0, 0.2, 0.2, 0.0, 0.0, -0.2, -0.2, 0.0))
_PERIOD = _STROKES[0][-1]
PERIOD = 1e-3  # of the log [s]


@dataclass(frozen=True)
class Run:
    """Clock [s], drive force [N], speed [m/s] and the accelerometer [m/s2] with its own clock."""

    time: Array
    force: Array
    speed: Array
    acceleration_time: Array
    acceleration: Array


def gate() -> LinearAxis:
    """A gate of 1.15 t with known viscous friction."""
    values = {"load_mass": 620.0, "motor_inertia": 9.5e-4, "transmission_ratio": 1.333e-3, "viscous_friction": 2.67e-4}
    return LinearAxis.of(values)


def viscous(machine: LinearAxis) -> float:
    """Load side, N s/m."""
    return float(machine.viscous_friction[0] / machine.transmission_ratio[0] ** 2)


def clean(samples: int, machine: LinearAxis) -> Run:
    """Uniform 1 kHz, nothing missing, the accelerometer on the same clock."""
    rng = np.random.default_rng(2)
    time = np.arange(samples) * PERIOD
    speed = np.interp(time, *_STROKES, period=_PERIOD)
    acceleration = np.gradient(speed, PERIOD)
    force = machine.nominal_inertia[0] * acceleration + viscous(machine) * speed + rng.normal(0.0, 20.0, samples)
    speed += rng.normal(0.0, 1e-3, samples)
    acceleration += rng.normal(0.0, 0.1, samples)
    return Run(time, force, speed, time, acceleration)


def awkward(samples: int, machine: LinearAxis) -> Run:
    """The same with an accelerometer on its own, jittering clock, lone and grouped missing samples, and pauses."""
    run = clean(samples, machine)
    rng = np.random.default_rng(3)
    time = run.time + 1.5 * np.floor(run.time / 100.0)  # a pause of 1.5 s each 100 s
    speed, acceleration = run.speed.copy(), run.acceleration.copy()
    speed[rng.random(samples) < 1e-3] = np.nan
    acceleration[rng.random(samples) < 1e-3] = np.nan
    for start in range(5_000, samples - 200, 50_000):
        speed[start : start + 100] = np.nan
        acceleration[start + 2_000 : start + 2_080] = np.nan
    own_time = time + PERIOD * (0.3 + 0.2 * rng.random(samples))
    return Run(time, run.force, speed, own_time, acceleration)


def stretch(run: Run, start: int, count: int) -> Run:
    """`count` samples from `start` of a run whose accelerometer shares the clock."""
    part = slice(start, start + count)
    return Run(run.time[part], run.force[part], run.speed[part], run.acceleration_time[part], run.acceleration[part])


def recording(run: Run) -> Recording:
    """A Recording of torque and speed, referred to the load side."""
    channels = {"torque": Series(run.time, run.force, "N"), "speed": Series(run.time, run.speed, "m/s")}
    return Recording("strokes", "benchmark", ("axis",), channels)

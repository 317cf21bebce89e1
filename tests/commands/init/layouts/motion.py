"""Motions for look-alikes of logs: positions, speeds and efforts that obey the mechanics of a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

FloatArray = np.ndarray
RPM = 60.0 / (2.0 * np.pi)


@dataclass(frozen=True)
class Motion:
    """A motion of J joints in SI units: `time` (n,) s, everything else (n, J), `push` (n,) N."""

    time: FloatArray
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    model_effort: FloatArray
    reference_position: FloatArray
    reference_speed: FloatArray
    reference_acceleration: FloatArray
    push: FloatArray

    def noisy(self, values: FloatArray, generator: Generator, share: float = 0.002) -> FloatArray:
        """Return values with white noise, `share` of their span."""
        span = np.ptp(values, axis=0)
        return values + generator.normal(0.0, 1.0, values.shape) * share * span


def arm_motion(
    generator: Generator,
    joints: int = 6,
    rate: float = 125.0,
    duration: float = 8.0,
    at_rest: Sequence[int] = (),
    push: float = 40.0,
) -> Motion:
    """Return point-to-point moves of an arm whose upper joints carry weight; joints `at_rest` keep their place."""
    time = _stamps(rate, duration)
    goals = generator.uniform(-1.2, 1.2, (6, joints)) + generator.uniform(-1.5, 1.5, joints)
    goals[:, list(at_rest)] = goals[0, list(at_rest)]
    reference = np.column_stack([_moves(time, goals[:, j], 0.8) for j in range(joints)])
    size = 0.65 ** np.arange(joints)
    weight = [0.0, *(45.0 * size[1:]).tolist()] if joints > 1 else [0.0]
    return _follow(generator, time, reference, (6.0 * size).tolist(), (9.0 * size).tolist(), weight, push)


def quantised(values: FloatArray, step: float) -> FloatArray:
    """Return values rounded to multiples of a step."""
    return np.round(values / step) * step


def _stamps(rate: float, duration: float) -> FloatArray:
    return np.arange(round(rate * duration)) / rate


def _moves(time: FloatArray, goals: FloatArray, moving: float) -> FloatArray:
    """Return a path through goals with smooth ramps of the speed; `moving`: share of the time in motion."""
    segment = time[-1] / (len(goals) - 1)
    index = np.minimum((time / segment).astype(int), len(goals) - 2)
    share = np.clip((time - index * segment) / (moving * segment), 0.0, 1.0)
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return goals[index] + (goals[index + 1] - goals[index]) * smooth


def _follow(
    generator: Generator,
    time: FloatArray,
    reference: FloatArray,
    inertia: Sequence[float],
    friction: Sequence[float],
    weight: Sequence[float],
    push: float,
) -> Motion:
    """Return the motion that follows a reference by a few milliseconds, and the efforts for it."""
    period = time[1] - time[0]
    delay = max(0.012, 1.2 * period)
    position = np.column_stack([np.interp(time - delay, time, column) for column in reference.T])
    speed = np.gradient(position, period, axis=0)
    acceleration = np.gradient(speed, period, axis=0)
    pushed = np.zeros_like(time)
    if push:
        at, width = time[-1] * 0.82, 0.08
        inside = np.abs(time - at) < width
        pushed[inside] = push * np.cos(0.5 * np.pi * (time[inside] - at) / width)
    lever = 0.3 if reference.shape[1] > 1 else 1.0
    model = (
        np.asarray(inertia) * acceleration
        + np.asarray(friction) * (np.tanh(speed / 0.01) + 0.4 * speed / max(np.abs(speed).max(), 1e-9))
        + np.asarray(weight) * np.cos(position)
    )
    loaded = np.zeros(reference.shape[1])
    loaded[: min(3, len(loaded))] = 1.0
    effort = model + lever * pushed[:, np.newaxis] * loaded
    effort = effort + generator.normal(0.0, 0.02, effort.shape) * np.ptp(model, axis=0)
    return Motion(
        time,
        position,
        speed,
        acceleration,
        effort,
        model,
        reference,
        np.gradient(reference, period, axis=0),
        np.gradient(np.gradient(reference, period, axis=0), period, axis=0),
        pushed,
    )

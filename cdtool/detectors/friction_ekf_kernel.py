"""The friction-estimating EKF's compiled recursion: three states, scalars unrolled.

State (d, a, v), load side. Predict, all from the old state: d, (F - d v) / m, v + T a. The transition's Jacobian is
[[1, 0, 0], [-v/m, 0, -d/m], [0, T, 1]]. The covariance is carried as its upper triangle (p11, p12, p13, p22, p23, p33),
so that it stays symmetric; each measurement is a scalar update in Joseph form, which stays right for the gain that is
forced to zero where the friction cannot be observed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, fields_of, kernel
from cdtool.detectors.detection import Status, StatusArray

Covariance = tuple[float, float, float, float, float, float]

_SIX = "UniTuple(float64, 6)"


class Samples(NamedTuple):
    """The samples of one joint at `time` (n,) [s], and of its accelerometer at `acceleration_time` (m,) [s].

    `speed` and `acceleration` may contain NaN (no sample), `force` may not. `missing` (n,) uint8: not 0 where the
    status is to be GAP, even if all values are finite.
    """

    time: FloatArray
    force: FloatArray
    speed: FloatArray
    missing: npt.NDArray[np.uint8]
    acceleration_time: FloatArray
    acceleration: FloatArray


class Variances(NamedTuple):
    """Process noise q of (d, a, v), measurement noise r of (a, v), and the variance of d at a start."""

    q_d: float
    q_a: float
    q_v: float
    r_a: float
    r_v: float
    initial: float


class Bounds(NamedTuple):
    """Limits of the filter: `minimum_speed` [m/s, rad/s], below which the friction is unobservable.

    `acceleration_hold` [s]: how long an accelerometer may be silent. `glitch` [s]: a shorter stop does not count.
    """

    minimum_speed: float
    acceleration_hold: float
    glitch: float


@kernel(f"{_SIX}({_SIX}, float64, float64, float64, float64, float64, float64)")
def predict_covariance(
    p: Covariance, f21: float, f23: float, step: float, q_d: float, q_a: float, q_v: float
) -> Covariance:
    """F P F' + Q with F = [[1, 0, 0], [f21, 0, f23], [0, step, 1]], Q = diag(q_d, q_a, q_v)."""
    p11, p12, p13, p22, p23, p33 = p
    row_a1 = f21 * p11 + f23 * p13
    row_a3 = f21 * p13 + f23 * p33
    row_v2 = step * p22 + p23
    row_v3 = step * p23 + p33
    return (
        p11 + q_d,
        row_a1,
        step * p12 + p13,
        f21 * row_a1 + f23 * row_a3 + q_a,
        f21 * (step * p12 + p13) + f23 * row_v3,
        step * row_v2 + row_v3 + q_v,
    )


@kernel(f"{_SIX}({_SIX}, float64, float64, float64, float64)")
def update_second(p: Covariance, k1: float, k2: float, k3: float, noise: float) -> Covariance:
    """Joseph form (I - k e2') P (I - k e2')' + k R k' for a measurement of the second state."""
    p11, p12, p13, p22, p23, p33 = p
    m12 = p12 - k1 * p22
    m22 = p22 - k2 * p22
    m32 = p23 - k3 * p22
    return (
        p11 - k1 * p12 - m12 * k1 + noise * k1 * k1,
        m12 - m12 * k2 + noise * k1 * k2,
        p13 - k1 * p23 - m12 * k3 + noise * k1 * k3,
        m22 - m22 * k2 + noise * k2 * k2,
        p23 - k2 * p23 - m22 * k3 + noise * k2 * k3,
        p33 - k3 * p23 - m32 * k3 + noise * k3 * k3,
    )


@kernel(f"{_SIX}({_SIX}, float64, float64, float64, float64)")
def update_third(p: Covariance, k1: float, k2: float, k3: float, noise: float) -> Covariance:
    """Joseph form (I - k e3') P (I - k e3')' + k R k' for a measurement of the third state."""
    p11, p12, p13, p22, p23, p33 = p
    m13 = p13 - k1 * p33
    m23 = p23 - k2 * p33
    m33 = p33 - k3 * p33
    return (
        p11 - k1 * p13 - m13 * k1 + noise * k1 * k1,
        p12 - k1 * p23 - m13 * k2 + noise * k1 * k2,
        m13 - m13 * k3 + noise * k1 * k3,
        p22 - k2 * p23 - m23 * k2 + noise * k2 * k2,
        m23 - m23 * k3 + noise * k2 * k3,
        m33 - m33 * k3 + noise * k3 * k3,
    )


@kernel(
    "Tuple((float64, int64, b1, float64))(b1, b1, float64, float64, float64, float64, int64, b1, float64)",
)
def progress_of_settling(
    applicable: bool,
    moves_forward: bool,
    time: float,
    gained: float,
    glitch: float,
    settled: float,
    against: int,
    forward: bool,
    last_applicable: float,
) -> tuple[float, int, bool, float]:
    """Return (settled, against, forward, last_applicable) after one more sample: how far the estimate has settled.

    `settled` is the integral over time of the approximate bandwidth |v| / m sqrt(q_d / ((r_a + q_a) T)) [rad/s],
    `gained` the part of this step of length T; the estimate is ready when it reaches 3. It restarts after a stop longer
    than `glitch`, and after a rebound, when the estimate has the wrong sign for a while; fewer than 3 consecutive
    samples of the other sign are outliers.
    """
    if applicable:
        against = against + 1 if moves_forward != forward else 0
        if against == 3:
            return gained, 0, not forward, time
        return settled + gained, against, forward, time
    return 0.0 if time - last_applicable > glitch else settled, against, forward, last_applicable


@kernel(
    f"void({fields_of(Samples)}, {READ_ONLY}, float64, {fields_of(Variances)}, {fields_of(Bounds)}, float64[::1], "
    "uint8[::1])"
)
def run_filter(
    samples: Samples,
    inertia: FloatArray,
    viscous: float,
    variances: Variances,
    bounds: Bounds,
    friction: FloatArray,
    status: StatusArray,
) -> None:
    """Fill `friction` (n,) of one joint, and its `status` (n,) where that is not VALID: zeros (VALID) on entry.

    `inertia` (n,), or (1,) if it is constant [kg, kg m2]; `viscous` [N s/m, N m s/rad]: the friction to start from.
    """
    time, force, speed, missing, acceleration_time, acceleration = samples
    q_d, q_a, q_v, r_a, r_v, initial_variance = variances
    minimum_speed, acceleration_hold, glitch = bounds
    last_sample = len(acceleration)
    next_sample = 0
    started = False
    p: Covariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    d = viscous
    a = 0.0
    v = 0.0
    now = 0.0
    last_speed_time = 0.0
    last_acceleration_time = -math.inf
    held_force = 0.0
    applicable = False
    settled = 0.0
    last_applicable = -math.inf
    forward = True
    against = 0
    # A constant inertia is read once; one that changes with the pose is held between samples, like the force.
    varies = len(inertia) > 1
    inverse_inertia = 1.0 / inertia[0] if len(inertia) else 0.0
    bandwidth_scale = math.sqrt(q_d / (r_a + q_a))
    for k in range(len(time)):
        seen = math.isfinite(speed[k])
        if started and time[k] - last_speed_time > 1.0:
            started = False  # a long gap: the old state is useless
        if not started:
            while next_sample < last_sample and acceleration_time[next_sample] <= time[k]:
                if math.isfinite(acceleration[next_sample]):
                    a = acceleration[next_sample]
                    last_acceleration_time = acceleration_time[next_sample]
                next_sample += 1
            if not seen or missing[k]:
                status[k] = Status.GAP
                friction[k] = d
                continue
            started = True
            d = viscous
            v = speed[k]
            p = (initial_variance, 0.0, 0.0, r_a, 0.0, r_v)
            settled = 0.0
            last_applicable = -math.inf
            forward = v > 0.0
            against = 0
            applicable = abs(v) >= minimum_speed
            now = time[k]
            last_speed_time = now
            held_force = force[k]
            if varies:
                inverse_inertia = 1.0 / inertia[k]
            friction[k] = d
            status[k] = Status.START_UP if applicable else Status.NOT_APPLICABLE
            continue
        while True:
            # The next event: an accelerometer sample at its own time, else the time of the speed.
            own_sample = next_sample < last_sample and acceleration_time[next_sample] <= time[k]
            until = acceleration_time[next_sample] if own_sample else time[k]
            step = until - now
            if step > 0.0:
                drift = q_d * step if applicable else 0.0
                p = predict_covariance(p, -v * inverse_inertia, -d * inverse_inertia, step, drift, q_a, q_v)
                old_a = a
                a = (held_force - d * v) * inverse_inertia
                v += step * old_a
                now = until
            if not own_sample:
                break
            sample = acceleration[next_sample]
            if math.isfinite(sample) and step >= 0.0:
                spread = 1.0 / (p[3] + r_a)
                k1 = p[1] * spread if applicable else 0.0
                k2 = p[3] * spread
                k3 = p[4] * spread
                surprise = sample - a
                d += k1 * surprise
                a += k2 * surprise
                v += k3 * surprise
                p = update_second(p, k1, k2, k3, r_a)
                last_acceleration_time = until
            next_sample += 1
        if seen:
            applicable = abs(speed[k]) >= minimum_speed
            spread = 1.0 / (p[5] + r_v)
            k1 = p[2] * spread if applicable else 0.0
            k2 = p[4] * spread
            k3 = p[5] * spread
            surprise = speed[k] - v
            d += k1 * surprise
            a += k2 * surprise
            v += k3 * surprise
            p = update_third(p, k1, k2, k3, r_v)
            gained = bandwidth_scale * inverse_inertia * abs(speed[k]) * math.sqrt(time[k] - last_speed_time)
            settled, against, forward, last_applicable = progress_of_settling(
                applicable, speed[k] > 0.0, time[k], gained, glitch, settled, against, forward, last_applicable
            )
            last_speed_time = time[k]
        held_force = force[k]
        if varies:
            inverse_inertia = 1.0 / inertia[k]
        friction[k] = d
        if not math.isfinite(d + a + v):
            # The steps are too long for this speed: the linearised model has diverged, and restarts.
            started = False
            friction[k] = viscous
            status[k] = Status.START_UP
            continue
        if missing[k] or not seen or time[k] - last_acceleration_time > acceleration_hold:
            status[k] = Status.GAP
        elif not applicable:
            status[k] = Status.NOT_APPLICABLE
        elif settled < 3.0:
            status[k] = Status.START_UP

"""The friction-estimating EKF of a planar arm's joint: four states, scalars unrolled (thesis 6.34 to 6.44 corrected).

State (d, a, v, q). Predict, all from the old state: d, f, v + T a, q + T v, with

    f = (force - d v - gravity cos q - coupling (cos(q - other) a_other + sin(q - other) v_other^2)) / inertia

whose Jacobian's second row is (-v/m, 0, -d/m, df/dq). The covariance is carried as its upper triangle (p11, p12, p13,
p14, p22, p23, p24, p33, p34, p44); each of the three measurements (a, v, q) is a scalar update in Joseph form.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import fields_of, kernel
from cdtool.detectors.detection import Status, StatusArray
from cdtool.detectors.friction_ekf_kernel import Bounds, Samples, Variances, progress_of_settling

State = tuple[float, float, float, float]
Covariance = tuple[float, float, float, float, float, float, float, float, float, float]

_TEN = "UniTuple(float64, 10)"
_FOUR = "UniTuple(float64, 4)"


class Link(NamedTuple):
    """One joint of the arm: its angle (n,), which may contain NaN, and its terms of `dynamics.Pendulum`, all n known.

    `inertia` and `coupling` [kg m2], `gravity` [N m], `viscous` [N m s/rad]: the friction to start from.
    """

    position: FloatArray
    other_position: FloatArray
    other_speed: FloatArray
    other_acceleration: FloatArray
    inertia: float
    viscous: float
    gravity: float
    coupling: float


class AngleVariances(NamedTuple):
    """Process noise q and measurement noise r of the angle, the fourth state."""

    q_q: float
    r_q: float


@kernel(f"{_TEN}({_TEN}, {', '.join(['float64'] * 8)})")
def predict_covariance(
    p: Covariance, f21: float, f23: float, f24: float, step: float, q_d: float, q_a: float, q_v: float, q_q: float
) -> Covariance:
    """F P F' + Q with F = [[1,0,0,0], [f21,0,f23,f24], [0,step,1,0], [0,0,step,1]], Q = diag(q_d, q_a, q_v, q_q)."""
    p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
    a1 = f21 * p11 + f23 * p13 + f24 * p14
    a2 = f21 * p12 + f23 * p23 + f24 * p24
    a3 = f21 * p13 + f23 * p33 + f24 * p34
    a4 = f21 * p14 + f23 * p34 + f24 * p44
    v3 = step * p23 + p33
    q3 = step * p33 + p34
    return (
        p11 + q_d,
        a1,
        step * p12 + p13,
        step * p13 + p14,
        f21 * a1 + f23 * a3 + f24 * a4 + q_a,
        step * a2 + a3,
        step * a3 + a4,
        step * (step * p22 + p23) + v3 + q_v,
        step * v3 + step * p24 + p34,
        step * q3 + step * p34 + p44 + q_q,
    )


@kernel(f"{_TEN}({_TEN}, {_FOUR}, {_FOUR}, float64)")
def update_covariance(
    p: Covariance,
    column: State,
    k: State,
    innovation: float,
) -> Covariance:
    """Joseph form P - k c' - c k' + k k' S: c is P's column of the measured state, S the variance of the innovation.

    It holds for any k, also for one whose first element is forced to zero.
    """
    p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
    c1, c2, c3, c4 = column
    k1, k2, k3, k4 = k
    return (
        p11 - 2.0 * k1 * c1 + k1 * k1 * innovation,
        p12 - k1 * c2 - c1 * k2 + k1 * k2 * innovation,
        p13 - k1 * c3 - c1 * k3 + k1 * k3 * innovation,
        p14 - k1 * c4 - c1 * k4 + k1 * k4 * innovation,
        p22 - 2.0 * k2 * c2 + k2 * k2 * innovation,
        p23 - k2 * c3 - c2 * k3 + k2 * k3 * innovation,
        p24 - k2 * c4 - c2 * k4 + k2 * k4 * innovation,
        p33 - 2.0 * k3 * c3 + k3 * k3 * innovation,
        p34 - k3 * c4 - c3 * k4 + k3 * k4 * innovation,
        p44 - 2.0 * k4 * c4 + k4 * k4 * innovation,
    )


@kernel(f"Tuple(({_FOUR}, {_TEN}))({_FOUR}, {_TEN}, {_FOUR}, float64, float64, b1)")
def correct(
    state: State, p: Covariance, column: State, innovation: float, surprise: float, applicable: bool
) -> tuple[State, Covariance]:
    """Return state and covariance after one scalar measurement; d is unchanged where the friction is unobservable."""
    k1 = column[0] / innovation if applicable else 0.0
    k = (k1, column[1] / innovation, column[2] / innovation, column[3] / innovation)
    d, a, v, q = state
    corrected = (d + k[0] * surprise, a + k[1] * surprise, v + k[2] * surprise, q + k[3] * surprise)
    return corrected, update_covariance(p, column, k, innovation)


@kernel(
    f"void({fields_of(Samples)}, {fields_of(Link)}, {fields_of(Variances)}, {fields_of(AngleVariances)}, "
    f"{fields_of(Bounds)}, float64[::1], uint8[::1])"
)
def run_arm_filter(
    samples: Samples,
    link: Link,
    variances: Variances,
    angle: AngleVariances,
    bounds: Bounds,
    friction: FloatArray,
    status: StatusArray,
) -> None:
    """Fill `friction` and `status` (n,) of one joint of the arm; see `run_filter`."""
    time, force, speed, missing, acceleration_time, acceleration = samples
    position, other_position, other_speed, other_acceleration, inertia, viscous, gravity, coupling = link
    q_d, q_a, q_v, r_a, r_v, initial_variance = variances
    q_q, r_q = angle
    minimum_speed, acceleration_hold, glitch = bounds
    last_sample = len(acceleration)
    next_sample = 0
    started = False
    p: Covariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    d, a, v, q = viscous, 0.0, 0.0, 0.0
    now = last_speed_time = 0.0
    last_acceleration_time = last_applicable = -math.inf
    applicable = False
    settled = 0.0
    forward = True
    against = 0
    held = 0
    bandwidth_scale = math.sqrt(q_d / (r_a + q_a))
    for k in range(len(time)):
        seen = math.isfinite(speed[k]) and math.isfinite(position[k])
        if started and time[k] - last_speed_time > 1.0:
            started = False  # a long gap: the old state is useless
        if not started:
            while next_sample < last_sample and acceleration_time[next_sample] <= time[k]:
                if math.isfinite(acceleration[next_sample]):
                    a = acceleration[next_sample]
                    last_acceleration_time = acceleration_time[next_sample]
                next_sample += 1
            friction[k] = d
            if not seen or missing[k]:
                status[k] = Status.GAP
                continue
            started = True
            d, v, q = viscous, speed[k], position[k]
            p = (initial_variance, 0.0, 0.0, 0.0, r_a, 0.0, 0.0, r_v, 0.0, r_q)
            settled = 0.0
            last_applicable = -math.inf
            forward = v > 0.0
            against = 0
            applicable = abs(v) >= minimum_speed
            now = last_speed_time = time[k]
            held = k
            friction[k] = d
            status[k] = Status.START_UP if applicable else Status.NOT_APPLICABLE
            continue
        while True:
            # The next event: an accelerometer sample at its own time, else the time of the speed.
            own_sample = next_sample < last_sample and acceleration_time[next_sample] <= time[k]
            until = acceleration_time[next_sample] if own_sample else time[k]
            step = until - now
            if step > 0.0:
                sine, cosine = math.sin(q - other_position[held]), math.cos(q - other_position[held])
                across, along = other_acceleration[held], other_speed[held] * other_speed[held]
                known = force[held] - gravity * math.cos(q) - coupling * (cosine * across + sine * along)
                by_angle = gravity * math.sin(q) - coupling * (cosine * along - sine * across)
                drift = q_d * step if applicable else 0.0
                p = predict_covariance(p, -v / inertia, -d / inertia, by_angle / inertia, step, drift, q_a, q_v, q_q)
                d, a, v, q = d, (known - d * v) / inertia, v + step * a, q + step * v
                now = until
            if not own_sample:
                break
            sample = acceleration[next_sample]
            if math.isfinite(sample) and step >= 0.0:
                column = (p[1], p[4], p[5], p[6])
                (d, a, v, q), p = correct((d, a, v, q), p, column, p[4] + r_a, sample - a, applicable)
                last_acceleration_time = until
            next_sample += 1
        if seen:
            applicable = abs(speed[k]) >= minimum_speed
            column = (p[2], p[5], p[7], p[8])
            (d, a, v, q), p = correct((d, a, v, q), p, column, p[7] + r_v, speed[k] - v, applicable)
            column = (p[3], p[6], p[8], p[9])
            (d, a, v, q), p = correct((d, a, v, q), p, column, p[9] + r_q, position[k] - q, applicable)
            gained = bandwidth_scale / inertia * abs(speed[k]) * math.sqrt(time[k] - last_speed_time)
            settled, against, forward, last_applicable = progress_of_settling(
                applicable, speed[k] > 0.0, time[k], gained, glitch, settled, against, forward, last_applicable
            )
            last_speed_time = time[k]
        held = k
        friction[k] = d
        if not math.isfinite(d + a + v + q):
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

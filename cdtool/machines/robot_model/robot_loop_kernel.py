"""The equations of motion of a robot with its sampled joint controllers, integrated by classical Runge-Kutta steps.

All quantities are on the load side. States of each joint: motor (x, w), link (q, v), drive torque T, bristle z::

    J w' = T - E(x - q) - F(w)
    (M(q) + stated) v' = E - h(q, v) - J_c' n F_c
    T' = (u - T) / lag
    z' = w - sigma0 |w| z / G(w),  F = sigma0 z + sigma1 z' + d w + offset  (de Wit and others, 1995)

E is an elastic drive, the same in both directions: k1 up to the take-up travel, then k2, and damping. Without a bristle
F = G(w) tanh(w / v0) + d w + offset with G = Fc + (Fs - Fc) exp(-(w / vs)^2). A rigid joint has J on the diagonal of M
and its friction at the link. A point of a link meets a fixed plane with the normal n: penetration p = n . P - place,
F_c = max(0, T(p) (1 + lambda p')), T piecewise linear, beyond its last point with its last slope. The controllers act
once per period, their commands are held.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel
from cdtool.machines.robot_model.chain_kernel import WORK, fill_dynamics, fill_lever, place_bodies, solve_in_place

Array = npt.NDArray[np.float64]

ROWS = (
    "motor_position",
    "motor_speed",
    "link_position",
    "link_speed",
    "drive_torque",
    "bristle",
    "link_acceleration",
    "measured_speed",
    "command",
    "wind_up",
)
"""The first index of the array that `integrate_robot` fills, then joint and sample; the first six are the states."""

INPUTS = ("reference_speed", "reference_position", "command")
"""The first index of the inputs; `command` replaces the controllers where the mode is `REPLAYED`."""

#: How the commands are made: by the joints' controllers, from the inputs, or by controllers that know the inertia. The
#: last are as stiff in every pose: u = h + M (gains), with gains in 1/s and 1/s2; an elastic joint has its motor's.
CONTROLLED, REPLAYED, INERTIAL = 0, 1, 2

#: The first of `ROWS`, to the bristle.
STATES = 6

# fmt: off
PARAMETERS = (
    "motor_mass", "rigid", "stated_inertia", "stiffness", "damping", "take_up_travel", "end_stiffness",
    "end_damping", "coulomb_forward", "coulomb_backward", "static", "stribeck_speed", "viscous", "offset",
    "smoothing_speed", "bristle_stiffness", "bristle_damping", "speed_gain", "integral_gain", "position_gain",
    "anti_windup_rate", "slew_limit", "force_limit", "speed_filter_hz", "speed_filter_order", "force_lag",
    "delay_samples",
)
# fmt: on
"""The rows of the joints' parameters."""

(
    _MOTOR,
    _RIGID,
    _STATED,
    _STIFFNESS,
    _DAMPING,
    _TRAVEL,
    _END,
    _END_DAMPING,
    _FORWARD,
    _BACKWARD,
    _STATIC,
    _STRIBECK,
    _VISCOUS,
    _OFFSET,
    _SMOOTHING,
    _BRISTLE,
    _BRISTLE_DAMPING,
    _GAIN,
    _INTEGRAL,
    _POSITION_GAIN,
    _ANTI_WINDUP,
    _SLEW,
    _LIMIT,
    _FILTER_HZ,
    _FILTER_ORDER,
    _LAG,
    _DELAY,
) = range(27)

# What is kept of each joint beside its state.
_BEFORE, _ONCE, _MEASURED, _SUM, _COMMAND, _ACTING, _KEEP, HELD = range(8)


@kernel(
    "float64(float64[:, ::1], float64[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64, float64[:, ::1], "
    "float64[:, ::1], float64[:, :, ::1], UniTuple(float64, 11), int64, int64, float64[:, :, ::1], float64[::1])",
)
def integrate_robot(
    bodies: Array,
    combination: Array,
    gravity: tuple[float, float, float],
    parameters: Array,
    period: float,
    force_curve: Array,
    initial_state: Array,
    inputs: Array,
    obstacle: tuple[float, ...],
    mode: int,
    substeps: int,
    log: Array,
    contact_force: Array,
) -> float:
    """Fill `log` (row of `ROWS`, joint, sample) and `contact_force` [N]; return the first contact's time [s] or NaN.

    `parameters` (row of `PARAMETERS`, joint); `force_curve` (2, points): penetration [m] and force [N], from (0, 0);
    `initial_state` (STATES + 1, J), last the controllers' integrals. `obstacle`: 1 where there is one, the index of the
    tree's joint that carries the point, the point in that joint's frame [m], the normal in base axes, the plane's place
    along it [m], lambda [s/m], the first sample at which it is there. `mode`: `CONTROLLED`, `REPLAYED` or `INERTIAL`.
    """
    count = initial_state.shape[1]
    has_obstacle = obstacle[0] > 0.5
    joint_hit = int(obstacle[1])
    point = (obstacle[2], obstacle[3], obstacle[4])
    normal = (obstacle[5], obstacle[6], obstacle[7])
    plane, contact_damping = obstacle[8], obstacle[9]
    first_sample = int(obstacle[10])
    points = force_curve.shape[1]
    step = period / substeps

    work = np.zeros((count, WORK))
    matrix = np.zeros((count, count))
    bias = np.zeros(count)
    lever = np.zeros(count)
    position = np.zeros(count)
    speed = np.zeros(count)
    pull = np.zeros(count)
    wanted_by = np.zeros(count)
    held = np.zeros((HELD, count))
    state = np.zeros((STATES, count))
    trial = np.zeros((STATES, count))
    slope = np.zeros((STATES, count))
    total = np.zeros((STATES, count))
    longest = 0
    for joint in range(count):
        longest = max(longest, int(parameters[_DELAY, joint]))
    pending = np.zeros((longest + 1, count))

    for joint in range(count):
        for row in range(STATES):
            state[row, joint] = initial_state[row, joint]
        held[_BEFORE, joint] = state[0, joint] - state[1, joint] * period
        held[_ONCE, joint] = held[_MEASURED, joint] = state[1, joint]
        held[_SUM, joint] = initial_state[STATES, joint]
        held[_COMMAND, joint] = state[4, joint]
        for row in range(longest + 1):
            pending[row, joint] = state[4, joint]
        if parameters[_FILTER_ORDER, joint] > 0.0 and parameters[_FILTER_HZ, joint] < math.inf:
            held[_KEEP, joint] = math.exp(-2.0 * math.pi * parameters[_FILTER_HZ, joint] * period)
    first_contact = math.nan
    penetration_before = -math.inf

    for sample in range(inputs.shape[2]):
        if mode == INERTIAL:
            for joint in range(count):
                position[joint] = state[2, joint]
                speed[joint] = state[3, joint]
            place_bodies(bodies, combination, position, work)
            fill_dynamics(bodies, combination, speed, gravity, work, matrix, bias)
        for joint in range(count):
            keep = held[_KEEP, joint]
            difference = (state[0, joint] - held[_BEFORE, joint]) / period
            held[_BEFORE, joint] = state[0, joint]
            held[_ONCE, joint] = keep * held[_ONCE, joint] + (1.0 - keep) * difference
            if parameters[_FILTER_ORDER, joint] > 1.5:
                held[_MEASURED, joint] = keep * held[_MEASURED, joint] + (1.0 - keep) * held[_ONCE, joint]
            else:
                held[_MEASURED, joint] = held[_ONCE, joint]
            if mode == REPLAYED:
                held[_COMMAND, joint] = inputs[2, joint, sample]
            else:
                error = inputs[0, joint, sample] - held[_MEASURED, joint]
                if parameters[_POSITION_GAIN, joint] > 0.0:
                    error += parameters[_POSITION_GAIN, joint] * (inputs[1, joint, sample] - state[0, joint])
                wanted = parameters[_GAIN, joint] * error + held[_SUM, joint]
                wanted_by[joint] = wanted
                if mode == INERTIAL:
                    held[_SUM, joint] += parameters[_INTEGRAL, joint] * error * period
                    continue
                largest_change = parameters[_SLEW, joint] * period
                change = min(max(wanted - held[_COMMAND, joint], -largest_change), largest_change)
                command = held[_COMMAND, joint] + change
                command = min(max(command, -parameters[_LIMIT, joint]), parameters[_LIMIT, joint])
                held[_COMMAND, joint] = command
                # Back-calculation: a comparison "is it limited?" would make the result jump with the step size.
                windup = parameters[_ANTI_WINDUP, joint] * (command - wanted)
                held[_SUM, joint] += (parameters[_INTEGRAL, joint] * error + windup) * period
        for joint in range(count):
            if mode == INERTIAL:
                command = bias[joint] + parameters[_MOTOR, joint] * wanted_by[joint]
                if parameters[_RIGID, joint] > 0.5:
                    command += parameters[_STATED, joint] * wanted_by[joint]
                    for other in range(count):
                        if parameters[_RIGID, other] > 0.5:
                            command += matrix[joint, other] * wanted_by[other]
                held[_COMMAND, joint] = command
            delay = int(parameters[_DELAY, joint])
            pending[sample % (delay + 1), joint] = held[_COMMAND, joint]
            held[_ACTING, joint] = pending[(sample + 1) % (delay + 1), joint]
            if parameters[_LAG, joint] <= 0.0:
                state[4, joint] = held[_ACTING, joint]

        for substep in range(substeps):
            for stage in range(4):
                reach = 0.0 if stage == 0 else step if stage == 3 else 0.5 * step
                # Element by element: array assignments would triple the time to compile.
                for row in range(STATES):
                    for joint in range(count):
                        trial[row, joint] = state[row, joint] + reach * slope[row, joint]
                        if stage == 0:
                            total[row, joint] = 0.0
                for joint in range(count):
                    position[joint] = trial[2, joint]
                    speed[joint] = trial[3, joint]
                place_bodies(bodies, combination, position, work)
                fill_dynamics(bodies, combination, speed, gravity, work, matrix, bias)

                force = 0.0
                if has_obstacle and sample >= first_sample:
                    penetration = fill_lever(bodies, combination, joint_hit, point, normal, work, lever) - plane
                    if penetration > 0.0:
                        last = 1
                        while last < points - 1 and penetration > force_curve[0, last]:
                            last += 1
                        share = (penetration - force_curve[0, last - 1]) / (
                            force_curve[0, last] - force_curve[0, last - 1]
                        )
                        force = force_curve[1, last - 1] + share * (force_curve[1, last] - force_curve[1, last - 1])
                        approach = 0.0
                        for joint in range(count):
                            approach += lever[joint] * speed[joint]
                        force = max(force * max(1.0 + contact_damping * approach, 0.0), 0.0)
                    if stage == 0:
                        if math.isnan(first_contact) and penetration > 0.0:
                            share = 1.0
                            if penetration_before < 0.0 and not math.isinf(penetration_before):
                                share = penetration_before / (penetration_before - penetration)
                            first_contact = sample * period + (substep - 1.0 + share) * step
                        penetration_before = penetration

                for joint in range(count):
                    is_rigid = parameters[_RIGID, joint] > 0.5
                    w = speed[joint] if is_rigid else trial[1, joint]
                    coulomb = parameters[_FORWARD, joint] if w >= 0.0 else parameters[_BACKWARD, joint]
                    if parameters[_STATIC, joint] > coulomb:
                        rise = parameters[_STATIC, joint] - coulomb
                        coulomb += rise * math.exp(-((w / parameters[_STRIBECK, joint]) ** 2))
                    friction = parameters[_VISCOUS, joint] * w + parameters[_OFFSET, joint]
                    slope[5, joint] = 0.0
                    if parameters[_BRISTLE, joint] > 0.0 and coulomb > 0.0:
                        bristle = trial[5, joint]
                        slope[5, joint] = w - parameters[_BRISTLE, joint] * abs(w) * bristle / coulomb
                        friction += parameters[_BRISTLE, joint] * bristle
                        friction += parameters[_BRISTLE_DAMPING, joint] * slope[5, joint]
                    else:
                        friction += coulomb * math.tanh(w / parameters[_SMOOTHING, joint])
                    torque = trial[4, joint]
                    matrix[joint, joint] += parameters[_STATED, joint]
                    if is_rigid:
                        matrix[joint, joint] += parameters[_MOTOR, joint]
                        pull[joint] = torque - friction
                    else:
                        wind_up = trial[0, joint] - trial[2, joint]
                        beyond = max(abs(wind_up) - parameters[_TRAVEL, joint], 0.0)
                        elastic = parameters[_STIFFNESS, joint] * (abs(wind_up) - beyond)
                        elastic += parameters[_END, joint] * beyond
                        damping = parameters[_DAMPING, joint] if beyond <= 0.0 else parameters[_END_DAMPING, joint]
                        drive = math.copysign(elastic, wind_up) + damping * (w - speed[joint])
                        slope[0, joint] = w
                        slope[1, joint] = (torque - drive - friction) / parameters[_MOTOR, joint]
                        pull[joint] = drive
                    pull[joint] -= bias[joint]
                    if force > 0.0:
                        pull[joint] -= lever[joint] * force
                    lag = parameters[_LAG, joint]
                    slope[4, joint] = (held[_ACTING, joint] - torque) / lag if lag > 0.0 else 0.0
                solve_in_place(matrix, pull)
                for joint in range(count):
                    slope[2, joint] = speed[joint]
                    slope[3, joint] = pull[joint]
                    if parameters[_RIGID, joint] > 0.5:
                        slope[0, joint] = speed[joint]
                        slope[1, joint] = pull[joint]

                if stage == 0 and substep == 0:
                    for joint in range(count):
                        for row in range(STATES):
                            log[row, joint, sample] = state[row, joint]
                        log[6, joint, sample] = slope[3, joint]
                        log[7, joint, sample] = held[_MEASURED, joint]
                        log[8, joint, sample] = held[_COMMAND, joint]
                        log[9, joint, sample] = state[0, joint] - state[2, joint]
                    contact_force[sample] = force
                weight = step / 6.0 if stage == 0 or stage == 3 else step / 3.0
                for row in range(STATES):
                    for joint in range(count):
                        total[row, joint] += weight * slope[row, joint]

            for row in range(STATES):
                for joint in range(count):
                    state[row, joint] += total[row, joint]
    return first_contact

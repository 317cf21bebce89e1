"""The equations of motion of one axis with its sampled controller, integrated by classical Runge-Kutta steps.

All quantities are on the load side. States: motor (x_m, v_m), load (x, v), front mass (x_f, v_f), drive force F::

    m_m v_m' = F - F_el(x_m - x) - f_m tanh(v_m / v_0)
    m v'     = F_el - F_r(v) - offset - F_front + disturbance
    m_f v_f' = F_front - F_c
    F'       = (u - F) / lag

A rigid drive has m_m + m on one coordinate; without a front mass the contact acts on the load. The contact opposes the
direction of approach s with F_c = max(0, T(p) (1 + lambda p')), penetration p = s (x_f - x_obstacle), and T piecewise
linear, beyond its last point with its last slope. The controller acts once per period, its command is held.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel

Array = npt.NDArray[np.float64]

ROWS = (
    "motor_position",
    "motor_speed",
    "load_position",
    "load_speed",
    "front_position",
    "front_speed",
    "drive_force",
    "contact_force",
    "load_acceleration",
    "measured_speed",
    "command",
    "wind_up",
)
"""The rows of the array that `integrate_axis` fills; the first seven are the states."""

INPUTS = ("reference_speed", "reference_position", "command", "disturbance")
"""The rows of the inputs, one value per controller period; `command` is used where `replay` is 1 or 2."""

# fmt: off
PARAMETER_ORDER = (
    "motor_mass", "load_mass", "rigid", "stiffness", "damping", "take_up_travel", "end_stiffness", "end_damping",
    "backlash", "motor_friction", "front_mass", "front_stiffness", "front_damping", "coulomb_forward",
    "coulomb_backward", "static", "stribeck_speed", "viscous", "offset", "smoothing_speed", "period", "speed_gain",
    "integral_gain", "position_gain", "anti_windup_rate", "slew_limit", "force_limit", "speed_filter_hz",
    "speed_filter_order", "force_lag", "delay_samples",
)
# fmt: on
"""The numbers that the kernel unpacks; `rigid` is 1 or 0, `load_mass` is without the front mass."""


@kernel(
    "float64(UniTuple(float64, 31), float64[:, ::1], float64[::1], float64[:, ::1], UniTuple(float64, 6), "
    "float64, int64, float64[:, ::1])",
)
def integrate_axis(
    parameters: tuple[float, ...],
    force_curve: Array,
    initial_state: Array,
    inputs: Array,
    obstacle: tuple[float, float, float, float, float, float],
    replay: float,
    substeps: int,
    log: Array,
) -> float:
    """Fill `log` (a row per name of `ROWS`, a column per period); return the time of first contact [s] or NaN.

    `force_curve` (2, points): penetration [m] and force [N], from (0, 0). `initial_state` (8,): the seven states and
    the controller's integral [N]. `replay`: 0 for the controller alone, 1 with the input `command` added to its output,
    2 for this command alone. `obstacle`: 1 where there is one, its position [m], the direction of approach +-1,
    lambda [s/m], from when on it is there [s], and from when on the slew limit applies [s].
    """
    (
        motor_mass,
        load_mass,
        rigid,
        stiffness,
        damping,
        take_up_travel,
        end_stiffness,
        end_damping,
        backlash,
        motor_friction,
        front_mass,
        front_stiffness,
        front_damping,
        coulomb_forward,
        coulomb_backward,
        static,
        stribeck_speed,
        viscous,
        offset,
        smoothing_speed,
        period,
        speed_gain,
        integral_gain,
        position_gain,
        anti_windup_rate,
        slew_limit,
        force_limit,
        speed_filter_hz,
        speed_filter_order,
        force_lag,
        delay_samples,
    ) = parameters
    has_obstacle, obstacle_position, direction, contact_damping, present_from, limited_from = obstacle
    step = period / substeps
    keep = 0.0
    if speed_filter_order > 0.0 and speed_filter_hz < math.inf:
        keep = math.exp(-2.0 * math.pi * speed_filter_hz * period)
    is_rigid = rigid > 0.5
    has_front = front_mass > 0.0
    points = force_curve.shape[1]
    delay = int(delay_samples)
    pending = np.zeros(delay + 1)

    state = initial_state[:7].copy()
    trial = np.empty(7)
    slope = np.empty(7)
    total = np.empty(7)
    first_contact = math.nan
    position_before = state[0] - state[1] * period
    once_filtered = state[1]
    measured_speed = state[1]
    integral = initial_state[7]
    command = state[6]
    for index in range(delay + 1):
        pending[index] = command

    for sample in range(inputs.shape[1]):
        once_filtered = keep * once_filtered + (1.0 - keep) * (state[0] - position_before) / period
        position_before = state[0]
        if speed_filter_order > 1.5:
            measured_speed = keep * measured_speed + (1.0 - keep) * once_filtered
        else:
            measured_speed = once_filtered
        if replay > 1.5:
            command = inputs[2, sample]
        else:
            error = inputs[0, sample] - measured_speed
            if position_gain > 0.0:
                error += position_gain * (inputs[1, sample] - state[0])
            wanted = speed_gain * error + integral
            if replay > 0.5:
                wanted += inputs[2, sample]
            largest_change = slew_limit * period if sample * period >= limited_from else math.inf
            command += min(max(wanted - command, -largest_change), largest_change)
            command = min(max(command, -force_limit), force_limit)
            # Back-calculation: a comparison "is it limited?" would make the result jump with the step size.
            integral += (integral_gain * error + anti_windup_rate * (command - wanted)) * period
        pending[sample % (delay + 1)] = command
        acting = pending[(sample + 1) % (delay + 1)]
        if force_lag <= 0.0:
            state[6] = acting

        for substep in range(substeps):
            is_present = has_obstacle > 0.5 and sample * period + substep * step >= present_from
            # Element by element: array assignments would triple the time to compile.
            for index in range(7):
                total[index] = 0.0
                trial[index] = state[index]
            for stage in range(4):
                if stage > 0:
                    reach = step if stage == 3 else 0.5 * step
                    for index in range(7):
                        trial[index] = state[index] + reach * slope[index]
                x_m, v_m, x, v, x_f, v_f, force = trial
                if is_rigid:
                    x = x_m
                    v = v_m
                if not has_front:
                    x_f = x
                    v_f = v

                # Friction: Coulomb by direction with a Stribeck rise, smoothed sign.
                coulomb = coulomb_forward if v >= 0.0 else coulomb_backward
                if static > coulomb:
                    coulomb += (static - coulomb) * math.exp(-((v / stribeck_speed) ** 2))
                friction = coulomb * math.tanh(v / smoothing_speed) + viscous * v + offset

                contact = 0.0
                if is_present:
                    penetration = direction * (x_f - obstacle_position)
                    if penetration > 0.0:
                        last = 1
                        while last < points - 1 and penetration > force_curve[0, last]:
                            last += 1
                        share = (penetration - force_curve[0, last - 1]) / (
                            force_curve[0, last] - force_curve[0, last - 1]
                        )
                        contact = force_curve[1, last - 1] + share * (force_curve[1, last] - force_curve[1, last - 1])
                        contact *= max(1.0 + contact_damping * direction * v_f, 0.0)
                        contact = max(contact, 0.0)

                front = direction * contact
                if has_front:
                    front = front_stiffness * (x - x_f) + front_damping * (v - v_f)
                    slope[4] = v_f
                    slope[5] = (front - direction * contact) / front_mass
                else:
                    slope[4] = 0.0
                    slope[5] = 0.0

                if is_rigid:
                    smooth_sign = math.tanh(v / smoothing_speed)
                    slope[0] = v
                    slope[1] = (force - motor_friction * smooth_sign - friction - front + inputs[3, sample]) / (
                        motor_mass + load_mass
                    )
                    slope[2] = v
                    slope[3] = slope[1]
                else:
                    # The sign limit: no pulling through the dead zone.
                    wind_up = x_m - x
                    wind_up_speed = v_m - v
                    drive = 0.0
                    if wind_up >= take_up_travel:
                        drive = stiffness * take_up_travel + end_stiffness * (wind_up - take_up_travel)
                        drive = max(drive + end_damping * wind_up_speed, 0.0)
                    elif wind_up >= 0.0:
                        drive = max(stiffness * wind_up + damping * wind_up_speed, 0.0)
                    elif wind_up < -backlash:
                        # One stiffness for both flanks where no end stiffness is given.
                        back = wind_up + backlash
                        if end_stiffness < math.inf:
                            drive = min(end_stiffness * back + end_damping * wind_up_speed, 0.0)
                        else:
                            drive = min(stiffness * back + damping * wind_up_speed, 0.0)
                    smooth_sign = math.tanh(v_m / smoothing_speed)
                    slope[0] = v_m
                    slope[1] = (force - drive - motor_friction * smooth_sign) / motor_mass
                    slope[2] = v
                    slope[3] = (drive - friction - front + inputs[3, sample]) / load_mass
                slope[6] = (acting - force) / force_lag if force_lag > 0.0 else 0.0
                if stage == 0 and substep == 0:
                    for index in range(7):
                        log[index, sample] = state[index]
                    log[7, sample] = contact
                    log[8, sample] = slope[3]
                    log[9, sample] = measured_speed
                    log[10, sample] = command
                    log[11, sample] = state[0] - state[2]
                weight = step / 6.0 if stage == 0 or stage == 3 else step / 3.0
                for index in range(7):
                    total[index] += weight * slope[index]

            before = state[4]
            for index in range(7):
                state[index] += total[index]
            if is_rigid:
                state[2] = state[0]
                state[3] = state[1]
            if not has_front:
                state[4] = state[2]
                state[5] = state[3]
            reached = direction * (state[4] - obstacle_position)
            if is_present and math.isnan(first_contact) and reached > 0.0:
                moved = state[4] - before
                share = (obstacle_position - before) / moved if moved != 0.0 else 1.0
                first_contact = sample * period + (substep + min(max(share, 0.0), 1.0)) * step
    return first_contact

"""The sliding gate's equations of motion and its speed loop, integrated by classical Runge-Kutta steps.

All quantities are on the load side (m, m/s, N). States: motor (x_m, v_m), leaf (x, v), front post (x_f, v_f)
and the force F_m of the current loop, so that its lag is integrated with the same fourth order as the rest::

    m_m v_m' = F_m + F_cog sin(n x_m / r + phase) - F_el - F_fm tanh(v_m / v_s)
    m v'     = F_el - F_f(x, v) - F_post + disturbance
    m_f v_f' = F_post - F_contact
    F_m'     = (u - F_m) / lag

Control, disturbance and resolver are sampled once per log period and held over its sub-steps.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel

Array = npt.NDArray[np.float64]

CONTACT_KINDS = {"none": 0, "stiff": 1, "soft": 2}

ROWS = (
    "motor_position",
    "motor_speed",
    "leaf_position",
    "leaf_speed",
    "post_position",
    "post_speed",
    "motor_force",
    "contact_force",
    "leaf_acceleration",
    "measured_position",
    "measured_speed",
    "reference_force",
    "bumper_compression",
)
"""The rows of the array that `integrate_gate` fills; the first seven are the states."""

# fmt: off
Numbers = namedtuple("Numbers", (
    "motor_mass", "leaf_main_mass", "post_mass", "transmission_ratio", "take_up_stiffness",
    "take_up_damping", "take_up_travel", "drive_stiffness", "drive_damping", "backlash", "motor_friction",
    "coulomb_friction", "static_friction", "stribeck_speed", "viscous_friction", "friction_waviness",
    "friction_smoothing_speed", "cogging_force", "cogging_periods", "post_stiffness", "post_damping",
    "load_cell_stiffness", "load_cell_damping", "bumper_stiffness", "bumper_buckling_travel",
    "bumper_buckled_stiffness", "bumper_bottom_travel", "bumper_bottom_stiffness", "bumper_damping",
    "speed_gain", "integral_gain", "anti_windup_rate", "force_slew_limit", "force_limit", "current_lag",
    "resolver_step", "speed_filter_frequency", "sample_period",
))
# fmt: on
"""The attributes of `GateParameters` that the kernel takes."""


@kernel(
    "float64(NamedUniTuple(float64, 38, Numbers), float64[:, ::1], float64[::1], float64[::1], float64[::1], "
    "UniTuple(float64, 3), int64, int64, float64[:, ::1])"
)
def integrate_gate(
    p: Numbers,
    friction_waves: Array,
    initial_state: Array,
    reference_speed: Array,
    disturbance: Array,
    run: tuple[float, float, float],
    contact_kind: int,
    substeps: int,
    log: Array,
) -> float:
    """Fill `log` (a row per name of `ROWS`, a column per sample); return the time of first contact [s] or NaN.

    `friction_waves` has a row (length [m], phase [rad], weight [-]) per wave. `reference_speed` [m/s] and
    `disturbance` [N] are held over each sample; `run` holds the run's friction factor [-], cogging phase
    [rad] and obstacle position [m].
    """
    friction_factor, cogging_phase, obstacle = run
    step = p.sample_period / substeps
    keep = math.exp(-2.0 * math.pi * p.speed_filter_frequency * p.sample_period)
    cogging_rate = p.cogging_periods / p.transmission_ratio
    buckling_force = p.bumper_stiffness * p.bumper_buckling_travel
    bottom_force = buckling_force + p.bumper_buckled_stiffness * (p.bumper_bottom_travel - p.bumper_buckling_travel)

    state = initial_state.copy()
    trial = np.empty(7)
    slope = np.empty(7)
    total = np.empty(7)
    first_contact = math.nan
    counted_before = 0.0
    once_filtered = 0.0
    measured_speed = 0.0
    integrator = 0.0
    reference_force = 0.0

    for sample in range(reference_speed.size):
        # Resolver, its speed, and the speed controller: sampled events.
        counted = state[0]
        if p.resolver_step > 0.0:
            counted = math.floor(state[0] / p.resolver_step) * p.resolver_step
        if sample == 0:
            counted_before = counted
        once_filtered = keep * once_filtered + (1.0 - keep) * (counted - counted_before) / p.sample_period
        measured_speed = keep * measured_speed + (1.0 - keep) * once_filtered
        counted_before = counted
        error = reference_speed[sample] - measured_speed
        wanted = p.speed_gain * error + integrator
        largest_change = p.force_slew_limit * p.sample_period
        reference_force += min(max(wanted - reference_force, -largest_change), largest_change)
        reference_force = min(max(reference_force, -p.force_limit), p.force_limit)
        # Back-calculation: a comparison "is it limited?" would make the result jump with the step size.
        integrator += (p.integral_gain * error + p.anti_windup_rate * (reference_force - wanted)) * p.sample_period

        for substep in range(substeps):
            # Element by element: array assignments would triple the time to compile.
            for index in range(7):
                total[index] = 0.0
                trial[index] = state[index]
            for stage in range(4):
                if stage > 0:
                    reach = step if stage == 3 else 0.5 * step
                    for index in range(7):
                        trial[index] = state[index] + reach * slope[index]
                x_m, v_m, x, v, x_f, v_f, f_m = trial

                # Drive: soft take-up, then stiff; the sign limit: no pulling through the dead zone.
                wind_up = x_m - x
                wind_up_speed = v_m - v
                drive = 0.0
                if wind_up >= p.take_up_travel:
                    drive = p.take_up_stiffness * p.take_up_travel + p.drive_stiffness * (wind_up - p.take_up_travel)
                    drive = max(drive + p.drive_damping * wind_up_speed, 0.0)
                elif wind_up >= 0.0:
                    drive = max(p.take_up_stiffness * wind_up + p.take_up_damping * wind_up_speed, 0.0)
                elif wind_up < -p.backlash:
                    drive = min(p.drive_stiffness * (wind_up + p.backlash) + p.drive_damping * wind_up_speed, 0.0)

                # Friction of the leaf: waves along the track, Stribeck rise, smoothed sign.
                wave = 0.0
                for row in range(friction_waves.shape[0]):
                    angle = 2.0 * math.pi * x / friction_waves[row, 0] + friction_waves[row, 1]
                    wave += friction_waves[row, 2] * math.sin(angle)
                coulomb = p.coulomb_friction * friction_factor * (1.0 + p.friction_waviness * wave)
                stribeck = (p.static_friction - coulomb) * math.exp(-((v / p.stribeck_speed) ** 2))
                friction = (coulomb + stribeck) * math.tanh(v / p.friction_smoothing_speed) + p.viscous_friction * v

                post = p.post_stiffness * (x - x_f) + p.post_damping * (v - v_f)

                # Contact: the load cell alone, or the bumper's branch whose force equals the cell's.
                contact = 0.0
                compression = 0.0
                penetration = x_f - obstacle
                if contact_kind > 0 and penetration > 0.0:
                    cell = p.load_cell_stiffness * max(1.0 + p.load_cell_damping * v_f, 0.0)
                    if contact_kind == 1:
                        contact = cell * penetration
                    else:
                        gain = max(1.0 + p.bumper_damping * v_f, 1e-9)
                        compression = cell * penetration / (cell + gain * p.bumper_stiffness)
                        if compression > p.bumper_buckling_travel:
                            offset = gain * (buckling_force - p.bumper_buckled_stiffness * p.bumper_buckling_travel)
                            compression = (cell * penetration - offset) / (cell + gain * p.bumper_buckled_stiffness)
                        if compression > p.bumper_bottom_travel:
                            offset = gain * (bottom_force - p.bumper_bottom_stiffness * p.bumper_bottom_travel)
                            compression = (cell * penetration - offset) / (cell + gain * p.bumper_bottom_stiffness)
                        contact = cell * (penetration - compression)

                cogging = p.cogging_force * math.sin(cogging_rate * x_m + cogging_phase)
                smooth_sign = math.tanh(v_m / p.friction_smoothing_speed)
                slope[0] = v_m
                slope[1] = (f_m + cogging - drive - p.motor_friction * smooth_sign) / p.motor_mass
                slope[2] = v
                slope[3] = (drive - friction - post + disturbance[sample]) / p.leaf_main_mass
                slope[4] = v_f
                slope[5] = (post - contact) / p.post_mass
                slope[6] = (reference_force - f_m) / p.current_lag
                if stage == 0 and substep == 0:
                    for index in range(7):
                        log[index, sample] = state[index]
                    log[7, sample] = contact
                    log[8, sample] = slope[3]
                    log[9, sample] = counted
                    log[10, sample] = measured_speed
                    log[11, sample] = reference_force
                    log[12, sample] = compression
                weight = step / 6.0 if stage == 0 or stage == 3 else step / 3.0
                for index in range(7):
                    total[index] += weight * slope[index]

            before = state[4]
            for index in range(7):
                state[index] += total[index]
            if contact_kind > 0 and math.isnan(first_contact) and state[4] > obstacle:
                share = (obstacle - before) / (state[4] - before)
                first_contact = sample * p.sample_period + (substep + share) * step
    return first_contact

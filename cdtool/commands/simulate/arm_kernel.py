"""The two-link arm's equations of motion and its joint controllers, integrated by classical Runge-Kutta steps.

Joint side: absolute link angles q and motor angles over the transmission, theta = n theta_m. States, two of each:
theta, w = theta', q, qd = q', the friction's bristle z and the motor torque T, whose lag is integrated with the rest::

    J_a/n^2 w_i' = T_i + ripple sin(periods theta_i / n + phase_i) - E_i - F_i - b w_i
    M11 qdd1 + h c qdd2 = E_1 + disturbance_1 + h s qd2^2 - g1 cos q1 - (contact torque)_1
    h c qdd1 + M22 qdd2 = E_2 + disturbance_2 - h s qd1^2 - g2 cos q2 - (contact torque)_2
    z_i' = w_i - sigma0 |w_i| z_i / (Fc + (Fs - Fc) exp(-(w_i / vs)^2)),  F_i = sigma0 z_i + sigma1 z_i'
    T_i' = (u_i - T_i) / lag

with c = cos(q2 - q1), s = sin(q2 - q1) and E_i the elastic drive (thesis 6.21, 6.22 with elastic joints).
Control, disturbance and encoder are sampled once per log period and held over its sub-steps.
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
    "link_position",
    "link_speed",
    "bristle",
    "motor_torque",
    "link_acceleration",
    "measured_position",
    "measured_speed",
    "reference_torque",
)
"""The first index of the array that `integrate_arm` fills, the joint being the second; the first six are the states."""

# fmt: off
Numbers = namedtuple("Numbers", (
    "arm_inertia", "forearm_inertia", "coupling_inertia", "arm_length", "soft_stiffness", "soft_travel",
    "drive_stiffness", "drive_damping", "stribeck_speed", "viscous_friction", "bristle_stiffness", "bristle_damping",
    "torque_ripple", "ripple_periods", "obstacle_stiffness", "obstacle_damping", "bumper_stiffness", "bumper_travel",
    "bumper_bottom_stiffness", "bumper_damping", "position_gain", "speed_gain", "integral_gain", "anti_windup_rate",
    "torque_limit", "torque_lag", "speed_filter_frequency", "sample_period",
))
Pairs = namedtuple("Pairs", (
    "reflected_inertia", "gravity_torque", "transmission_ratio", "coulomb_friction", "static_friction",
    "contact_position", "encoder_step", "ripple_phase",
))
# fmt: on
"""The attributes of `ArmParameters` that the kernel takes; of `Pairs`, one for each joint."""

# What is kept of each joint beside its state: rows of `held`.
_DRIVE, _COUNTED, _ONCE, _SPEED, _INTEGRATOR, _COMMAND, HELD = range(7)


@kernel(
    "float64(NamedUniTuple(float64, 28, Numbers), NamedUniTuple(UniTuple(float64, 2), 8, Pairs), "
    f"{', '.join(8 * ['float64[:, ::1]'])}, "
    "float64[::1], float64, int64, int64, int64, float64[:, :, ::1], float64[::1])"
)
def integrate_arm(
    p: Numbers,
    of: Pairs,
    state: Array,
    trial_state: Array,
    slope: Array,
    total: Array,
    held: Array,
    reference_position: Array,
    reference_speed: Array,
    disturbance: Array,
    friction_factor: Array,
    obstacle: float,
    trial: int,
    contact_kind: int,
    substeps: int,
    log: Array,
    contact_force: Array,
) -> float:
    """Fill `log` (row of `ROWS`, joint, sample) and `contact_force` [N]; return the first contact's instant [s] or NaN.

    `state` (6, 2) is the initial one, and overwritten, as are the scratch arrays `trial_state`, `slope`, `total` (6, 2)
    and `held` (HELD, 2): arrays made in here would double the time to compile. `reference_position` [rad],
    `reference_speed` [rad/s] and `disturbance` [N m] are (2, n) and held over each sample; `friction_factor` (2,)
    scales each joint's Coulomb and static friction. `obstacle` is
    the arm's angle at the touch [rad] in trial 1, the plate's height [m] in trial 2.
    """
    step = p.sample_period / substeps
    keep = math.exp(-2.0 * math.pi * p.speed_filter_frequency * p.sample_period)

    for joint in range(2):
        held[_INTEGRATOR, joint] = state[5, joint]
    first_contact = math.nan
    penetration_before = -math.inf

    for sample in range(reference_speed.shape[1]):
        # Encoder, its speed, and the joint controllers: sampled events.
        for joint in range(2):
            counted = state[0, joint]
            if of.encoder_step[joint] > 0.0:
                counted = math.floor(counted / of.encoder_step[joint]) * of.encoder_step[joint]
            if sample == 0:
                held[_COUNTED, joint] = counted
            difference = (counted - held[_COUNTED, joint]) / p.sample_period
            held[_ONCE, joint] = keep * held[_ONCE, joint] + (1.0 - keep) * difference
            held[_SPEED, joint] = keep * held[_SPEED, joint] + (1.0 - keep) * held[_ONCE, joint]
            held[_COUNTED, joint] = counted
            lag_error = reference_position[joint, sample] - counted
            error = reference_speed[joint, sample] + p.position_gain * lag_error - held[_SPEED, joint]
            wanted = p.speed_gain * error + held[_INTEGRATOR, joint]
            held[_COMMAND, joint] = min(max(wanted, -p.torque_limit), p.torque_limit)
            # Back-calculation: a comparison "is it limited?" would make the result jump with the step size.
            excess = held[_COMMAND, joint] - wanted
            held[_INTEGRATOR, joint] += (p.integral_gain * error + p.anti_windup_rate * excess) * p.sample_period
            log[7, joint, sample] = counted
            log[8, joint, sample] = held[_SPEED, joint]
            log[9, joint, sample] = held[_COMMAND, joint]

        for substep in range(substeps):
            for stage in range(4):
                reach = 0.0 if stage == 0 else step if stage == 3 else 0.5 * step
                # Element by element: array assignments would triple the time to compile.
                for row in range(6):
                    for joint in range(2):
                        trial_state[row, joint] = state[row, joint] + reach * slope[row, joint]
                        total[row, joint] = 0.0 if stage == 0 else total[row, joint]

                for joint in range(2):
                    theta, w = trial_state[0, joint], trial_state[1, joint]
                    wind_up = theta - trial_state[2, joint]
                    # Elastic drive: soft up to its travel, then stiff, the same in both directions.
                    beyond = max(abs(wind_up) - p.soft_travel, 0.0)
                    elastic = p.soft_stiffness * (abs(wind_up) - beyond) + p.drive_stiffness * beyond
                    held[_DRIVE, joint] = math.copysign(elastic, wind_up) + p.drive_damping * (
                        w - trial_state[3, joint]
                    )

                    coulomb = friction_factor[joint] * of.coulomb_friction[joint]
                    static = friction_factor[joint] * of.static_friction[joint]
                    sliding = coulomb + (static - coulomb) * math.exp(-((w / p.stribeck_speed) ** 2))
                    # A frictionless joint has no bristle to bend; the law itself would be 0 / 0.
                    bristle_speed = 0.0
                    friction = p.viscous_friction * w
                    if sliding > 0.0:
                        bristle = trial_state[4, joint]
                        bristle_speed = w - p.bristle_stiffness * abs(w) * bristle / sliding
                        friction += p.bristle_stiffness * bristle + p.bristle_damping * bristle_speed
                    angle = p.ripple_periods * theta / of.transmission_ratio[joint] + of.ripple_phase[joint]
                    ripple = p.torque_ripple * math.sin(angle)
                    torque = trial_state[5, joint]
                    slope[0, joint] = w
                    slope[1, joint] = (torque + ripple - held[_DRIVE, joint] - friction) / of.reflected_inertia[joint]
                    slope[2, joint] = trial_state[3, joint]
                    slope[4, joint] = bristle_speed
                    slope[5, joint] = (held[_COMMAND, joint] - torque) / p.torque_lag

                q1, q2 = trial_state[2, 0], trial_state[2, 1]
                qd1, qd2 = trial_state[3, 0], trial_state[3, 1]
                # Contact: against the arm, or a horizontal plate above the forearm, which loads both joints.
                if trial == 1:
                    lever_1, lever_2 = of.contact_position[0], 0.0
                    penetration = of.contact_position[0] * (q1 - obstacle)
                else:
                    lever_1, lever_2 = p.arm_length * math.cos(q1), of.contact_position[1] * math.cos(q2)
                    penetration = p.arm_length * math.sin(q1) + of.contact_position[1] * math.sin(q2) - obstacle
                force = 0.0
                if contact_kind > 0 and penetration > 0.0:
                    penetration_speed = lever_1 * qd1 + lever_2 * qd2
                    if contact_kind == 1:
                        force = (
                            p.obstacle_stiffness * penetration * max(1.0 + p.obstacle_damping * penetration_speed, 0.0)
                        )
                    else:
                        beyond = max(penetration - p.bumper_travel, 0.0)
                        force = p.bumper_stiffness * (penetration - beyond) + p.bumper_bottom_stiffness * beyond
                        force *= max(1.0 + p.bumper_damping * penetration_speed, 0.0)

                sine, coupling = math.sin(q2 - q1), p.coupling_inertia * math.cos(q2 - q1)
                pull_1 = (
                    held[_DRIVE, 0] + disturbance[0, sample] - of.gravity_torque[0] * math.cos(q1) - lever_1 * force
                )
                pull_2 = (
                    held[_DRIVE, 1] + disturbance[1, sample] - of.gravity_torque[1] * math.cos(q2) - lever_2 * force
                )
                pull_1 += p.coupling_inertia * sine * qd2 * qd2
                pull_2 -= p.coupling_inertia * sine * qd1 * qd1
                determinant = p.arm_inertia * p.forearm_inertia - coupling * coupling
                slope[3, 0] = (p.forearm_inertia * pull_1 - coupling * pull_2) / determinant
                slope[3, 1] = (p.arm_inertia * pull_2 - coupling * pull_1) / determinant

                if stage == 0:
                    if contact_kind > 0 and math.isnan(first_contact) and penetration > 0.0:
                        share = 1.0 - penetration / (penetration - penetration_before)
                        first_contact = sample * p.sample_period + (substep - 1.0 + share) * step
                    penetration_before = penetration
                    if substep == 0:
                        for joint in range(2):
                            for row in range(6):
                                log[row, joint, sample] = state[row, joint]
                            log[6, joint, sample] = slope[3, joint]
                        contact_force[sample] = force
                weight = step / 6.0 if stage == 0 or stage == 3 else step / 3.0
                for row in range(6):
                    for joint in range(2):
                        total[row, joint] += weight * slope[row, joint]

            for row in range(6):
                for joint in range(2):
                    state[row, joint] += total[row, joint]
    return first_contact

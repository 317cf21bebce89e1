"""The load side of an elastic axis during a contact, driven by the measured motion of the motor and the measured force.

In the direction of approach, with the wind-up d = x_m - x; F_el(d, d') as in
`cdtool.machines.axis_model.axis_loop_kernel`::

    m v'     = F_el - F_r(v) - offset - F_front
    m_f v_f' = F_front - F_c,  F_front = k_f (x - x_f) + c_f (v - v_f)

Without a front mass F_front = F_c. The damping changes continuously around the take-up travel. Motor and force have one
value per sample and are interpolated between samples; the integration is by classical Runge-Kutta steps.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel

Array = npt.NDArray[np.float64]

# The damping changes over this share of the take-up travel.
_BLEND = 0.03

ROWS = ("drive_force", "load_acceleration", "wind_up", "load_speed")
"""The rows of the output."""

INPUTS = ("motor_position", "motor_speed", "contact_force")
"""The rows of the inputs, one value per sample."""

# fmt: off
PARAMETER_ORDER = (
    "main_mass", "stiffness", "damping", "take_up_travel", "end_stiffness", "end_damping", "backlash", "front_mass",
    "front_stiffness", "front_damping", "coulomb_forward", "coulomb_backward", "static", "stribeck_speed", "viscous",
    "offset", "smoothing_speed", "period",
)
# fmt: on
"""The numbers that the kernel unpacks; forward is the direction of approach."""


@kernel(
    "void(UniTuple(float64, 18), float64[::1], float64[:, ::1], int64, float64[:, ::1])",
)
def simulate_contact(
    parameters: tuple[float, ...], initial_state: Array, inputs: Array, substeps: int, output: Array
) -> None:
    """Fill `output` (4, n), a row per name of `ROWS`, a column per sample of `inputs` (3, n).

    `initial_state` (4,): position [m] and speed [m/s] of the load and of the front mass at the first sample.
    """
    (
        main_mass,
        stiffness,
        damping,
        take_up_travel,
        end_stiffness,
        end_damping,
        backlash,
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
    ) = parameters
    step = period / substeps
    has_front = front_mass > 0.0
    count = inputs.shape[1]
    state = initial_state.copy()
    trial = np.empty(4)
    slope = np.empty(4)
    total = np.empty(4)

    for sample in range(count):
        following = min(sample + 1, count - 1)
        for substep in range(substeps):
            for index in range(4):
                total[index] = 0.0
                trial[index] = state[index]
            for stage in range(4):
                if stage > 0:
                    reach = step if stage == 3 else 0.5 * step
                    for index in range(4):
                        trial[index] = state[index] + reach * slope[index]
                x, v, x_f, v_f = trial
                within = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
                share = (substep + within) / substeps
                v_m = inputs[1, sample] + share * (inputs[1, following] - inputs[1, sample])
                # The position at both ends is exact; between them the speed is linear.
                moved = period * share * (inputs[1, sample] + 0.5 * share * (inputs[1, following] - inputs[1, sample]))
                whole = 0.5 * period * (inputs[1, sample] + inputs[1, following])
                x_m = inputs[0, sample] + moved
                if following > sample:
                    x_m += share * (inputs[0, following] - inputs[0, sample] - whole)
                force = inputs[2, sample] + share * (inputs[2, following] - inputs[2, sample])

                wind_up = x_m - x
                wind_up_speed = v_m - v
                drive = 0.0
                if wind_up >= 0.0:
                    drive = stiffness * min(wind_up, take_up_travel)
                    drive += end_stiffness * max(wind_up - take_up_travel, 0.0)
                    # Not in one step: the result must not jump with the parameters.
                    blend = min(max((wind_up - take_up_travel) / (_BLEND * take_up_travel) + 0.5, 0.0), 1.0)
                    drive = max(drive + (damping + blend * (end_damping - damping)) * wind_up_speed, 0.0)
                elif wind_up < -backlash:
                    drive = min(end_stiffness * (wind_up + backlash) + end_damping * wind_up_speed, 0.0)

                coulomb = coulomb_forward if v >= 0.0 else coulomb_backward
                if static > coulomb:
                    coulomb += (static - coulomb) * math.exp(-((v / stribeck_speed) ** 2))
                friction = coulomb * math.tanh(v / smoothing_speed) + viscous * v + offset

                front = force
                if has_front:
                    front = front_stiffness * (x - x_f) + front_damping * (v - v_f)
                    slope[2] = v_f
                    slope[3] = (front - force) / front_mass
                else:
                    slope[2] = v
                    slope[3] = 0.0
                slope[0] = v
                slope[1] = (drive - friction - front) / main_mass
                if stage == 0 and substep == 0:
                    output[0, sample] = drive
                    output[1, sample] = slope[1]
                    output[2, sample] = wind_up
                    output[3, sample] = v
                weight = step / 6.0 if stage == 0 or stage == 3 else step / 3.0
                for index in range(4):
                    total[index] += weight * slope[index]
            for index in range(4):
                state[index] += total[index]

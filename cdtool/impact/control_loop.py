"""How the speed controller feels a contact force: from F_c to motor torque and to control action (thesis 4.37 to 4.39).

With the load's friction and inertia at the motor (4.8 as a speed: G = 1/(J_t s + d_t)), R = K_P + K_I/s and
A = mu_a/(tau_a s + 1) the open loop is L = G R A, and

    tau_m/F_c = r L/(1 + L),   u/F_c = (r/A) L/(1 + L)

both positive: the controller pushes against the obstacle. Torque and control action are deviations from those of the
steady motion. The transmission is taken as rigid; see `rigidity`. Slew limit and saturation are left out.
"""

from __future__ import annotations

import numpy as np

from cdtool.impact.drives import SpeedController
from cdtool.impact.transfer import Transfer
from cdtool.impact.transmission import RigidTransmission


def torque_by_force(transmission: RigidTransmission, controller: SpeedController) -> Transfer:
    """tau_m/F_c [N m/N]; tends to r for a steady force where the controller integrates (4.39 corrected)."""
    regulator, closed = _loop(transmission, controller)
    return Transfer(_times(regulator, transmission.ratio * controller.actuator_gain), closed, "N m/N")


def control_by_force(transmission: RigidTransmission, controller: SpeedController) -> Transfer:
    """u/F_c [N m/N over the actuator's gain]: the actuator's lag comes after it (4.39 corrected)."""
    regulator, closed = _loop(transmission, controller)
    lag = np.array([controller.actuator_time, 1.0])
    return Transfer(_times(np.polymul(regulator, lag), transmission.ratio), closed, "N m/N")


def _loop(transmission: RigidTransmission, controller: SpeedController) -> tuple[np.ndarray, tuple[float, ...]]:
    """Numerator of R and denominator of 1 + L; without an integral part the pole at the origin is left out of both."""
    integral = (1.0, 0.0) if controller.integral else (1.0,)
    gains = (controller.proportional, controller.integral) if controller.integral else (controller.proportional,)
    plant, lag = (transmission.inertia, transmission.friction), (controller.actuator_time, 1.0)
    open_loop = np.polymul(np.polymul(plant, lag), integral)
    closed = np.polyadd(open_loop, controller.actuator_gain * np.array(gains))
    return np.array(gains), tuple(float(value) for value in closed)


def _times(coefficients: np.ndarray, factor: float) -> tuple[float, ...]:
    return tuple(float(factor * value) for value in coefficients)

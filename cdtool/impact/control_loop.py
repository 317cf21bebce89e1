"""The speed controller's response to a contact force: from F_c to motor torque and control action (thesis 4.37-4.39).

With a rigid transmission (4.8 as a speed: G = 1/(J_t s + d_t)), R = K_P + K_I/s + K_D s/(T_f s + 1) and
A = mu_a/(tau_a s + 1) the open loop is L = G R A, and

    tau_m/F_c = r L/(1 + L),   u/F_c = (r/A) L/(1 + L),   thd/reference = L/(1 + L)

The first two are positive: the controller pushes against the obstacle. Behind an elastic transmission, with T and X of
`motor_by_torque` and `load_by_torque`, they are R A s X/(1 + R A s T), that over A, and R A s T/(1 + R A s T). All are
deviations from the steady motion. Slew and torque limit are left out.
"""

from __future__ import annotations

import numpy as np

from cdtool.impact.drives import SpeedController
from cdtool.impact.linearised import NO_CONTACT, ContactStiffness, load_by_torque, motor_by_torque
from cdtool.impact.transmissions.transfer import Transfer
from cdtool.impact.transmissions.transmission import Transmission


def torque_by_force(transmission: Transmission, controller: SpeedController) -> Transfer:
    """tau_m/F_c [N m/N]; tends to r for a steady force where the controller integrates (4.39 corrected).

    F_c is an input: the effect of the torque on the force is in the simulation, not here.
    """
    load, both = load_by_torque(transmission), _closed(transmission, controller, NO_CONTACT)
    steer = np.polymul(controller.regulator.numerator, controller.actuator.numerator)
    return _transfer(np.polymul(np.polymul(steer, load.numerator), (1.0, 0.0)), both, "N m/N")


def control_by_force(transmission: Transmission, controller: SpeedController) -> Transfer:
    """u/F_c [N m/N over the actuator's gain]: the actuator's lag comes after it (4.39 corrected)."""
    torque, actuator = torque_by_force(transmission, controller), controller.actuator
    numerator = np.polymul(torque.numerator, actuator.denominator) / controller.actuator_gain
    return _transfer(numerator, np.array(torque.denominator), "N m/N")


def speed_by_reference(
    transmission: Transmission, controller: SpeedController, contact: ContactStiffness = NO_CONTACT
) -> Transfer:
    """Motor speed by its reference, before the contact or about a state of it (figure 4.8 closed); unit 1.

    In contact its gain is 0: a machine that is held does not move, and the controller integrates.
    """
    motor, both = motor_by_torque(transmission, contact), _closed(transmission, controller, contact)
    steer = np.polymul(controller.regulator.numerator, controller.actuator.numerator)
    return _transfer(np.polymul(np.polymul(steer, motor.numerator), (1.0, 0.0)), both, "1")


def _closed(transmission: Transmission, controller: SpeedController, contact: ContactStiffness) -> np.ndarray:
    """Numerator of 1 + R A s T, the denominators of R, A and T multiplied out."""
    motor, regulator, actuator = motor_by_torque(transmission, contact), controller.regulator, controller.actuator
    steer = np.polymul(regulator.numerator, actuator.numerator)
    still = np.polymul(np.polymul(regulator.denominator, actuator.denominator), motor.denominator)
    return np.asarray(np.polyadd(still, np.polymul(np.polymul(steer, motor.numerator), (1.0, 0.0))))


def _transfer(numerator: np.ndarray, denominator: np.ndarray, unit: str) -> Transfer:
    return Transfer(tuple(map(float, numerator)), tuple(map(float, denominator)), unit).reduced

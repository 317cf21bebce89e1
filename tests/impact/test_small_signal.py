"""Transfer functions agree with the simulated small motion: before and during contact, with and without control."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.control_loop import control_by_force, speed_by_reference, torque_by_force
from cdtool.impact.drives import ConstantTorque, Drive
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.linearised import (
    ContactStiffness,
    linearised_contact,
    load_by_torque,
    motor_by_penetration,
    motor_by_torque,
    penetration_by_momentum,
)
from cdtool.impact.transmissions.transfer import Transfer
from cdtool.impact.transmissions.transmission import Transmission
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion, Start, simulate_impact

DAMPED = replace(example.ELASTIC, damping=0.01, motor_friction=0.02, load_friction=5.0)
DRIVES: dict[str, Transmission] = {"rigid": example.TRANSMISSION, "elastic": DAMPED}
PI, PID = example.SPEED_LOOP, replace(example.SPEED_LOOP, derivative=2e-4, derivative_time=0.001)
CONTROLLERS = {"P": replace(PI, integral=0.0), "PI": PI, "PID": PID, "gain": replace(PID, actuator_gain=3.0)}
CHANGE = 1e-3

transmissions = pytest.mark.parametrize("transmission", DRIVES.values(), ids=DRIVES)
controllers = pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)


@dataclass(frozen=True)
class Linear:
    """K_c delta + D_c delta', as 4.25 corrected; it holds on as well, so that a small motion is all there is."""

    stiffness: float
    damping: float

    def force(self, penetration, rate):
        return self.stiffness * penetration + self.damping * rate


def moved(
    transmission: Transmission, drive: Drive, law: ContactLaw, time: FloatArray, gap: float, speed: float = 0.0
) -> SimulatedMotion:
    return simulate_impact(
        transmission, drive, law, Start(gap=gap, load_speed=speed), duration=float(time[-1]), samples=4000
    )


def at(time: FloatArray, motion: SimulatedMotion, name: str) -> FloatArray:
    return np.interp(time, motion.time, getattr(motion, name))


def same(found: FloatArray, expected: FloatArray, share: float) -> bool:
    return bool(np.max(np.abs(found - expected)) <= share * np.max(np.abs(expected)))


@transmissions
def test_before_the_contact_a_torque_moves_motor_and_load_as_4_7_and_4_22_say(transmission):
    time = np.linspace(0.0, 0.1, 2001)
    found = moved(transmission, ConstantTorque(0.2), Linear(1e5, 0.0), time, gap=10.0)
    angle = at(time, found, "motor_position") + 10.0 / transmission.ratio
    assert same(angle, 0.2 * motor_by_torque(transmission).step(time), 1e-5)
    assert same(at(time, found, "penetration") + 10.0, 0.2 * load_by_torque(transmission).step(time), 1e-5)


@transmissions
def test_during_a_linear_contact_a_step_of_torque_moves_motor_and_load_as_4_26_says(transmission):
    # Two simulations from one pressed state, whose torque differs: their difference is the answer to the step.
    time, contact = np.linspace(0.0, 0.02, 1501), ContactStiffness(2e4, 30.0)
    law = Linear(contact.stiffness, contact.damping)
    still, more = (moved(transmission, ConstantTorque(0.5 + step), law, time, -2e-3) for step in (0.0, CHANGE))
    for name, transfer in (("motor_position", motor_by_torque), ("penetration", load_by_torque)):
        change = at(time, more, name) - at(time, still, name)
        assert same(change, CHANGE * transfer(transmission, contact).step(time), 1e-3), name


def test_a_small_step_of_torque_in_a_contact_of_hertz_moves_the_motor_as_4_18_says():
    torque, r = 0.5, 0.015
    resting = (torque / r / example.CONTACT.stiffness) ** (1.0 / 1.5)
    time = np.linspace(0.0, 0.04, 2001)
    found = moved(example.TRANSMISSION, ConstantTorque(torque + CHANGE), example.CONTACT, time, -resting)
    expected = CHANGE * motor_by_torque(example.TRANSMISSION, linearised_contact(example.CONTACT, resting, 0.0)).step(
        time
    )
    assert same((at(time, found, "penetration") - resting) / r, expected, 0.01)


def test_the_momentum_of_the_load_moves_load_and_motor_as_4_27_and_4_28_say():
    # The impulse M_l v on a drive that is slack and at rest: the obstacle hits the load.
    drive, law, speed = replace(DAMPED, load_friction=0.0), Linear(1e5, 20.0), 0.3
    found = simulate_impact(
        drive, ConstantTorque(0.0), law, Start(gap=0.0, load_speed=speed, motor_speed=0.0), duration=0.01, samples=6000
    )
    time = np.linspace(0.0, 0.8 * found.contacts[0].duration, 1500)
    depth = penetration_by_momentum(drive, law.stiffness, law.damping)
    follow = motor_by_penetration(drive)
    both = Transfer(
        tuple(np.polymul(depth.numerator, follow.numerator)),
        tuple(np.polymul(depth.denominator, follow.denominator)),
        "rad/(N s)",
    )
    assert same(at(time, found, "penetration"), 0.6 * speed * depth.impulse(time), 1e-4)
    assert same(at(time, found, "motor_position"), 0.6 * speed * both.impulse(time), 1e-4)


@transmissions
@controllers
def test_before_the_contact_a_controlled_machine_follows_its_reference_as_the_closed_loop_says(
    transmission, controller
):
    time, speed = np.linspace(0.0, 0.05, 1001), 0.25
    reference = speed / transmission.ratio
    found = moved(
        transmission, replace(controller, reference=reference + CHANGE), Linear(1e5, 0.0), time, gap=10.0, speed=speed
    )
    answer = CHANGE * speed_by_reference(transmission, controller).step(time)
    assert same(at(time, found, "motor_speed") - reference, answer, 1e-4)


@transmissions
@controllers
def test_during_the_contact_a_controlled_machine_answers_its_reference_as_the_closed_loop_says(
    transmission, controller
):
    time, contact = np.linspace(0.0, 0.03, 1001), ContactStiffness(2e4, 30.0)
    law = Linear(contact.stiffness, contact.damping)
    still, more = (moved(transmission, replace(controller, reference=step), law, time, -1e-2) for step in (0.0, CHANGE))
    assert np.min(at(time, still, "penetration")) > 0.0
    answer = CHANGE * speed_by_reference(transmission, controller, contact).step(time)
    assert same(at(time, more, "motor_speed") - at(time, still, "motor_speed"), answer, 1e-3)


@transmissions
@controllers
def test_a_contact_force_reaches_torque_and_control_action_as_4_39_says(transmission, controller):
    # A wall so soft that its force is all but a ramp K v t.
    time, speed, stiffness = np.linspace(0.0, 0.03, 1001), 0.25, 1.0
    controlled = replace(controller, reference=speed / transmission.ratio)
    found = moved(transmission, controlled, HuntCrossley(stiffness, 0.0, 1.0), time, gap=0.0, speed=speed)
    torque = at(time, found, "motor_torque")
    rise = stiffness * speed * torque_by_force(transmission, controller).ramp(time)
    assert same(torque - transmission.steady_torque(speed), rise, 2e-3)
    # u is what the actuator was given: (tau_a dtau/dt + tau)/mu_a.
    asked = (controller.actuator_time * np.gradient(torque, time) + torque) / controller.actuator_gain
    steady = transmission.steady_torque(speed) / controller.actuator_gain
    assert same(asked - steady, stiffness * speed * control_by_force(transmission, controller).ramp(time), 5e-3)

"""The example of the thesis's chapter 4 (Table 4.1, figure 4.3): every reference value, by both ways to simulate it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cdtool.impact.bodies import Bodies
from cdtool.impact.collision import collide
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.impact import Collision
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion, Start, simulate_impact

STIFFNESS = 9.8261e8
MASS, DRAG, PUSH = 2.35e-4 / 0.015**2, 0.03 / 0.015**2, 0.5 / 0.015
CART = Bodies(mass_1=MASS, speed_1=0.25, push=PUSH, friction=DRAG)
# d_c/k_c [s/m], peak [N], penetration [mm], duration [ms], loss [%].
SWEEP = [
    (0.0, 888.1, 0.0935, 1.122, 15.2),
    (0.3, 864.6, 0.0917, 1.130, 23.9),
    (0.6, 846.3, 0.0900, 1.137, 31.3),
    (1.2, 821.8, 0.0870, 1.154, 43.5),
    (1.7315, 809.5, 0.0847, 1.169, 52.0),
    (2.5, 801.8, 0.0817, 1.191, 61.5),
]
# Start after the first touch [ms], approach speed [m/s], peak [N].
CONTACTS = [
    (0.0, 0.25, 864.6),
    (12.25, 0.1368, 447.0),
    (20.14, 0.0906, 292.8),
    (26.08, 0.0649, 213.7),
    (30.89, 0.0482, 166.2),
    (35.00, 0.0360, 134.6),
]
State = tuple[float, float]
Stepper = Callable[[State, float], State]


@pytest.fixture(scope="module")
def motion() -> SimulatedMotion:
    return example.impact()


@pytest.fixture(scope="module")
def collision() -> Collision:
    return collide(example.CONTACT, CART, contacts=20)


def by_bodies(law: HuntCrossley) -> tuple[float, float, float, float]:
    hit = collide(law, CART).first
    return hit.peak_force, 1e3 * hit.greatest_penetration, 1e3 * hit.duration, 100.0 * hit.energy_loss


def by_drive(law: HuntCrossley) -> tuple[float, float, float, float]:
    hit = simulate_impact(
        example.TRANSMISSION, example.TORQUE, law, Start(gap=0.0, load_speed=0.25), duration=5e-3
    ).contacts[0]
    return hit.peak_force, 1e3 * hit.max_penetration, 1e3 * hit.duration, 100.0 * hit.energy_loss


def test_table_4_1_is_a_cart_of_1_kilogramme_that_is_pushed_by_33_newton():
    assert example.TRANSMISSION.mass == pytest.approx(1.04444, abs=5e-6)
    assert pytest.approx(133.33, abs=5e-3) == DRAG
    assert pytest.approx(33.333, abs=5e-4) == PUSH
    assert 0.015 * example.TORQUE.torque / example.TRANSMISSION.friction == pytest.approx(0.25, rel=1e-12)
    assert (example.CONTACT.stiffness, example.CONTACT.damping) == pytest.approx((STIFFNESS, 0.3 * STIFFNESS), rel=2e-5)


def test_the_load_reaches_the_obstacle_at_the_thesis_instant_and_speed(motion):
    first = motion.contacts[0]
    assert 1e3 * first.start == pytest.approx(407.83, abs=5e-3)
    assert first.approach_speed == pytest.approx(0.25, rel=1e-6)
    assert np.all(motion.force[motion.time < first.start] == 0.0)


def test_the_first_contact_of_the_drive_has_the_reference_values(motion):
    first = motion.contacts[0]
    assert first.peak_force == pytest.approx(864.6, abs=0.05)
    assert 1e3 * first.max_penetration == pytest.approx(0.0917, abs=5e-5)
    assert 1e3 * first.duration == pytest.approx(1.130, abs=5e-4)
    assert first.final_speed == pytest.approx(-0.2181, abs=1e-4)
    assert 100.0 * first.energy_loss == pytest.approx(23.9, abs=0.05)
    # Nothing of the push is left over a contact that ends where it began: the rest is friction.
    assert 100.0 * first.contact_loss == pytest.approx(9.3, abs=0.05)
    assert 100.0 * (first.energy_loss - first.contact_loss) == pytest.approx(14.6, abs=0.05)


def test_the_first_contact_of_two_bodies_says_where_its_energy_went(collision):
    hit = collision.first
    assert hit.energy_loss == pytest.approx(0.239, abs=5e-4)
    assert hit.contact_loss == pytest.approx(0.093, abs=5e-4)
    assert hit.friction_loss[-1] / hit.kinetic[0] == pytest.approx(0.146, abs=5e-4)
    assert hit.push_work[-1] == pytest.approx(0.0, abs=1e-9)
    assert hit.rate[-1] == pytest.approx(-0.2181, abs=1e-4)
    # The reference says 0.8724: that of fixed steps of 10 us, which end 0.3 us late. See `stepped`.
    assert hit.restitution.newton == pytest.approx(0.87252, abs=5e-6)


def test_the_contact_alone_rebounds_with_the_exact_relation():
    hit = collide(HuntCrossley(STIFFNESS, 0.3 * STIFFNESS), replace(CART, push=0.0, friction=0.0)).first
    assert hit.restitution.newton == pytest.approx(0.95237, abs=5e-6)
    # The reference says 0.0910; the closed form, by hand, is 0.09105.
    x = 0.3 * 0.25
    by_hand = (2.5 * MASS / STIFFNESS * (x - np.log1p(x)) / 0.3**2) ** 0.4
    assert 1e3 * by_hand == pytest.approx(0.091052, abs=5e-7)
    assert hit.greatest_penetration == pytest.approx(by_hand, rel=1e-8)


@pytest.mark.parametrize("simulated", [by_bodies, by_drive])
@pytest.mark.parametrize(("ratio", "peak", "depth", "duration", "loss"), SWEEP)
def test_the_sweep_of_the_damping_has_the_reference_values(simulated, ratio, peak, depth, duration, loss):
    found = simulated(HuntCrossley(STIFFNESS, ratio * STIFFNESS))
    assert found[0] == pytest.approx(peak, abs=0.06)
    assert found[1] == pytest.approx(depth, abs=6e-5)
    assert found[2] == pytest.approx(duration, abs=6e-4)
    assert found[3] == pytest.approx(loss, abs=0.06)


def test_the_contacts_after_the_first_are_the_reference_ones(motion, collision):
    drive = [
        (1e3 * (hit.start - motion.contacts[0].start), hit.approach_speed, hit.peak_force) for hit in motion.contacts
    ]
    bodies = [(1e3 * hit.time[0], hit.approach_speed, hit.peak_force) for hit in collision.impacts]
    assert len(drive) == len(bodies) == 9
    for found in (drive, bodies):
        for (time, speed, peak), (expected_time, expected_speed, expected_peak) in zip(found, CONTACTS, strict=False):
            assert time == pytest.approx(expected_time, abs=0.006)
            assert speed == pytest.approx(expected_speed, abs=6e-5)
            assert peak == pytest.approx(expected_peak, abs=0.06)


def test_eight_contacts_part_and_the_ninth_stays(motion, collision):
    assert [hit.lasting for hit in motion.contacts] == [False] * 8 + [True]
    assert [hit.separated for hit in collision.impacts] == [True] * 8 + [False] and collision.stays
    parted = motion.contacts[-2]
    assert 1e3 * (parted.start + parted.duration - motion.contacts[0].start) == pytest.approx(44.25, abs=5e-3)
    assert 1e3 * collision.impacts[-2].time[-1] == pytest.approx(44.25, abs=5e-3)


def test_the_load_comes_to_rest_where_the_push_is_carried():
    settled = simulate_impact(example.TRANSMISSION, example.TORQUE, example.CONTACT, Start(gap=1e-3), duration=1.0)
    assert 1e3 * settled.penetration[-1] == pytest.approx(0.01048, abs=5e-6)
    assert settled.force[-1] == pytest.approx(33.3, abs=0.05)


def acceleration(state: State) -> float:
    return (PUSH - DRAG * state[1] - float(example.CONTACT.force(*state))) / MASS


def stepped(stepper: Stepper, step: float) -> tuple[float, float, float, float]:
    """Peak [N], penetration [mm], duration [ms], loss [%] of the first contact in fixed steps [s], no event found.

    The contact ends with the first step that is outside again, as a simulation without events shows it.
    """
    states = [(0.0, 0.25)]
    while states[-1][0] >= 0.0:
        states.append(stepper(states[-1], step))
    peak = max(float(example.CONTACT.force(*state)) for state in states)
    lost = 100.0 * (1.0 - (states[-1][1] / 0.25) ** 2)
    return peak, 1e3 * max(depth for depth, _ in states), 1e3 * step * (len(states) - 1), lost

"""The discrete impact of rigid bodies: textbook cases, Coulomb's law, and energy that never grows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.impact.bodies import Bodies
from cdtool.impact.collision import collide
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.impulse import Hypothesis, RigidBody, strike

HYPOTHESES: tuple[Hypothesis, ...] = ("newton", "poisson", "stronge")
FLOOR = RigidBody(math.inf, math.inf, (0.0, 0.0))
DOWN = (0.0, -1.0)
ORIGIN = (0.0, 0.0)


def disc(velocity: tuple[float, float], spin: float = 0.0) -> RigidBody:
    """1 kg, radius 0.1 m, that touches the floor at the origin."""
    return RigidBody(1.0, 0.5 * 0.1**2, (0.0, 0.1), velocity, spin)


def rod(angle: float, velocity: tuple[float, float], spin: float = 0.0) -> RigidBody:
    """1 kg, 1 m, its lower end at the origin; angle to the floor in rad."""
    return RigidBody(1.0, 1.0 / 12.0, (0.5 * math.cos(angle), 0.5 * math.sin(angle)), velocity, spin)


def kinetic(*bodies: RigidBody) -> float:
    return sum(0.5 * b.mass * float(np.dot(b.velocity, b.velocity)) + 0.5 * b.inertia * b.spin**2 for b in bodies)


@st.composite
def free_bodies(draw: st.DrawFn) -> RigidBody:
    near, fast = st.floats(-1.0, 1.0), st.floats(-2.0, 2.0)
    mass, gyration = draw(st.floats(0.1, 10.0)), draw(st.floats(0.05, 1.0))
    centre, velocity = (draw(near), draw(near)), (draw(fast), draw(fast))
    return RigidBody(mass, mass * gyration**2, centre, velocity, draw(fast))


@pytest.mark.parametrize("hypothesis", HYPOTHESES)
def test_two_central_bodies_part_as_the_textbook_says(hypothesis):
    first = RigidBody(2.0, 0.1, (-1.0, 0.0), (0.6, 0.0))
    second = RigidBody(3.0, 0.1, (1.0, 0.0), (0.1, 0.0))
    done = strike(first, second, ORIGIN, (1.0, 0.0), 0.8, hypothesis=hypothesis)
    common = (2.0 * 0.6 + 3.0 * 0.1) / 5.0
    assert done.body_1.velocity[0] == pytest.approx(common - 3.0 / 5.0 * 0.8 * 0.5)
    assert done.body_2.velocity[0] == pytest.approx(common + 2.0 / 5.0 * 0.8 * 0.5)
    assert done.normal_impulse == pytest.approx(1.2 * 1.8 * 0.5)
    assert done.energy_loss == pytest.approx(0.5 * 1.2 * 0.5**2 * (1.0 - 0.8**2))
    assert (done.body_1.spin, done.body_2.spin, done.hypothesis) == (0.0, 0.0, hypothesis)


def test_the_discrete_and_the_continuous_approach_agree_on_a_central_impact():
    law = HuntCrossley(1e8, 1e8)
    hit = collide(law, Bodies(2.0, 0.6, 3.0, 0.1)).first
    first, second = RigidBody(2.0, 0.1, (-1.0, 0.0), (0.6, 0.0)), RigidBody(3.0, 0.1, (1.0, 0.0), (0.1, 0.0))
    done = strike(first, second, ORIGIN, (1.0, 0.0), law.restitution(0.5))
    assert (done.body_1.velocity[0], done.body_2.velocity[0]) == pytest.approx(tuple(hit.speeds[-1]), rel=1e-7)


def test_a_rod_hit_at_its_end_has_a_quarter_of_its_mass():
    flat = RigidBody(1.0, 1.0 / 12.0, (0.5, 0.0), (0.0, -1.0))
    done = strike(flat, FLOOR, ORIGIN, DOWN, 0.0)
    assert done.normal_impulse == pytest.approx(0.25)


@pytest.mark.parametrize("hypothesis", HYPOTHESES)
def test_a_disc_that_slides_takes_the_friction_of_coulomb_and_begins_to_roll(hypothesis):
    done = strike(disc((3.0, -1.0)), FLOOR, ORIGIN, DOWN, 0.5, 0.1, hypothesis)
    assert done.slip == "slides"
    assert done.normal_impulse == pytest.approx(1.5)
    assert done.body_1.velocity == pytest.approx((3.0 - 0.1 * 1.5, 0.5))
    assert done.body_1.spin == pytest.approx(-0.1 * 1.5 * 0.1 / 0.005)
    assert done.friction_loss == pytest.approx(done.energy_loss - 0.5 * (1.0 - 0.5**2))


def test_a_disc_that_sticks_rolls():
    done = strike(disc((0.3, -1.0)), FLOOR, ORIGIN, DOWN, 0.5, 1.0)
    assert done.slip == "slides, then sticks"
    assert done.body_1.velocity[0] + 0.1 * done.body_1.spin == pytest.approx(0.0, abs=1e-15)
    assert done.body_1.velocity[0] == pytest.approx(0.3 * 2.0 / 3.0)


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.4])
def test_the_end_of_a_steep_rod_slides_away_unless_friction_holds_it(friction):
    # Its end has |W_tn|/W_tt = 3 sin cos/(1 + 3 sin^2), 0.72 at 30 degrees; below that it slides from the first moment.
    done = strike(rod(math.radians(30.0), (0.0, -1.0)), FLOOR, ORIGIN, DOWN, 0.5, friction)
    assert done.slip == "slides back"
    assert abs(done.tangential_impulse) == pytest.approx(friction * done.normal_impulse)
    assert strike(rod(math.radians(30.0), (0.0, -1.0)), FLOOR, ORIGIN, DOWN, 0.5, 0.8).slip == "sticks"


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.3])
def test_without_a_turn_of_the_sliding_the_three_hypotheses_agree(friction):
    falling = rod(math.radians(60.0), (-6.0, -1.0), 1.0)
    done = [strike(falling, FLOOR, ORIGIN, DOWN, 0.7, friction, hypothesis) for hypothesis in HYPOTHESES]
    assert {item.slip for item in done} == {"slides"}
    impulses = [item.normal_impulse for item in done]
    assert impulses == pytest.approx([impulses[0]] * 3)


def test_newtons_restitution_would_make_energy_of_friction_and_stronges_is_used_instead():
    spinning = rod(math.radians(45.0), (0.0, -1.0), 4.0)
    done = strike(spinning, FLOOR, ORIGIN, DOWN, 0.9, 1.0, "newton")
    assert done.hypothesis == "stronge"
    assert done.energy_loss / kinetic(spinning) == pytest.approx(0.3635, abs=1e-3)
    # By hand: the end stops sliding on the way, sticks, and goes on until it leaves with 0.9 times its approach.
    touch = spinning.velocity_at(np.zeros(2))
    mobility = spinning.mobility_at(np.zeros(2))
    wanted = np.array([0.0, -0.9 * touch[1]])
    impulse = np.linalg.solve(mobility, wanted - touch)
    made = kinetic(spinning.struck(impulse, np.zeros(2))) / kinetic(spinning) - 1.0
    assert made == pytest.approx(0.265, abs=1e-3)


@settings(deadline=None)
@given(free_bodies(), free_bodies(), st.floats(0.0, 2 * math.pi), st.floats(0.0, 1.0), st.floats(0.0, 2.0))
@pytest.mark.parametrize("hypothesis", HYPOTHESES)
def test_an_impact_never_makes_energy_and_keeps_both_momenta(hypothesis, first, second, angle, e, friction):
    normal = np.array([math.cos(angle), math.sin(angle)])
    before = (second.velocity_at(np.zeros(2)) - first.velocity_at(np.zeros(2))) @ normal
    assume(before < -1e-3)
    done = strike(first, second, ORIGIN, (float(normal[0]), float(normal[1])), e, friction, hypothesis)
    whole = kinetic(first, second)
    assert done.energy_loss >= 0.0 and done.friction_loss >= 0.0
    assert kinetic(done.body_1, done.body_2) == pytest.approx(whole - done.energy_loss, rel=1e-9, abs=1e-12)
    after = (done.body_2.velocity_at(np.zeros(2)) - done.body_1.velocity_at(np.zeros(2))) @ normal
    assert after >= -1e-9
    assert abs(done.tangential_impulse) <= friction * done.normal_impulse * (1.0 + 1e-9) + 1e-12
    assert momenta(done.body_1, done.body_2) == pytest.approx(momenta(first, second), abs=1e-9)


def momenta(*bodies: RigidBody) -> list[float]:
    """Both linear momenta and the angular one about the contact."""
    total = np.zeros(3)
    for body in bodies:
        momentum = body.mass * np.asarray(body.velocity)
        about = body.centre[0] * momentum[1] - body.centre[1] * momentum[0] + body.inertia * body.spin
        total += [*momentum, about]
    return [float(value) for value in total]


def test_a_swinging_leaf_on_its_hinge_hits_with_its_moment_and_can_be_locked_by_friction():
    # A hinge 1 m above the contact and 0.5 m beside it: the leaf's end moves with (1, 0.5) m/s.
    leaf = RigidBody(math.inf, 1.0, (0.0, 1.0), spin=1.0)
    free = strike(leaf, FLOOR, (0.5, 0.0), (1.0, 0.0), 0.8)
    assert free.body_1.spin == pytest.approx(-0.8)
    assert free.energy_loss == pytest.approx(0.5 * (1.0 - 0.8**2))
    for hypothesis in HYPOTHESES:
        locked = strike(leaf, FLOOR, (0.5, 0.0), (1.0, 0.0), 0.8, 2.0, hypothesis)
        assert locked.body_1.spin == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((disc((0.0, 1.0)), FLOOR, ORIGIN, DOWN, 0.5), "part"),
        ((disc((0.0, -1.0)), FLOOR, ORIGIN, DOWN, 1.5), "restitution"),
        ((disc((0.0, -1.0)), FLOOR, ORIGIN, DOWN, 0.5, -0.1), "friction"),
        ((disc((0.0, -1.0)), FLOOR, ORIGIN, (0.0, 0.0), 0.5), "normal"),
        ((RigidBody(math.inf, math.inf, ORIGIN, (0.0, -1.0)), FLOOR, ORIGIN, DOWN, 0.5), "obstacles"),
    ],
)
def test_an_impact_without_meaning_is_refused(arguments, said):
    with pytest.raises(UsageError, match=said):
        strike(*arguments)

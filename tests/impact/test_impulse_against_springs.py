"""Impulses with friction against a pressed spring and an integrated friction force: no shortcut is shared."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cdtool.base.arrays import FloatArray
from cdtool.impact.impulse import Hypothesis, RigidBody, strike

FLOOR = RigidBody(math.inf, math.inf, (0.0, 0.0))
# Angle of a rod of 1 kg and 1 m to the floor [deg], friction, and velocity of its lower end (along, down) [m/s].
CASES = {
    "slides": (60.0, 0.1, (2.0, 1.0)),
    "slides, then sticks": (60.0, 1.2, (-0.8, 1.0)),
    "slides, then back": (35.0, 0.3, (0.9, 1.0)),
    "slides back": (30.0, 0.4, (0.0, 1.0)),
    "sticks": (30.0, 0.9, (0.0, 1.0)),
}
STIFFNESS = 1e6


def lower_end(angle: float, along: float, down: float) -> RigidBody:
    """A rod that moves without spin, its lower end at the origin."""
    turn = math.radians(angle)
    return RigidBody(1.0, 1.0 / 12.0, (0.5 * math.cos(turn), 0.5 * math.sin(turn)), (along, -down))


def pressed(rod: RigidBody, friction: float, restitution: float) -> tuple[FloatArray, float]:
    """Impulse (2,) on the rod and the normal one of compression alone [N s].

    A linear spring that is 1/e^2 times as stiff on the way back, so that it gives back e^2 of its work; Coulomb's force
    with a sign that is smooth over 1e-5 m/s. The rod does not move meanwhile.
    """
    arm = -np.array(rod.centre)
    turned = np.array([-arm[1], arm[0]])
    mobility = np.eye(2) / rod.mass + np.outer(turned, turned) / rod.inertia
    start = np.array(rod.velocity)

    def motion(stiffness: float, dent: float) -> Any:
        def rates(_: float, state: FloatArray) -> list[float]:
            along, up = start + mobility @ state[1:3]
            normal = stiffness * max(state[0] - dent, 0.0)
            return [-up, -friction * normal * math.tanh(along / 1e-5), normal]

        return rates

    def turns(_: float, state: FloatArray) -> float:
        return float((start + mobility @ state[1:3])[1])

    def out(_: float, state: FloatArray) -> float:
        return float(state[0] - dent)

    turns.terminal = out.terminal = True  # type: ignore[attr-defined]
    turns.direction, out.direction = 1.0, -1.0  # type: ignore[attr-defined]
    settings: dict[str, Any] = {"method": "Radau", "rtol": 1e-8, "atol": 1e-11}
    squeezed = solve_ivp(motion(STIFFNESS, 0.0), (0.0, 0.1), np.zeros(3), events=turns, **settings).y[:, -1]
    dent = float(squeezed[0] * (1.0 - restitution**2))
    back = solve_ivp(motion(STIFFNESS / restitution**2, dent), (0.0, 0.1), squeezed, events=out, **settings).y[:, -1]
    return back[1:3], float(squeezed[2])


@pytest.mark.parametrize("restitution", [1.0, 0.6])
@pytest.mark.parametrize("slip", CASES)
def test_stronges_impulses_are_those_of_a_spring_that_gives_back_its_share_of_the_work(slip, restitution):
    angle, friction, (along, down) = CASES[slip]
    rod = lower_end(angle, along, down)
    found = strike(rod, FLOOR, (0.0, 0.0), (0.0, -1.0), restitution, friction, "stronge")
    impulse, _ = pressed(rod, friction, restitution)
    assert found.slip == slip
    before, after = np.array(rod.velocity), np.array(found.body_1.velocity)
    assert after - before == pytest.approx(impulse, abs=5e-5)


@pytest.mark.parametrize(
    ("slip", "newton", "poisson"), [("slides, then sticks", 1.273, 0.965), ("slides, then back", 0.909, 1.029)]
)
def test_where_the_sliding_changes_an_elastic_spring_has_the_restitution_1_of_stronge_alone(slip, newton, poisson):
    # The text below 3.9: with e = 1 the works of Newton's and Poisson's hypothesis do not balance.
    angle, friction, (along, down) = CASES[slip]
    rod = lower_end(angle, along, down)
    impulse, compression = pressed(rod, friction, 1.0)
    after = rod.struck(impulse, np.zeros(2)).velocity_at(np.zeros(2))
    assert after[1] / down == pytest.approx(newton, abs=1e-3)
    assert (impulse[1] - compression) / compression == pytest.approx(poisson, abs=1e-3)
    # Given the coefficient that it would have measured, a hypothesis finds the impulse; given 1, it does not.
    name: Hypothesis = "newton" if newton < 1.0 else "poisson"
    told, elastic = (
        strike(rod, FLOOR, (0.0, 0.0), (0.0, -1.0), e, friction, name) for e in (min(newton, poisson), 1.0)
    )
    assert told.hypothesis == elastic.hypothesis == name
    assert told.normal_impulse == pytest.approx(impulse[1], rel=1e-3)
    assert abs(elastic.normal_impulse - impulse[1]) > 0.01 * impulse[1]

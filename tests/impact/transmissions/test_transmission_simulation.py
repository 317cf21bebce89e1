"""Simulated impacts of a driven load: limits, energy, and values without meaning."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.impact.contact_laws.hertz import Hertz
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.drives import ConstantTorque, SpeedController
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.transmissions.transmission import ElasticTransmission, RigidTransmission
from cdtool.impact.transmissions.transmission_simulation import Start, simulate_impact


def test_a_stiff_spring_makes_the_elastic_drive_the_rigid_one():
    elastic = replace(example.ELASTIC, stiffness=2e6, damping=1.0, motor_friction=0.03)
    law = HuntCrossley(1e5, 0.0, 1.0)
    start, duration = Start(gap=0.0, load_speed=0.25), 0.012
    rigid = simulate_impact(elastic.rigid, ConstantTorque(0.5), law, start, duration=duration)
    found = simulate_impact(elastic, ConstantTorque(0.5), law, start, duration=duration)
    assert found.contacts[0].peak_force == pytest.approx(rigid.contacts[0].peak_force, rel=1e-3)
    assert found.contacts[0].duration == pytest.approx(rigid.contacts[0].duration, rel=1e-3)
    assert found.motor_position[-1] == pytest.approx(rigid.motor_position[-1], abs=1e-2)


@dataclass(frozen=True)
class Pulling:
    """A law that would pull: 4.2 as printed, without its clamp."""

    def force(self, penetration, rate):
        return 1e5 * penetration * (1.0 + 20.0 * rate)


@settings(max_examples=15, deadline=None)
@given(
    stiffness=st.floats(1e4, 1e7),
    factor=st.floats(0.0, 2.0),
    exponent=st.sampled_from([1.0, 1.5, 2.0]),
    speed=st.floats(0.02, 1.0),
    friction=st.floats(0.0, 0.05),
)
def test_energy_never_grows_in_a_passive_contact(stiffness, factor, exponent, speed, friction):
    transmission = replace(example.ELASTIC, motor_friction=friction)
    law = HuntCrossley(stiffness, factor * stiffness, exponent)
    found = simulate_impact(transmission, ConstantTorque(0.0), law, Start(gap=0.0, load_speed=speed), duration=0.05)
    kinetic = 0.5 * 0.6 * found.load_speed**2 + 0.5 * 1e-4 * found.motor_speed**2
    twist = found.drive_force * 0.015 / 100.0  # without d_el the twist is tau_el/k_el [rad]
    energy = kinetic + 50.0 * twist**2 + law.stored_energy(np.maximum(found.penetration, 0.0))
    assert np.all(np.diff(energy) <= 1e-6 * energy[0])
    assert np.all(found.force >= 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RigidTransmission(0.0, 0.03, 0.015), "inertia is 0"),
        (lambda: RigidTransmission(1e-4, -0.1, 0.015), "friction is -0.1"),
        (lambda: ElasticTransmission(1e-4, 0.6, 0.015, -1.0), "stiffness is -1"),
        (lambda: SpeedController(0.0, math.nan, 1.0), "proportional gain is nan"),
        (lambda: SpeedController(0.0, 1.0, 1.0, slew_limit=0.0), "slew limit is 0"),
        (
            lambda: simulate_impact(example.TRANSMISSION, example.TORQUE, Hertz(1e8), Start(gap=0.1), duration=-1.0),
            "duration",
        ),
        (
            lambda: simulate_impact(
                example.TRANSMISSION,
                example.TORQUE,
                Hertz(1e8, permanent_indentation=1e-6),
                Start(gap=0.1),
                duration=1.0,
            ),
            "leaves a dent",
        ),
    ],
)
def test_a_value_without_meaning_is_named(make, message):
    with pytest.raises(UsageError, match=message):
        make()


def test_a_torque_limit_bounds_the_torque_and_its_integrator_does_not_wind_up():
    limited = replace(example.SPEED_LOOP, torque_limit=0.6)
    start = Start(gap=0.0, load_speed=0.25)
    free, bound = (
        simulate_impact(example.RANKED.transmission, one, example.RANKED.obstacle, start, duration=0.3)
        for one in (example.SPEED_LOOP, limited)
    )
    assert free.motor_torque.max() > 1.0
    assert bound.motor_torque.max() == pytest.approx(0.6, rel=1e-6)
    # Up to the limit nothing differs; held there, the contact carries the limit and no more.
    early = 0.9 * free.time[np.argmax(free.motor_torque > 0.6)]
    assert np.interp(early, bound.time, bound.force) == pytest.approx(np.interp(early, free.time, free.force), rel=1e-3)
    assert bound.force[-1] == pytest.approx(0.6 / 0.015, rel=1e-2)
    # Let go of, the integrator stands where the limit was met, and not where the error has since driven it.
    state = [0.55, 0.0, 0.6]
    assert limited.rates(state, motor_speed=0.0)[0] == 0.0
    assert limited.rates([0.55, 0.0, 0.6], motor_speed=2.0 * limited.reference)[0] < 0.0


def test_a_slew_limit_bounds_the_slope_of_the_torque():
    limited = replace(example.SPEED_LOOP, slew_limit=2.0)
    found = simulate_impact(
        example.RANKED.transmission, limited, example.RANKED.obstacle, Start(gap=0.0, load_speed=0.25), duration=0.05
    )
    slope = np.diff(found.motor_torque) / np.diff(found.time)
    assert np.max(np.abs(slope)) == pytest.approx(2.0, rel=1e-3)
    free = simulate_impact(
        example.RANKED.transmission,
        example.SPEED_LOOP,
        example.RANKED.obstacle,
        Start(gap=0.0, load_speed=0.25),
        duration=0.05,
    )
    assert np.max(np.diff(free.motor_torque) / np.diff(free.time)) > 20.0


def test_constants_that_are_far_apart_are_an_error_and_no_endless_work(monkeypatch):
    monkeypatch.setattr("cdtool.impact.effort.MOST_EVALUATIONS", 10_000)
    sticky = RigidTransmission(1e-4, 1e4, 0.01)
    with pytest.raises(UsageError, match="far quicker"):
        simulate_impact(sticky, ConstantTorque(1.0), HuntCrossley(1e5, 0.0), Start(gap=1e-3), duration=10.0)


def test_a_torque_limit_below_what_the_motion_takes_is_refused():
    with pytest.raises(UsageError, match=r"limit is 0\.4 N m, steady motion takes 0\.5"):
        replace(example.RANKED, controller=replace(example.SPEED_LOOP, torque_limit=0.4)).simulate()

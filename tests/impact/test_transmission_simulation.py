"""The example of the thesis's chapter 4 against its reference values, and what every driven impact must keep."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.errors import UsageError
from cdtool.impact import thesis_example as example
from cdtool.impact.contact_laws.hertz import Hertz
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.drives import ConstantTorque, SpeedController
from cdtool.impact.transmission import ElasticTransmission, RigidTransmission
from cdtool.impact.transmission_simulation import simulate_impact

LATER = [
    (12.25, 0.1368, 447.0),
    (20.14, 0.0906, 292.8),
    (26.08, 0.0649, 213.7),
    (30.89, 0.0482, 166.2),
    (35.00, 0.0360, 134.6),
]
SWEEP = [
    (0.0, 888.1, 0.0935, 1.122, 15.2),
    (0.3, 864.6, 0.0917, 1.130, 23.9),
    (0.6, 846.3, 0.0900, 1.137, 31.3),
    (1.2, 821.8, 0.0870, 1.154, 43.5),
    (2.5, 801.8, 0.0817, 1.191, 61.5),
]


@pytest.fixture(scope="module")
def motion():
    return example.impact()


def test_the_load_reaches_the_obstacle_at_the_thesis_instant_and_speed(motion):
    first = motion.contacts[0]
    assert first.start == pytest.approx(0.40783, abs=2e-4)
    assert first.approach_speed == pytest.approx(0.25, rel=1e-6)
    assert np.all(motion.force[motion.time < first.start] == 0.0)


def test_the_first_contact_has_the_reference_peak_duration_and_loss(motion):
    first = motion.contacts[0]
    assert first.peak_force == pytest.approx(864.6, abs=1.0)
    assert 1e3 * first.max_penetration == pytest.approx(0.0917, abs=2e-4)
    assert 1e3 * first.duration == pytest.approx(1.130, abs=5e-3)
    assert first.final_speed == pytest.approx(-0.2181, abs=1e-4)
    assert 100.0 * first.energy_loss == pytest.approx(23.9, abs=0.2)
    # Nothing of the push is left over a contact that ends where it began: the rest is friction.
    assert 100.0 * first.contact_loss == pytest.approx(9.3, abs=0.05)
    assert 100.0 * (first.energy_loss - first.contact_loss) == pytest.approx(14.6, abs=0.05)


def test_the_contacts_after_the_first_are_the_reference_ones(motion):
    first, *others = motion.contacts
    for contact, (start, speed, peak) in zip(others, LATER, strict=False):
        assert 1e3 * (contact.start - first.start) == pytest.approx(start, abs=0.01)
        assert contact.approach_speed == pytest.approx(speed, abs=1e-4)
        assert contact.peak_force == pytest.approx(peak, abs=0.1)
    last = motion.contacts[-1]
    assert len(motion.contacts) == 9 and last.lasting
    parted = [item for item in motion.contacts if not item.lasting][-1]
    assert 1e3 * (last.start - first.start) == pytest.approx(44.84, abs=0.05)
    assert 1e3 * (parted.start + parted.duration - first.start) == pytest.approx(44.25, abs=0.3)


def test_the_load_comes_to_rest_where_the_push_is_carried(motion):
    settled = simulate_impact(example.TRANSMISSION, example.TORQUE, example.CONTACT, gap=1e-3, duration=1.0)
    assert 1e3 * settled.penetration[-1] == pytest.approx(0.01048, abs=1e-5)
    assert settled.force[-1] == pytest.approx(0.5 / 0.015, rel=1e-3)
    assert motion.contacts[-1].lasting


def test_the_speed_stays_below_a_hundredth_from_the_reference_instant(motion):
    time = 1e3 * (motion.time - motion.contacts[0].start)
    assert time[np.abs(motion.load_speed) > 0.0025][-1] == pytest.approx(76.5, abs=0.5)
    assert time[np.abs(motion.force - 100.0 / 3.0) > 0.5 * 100.0 / 3.0][-1] == pytest.approx(61.0, abs=1.5)


@pytest.mark.parametrize(("ratio", "peak", "depth", "duration", "loss"), SWEEP)
def test_the_sweep_of_the_damping_gives_the_reference_values(ratio, peak, depth, duration, loss):
    law = HuntCrossley(9.8261e8, ratio * 9.8261e8, 1.5)
    found = simulate_impact(
        example.TRANSMISSION, example.TORQUE, law, gap=0.0, load_speed=0.25, duration=5e-3
    ).contacts[0]
    assert found.peak_force == pytest.approx(peak, abs=0.1)
    assert 1e3 * found.max_penetration == pytest.approx(depth, abs=1e-4)
    assert 1e3 * found.duration == pytest.approx(duration, abs=1e-3)
    assert 100.0 * found.energy_loss == pytest.approx(loss, abs=0.1)


def fixed_step_contact(step: float) -> tuple[float, float, float]:
    """Peak [N], duration [ms] and loss [%] of the first contact by Runge and Kutta's method with a fixed step [s]."""
    mass, drag, push = 2.35e-4 / 0.015**2, 0.03 / 0.015**2, 0.5 / 0.015

    def rates(state: np.ndarray) -> np.ndarray:
        force = float(example.CONTACT.force(state[0], state[1]))
        return np.array([state[1], (push - drag * state[1] - force) / mass])

    state, time, forces = np.array([0.0, 0.25]), 0.0, [0.0]
    while state[0] >= 0.0:
        before = state
        k1 = rates(state)
        k2 = rates(state + 0.5 * step * k1)
        k3 = rates(state + 0.5 * step * k2)
        k4 = rates(state + step * k3)
        state, time = state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), time + step
        forces.append(float(example.CONTACT.force(state[0], state[1])))
    share = before[0] / (before[0] - state[0])
    speed = before[1] + share * (state[1] - before[1])
    return max(forces), 1e3 * (time - step + share * step), 100.0 * (1.0 - (speed / 0.25) ** 2)


def test_a_fixed_step_of_10_us_gives_the_same_contact():
    peak, duration, loss = fixed_step_contact(1e-5)
    assert peak == pytest.approx(864.54, abs=0.05)
    assert duration == pytest.approx(1.1300, abs=1e-3)
    assert loss == pytest.approx(23.88, abs=0.02)
    first = example.impact().contacts[0]
    assert peak == pytest.approx(first.peak_force, abs=0.1)


def test_a_stiff_spring_makes_the_elastic_drive_the_rigid_one():
    elastic = replace(example.ELASTIC, stiffness=2e6, damping=1.0, motor_friction=0.03)
    law = HuntCrossley(1e5, 0.0, 1.0)
    settings_ = {"gap": 0.0, "load_speed": 0.25, "duration": 0.012}
    rigid = simulate_impact(elastic.rigid, ConstantTorque(0.5), law, **settings_)
    found = simulate_impact(elastic, ConstantTorque(0.5), law, **settings_)
    assert found.contacts[0].peak_force == pytest.approx(rigid.contacts[0].peak_force, rel=1e-3)
    assert found.contacts[0].duration == pytest.approx(rigid.contacts[0].duration, rel=1e-3)
    assert found.motor_position[-1] == pytest.approx(rigid.motor_position[-1], abs=1e-2)


@dataclass(frozen=True)
class Pulling:
    """A law that would pull: 4.2 as printed, without its clamp."""

    def force(self, penetration, rate):
        return 1e5 * penetration * (1.0 + 20.0 * rate)


def test_the_force_never_pulls_even_where_the_law_would():
    found = simulate_impact(
        RigidTransmission(1e-4, 0.0, 0.01), ConstantTorque(-0.5), Pulling(), gap=0.0, load_speed=1.0, duration=0.02
    )
    law = Pulling()
    assert np.any(law.force(np.maximum(found.penetration, 0.0), found.load_speed) < 0.0)
    assert np.all(found.force >= 0.0)


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
    found = simulate_impact(transmission, ConstantTorque(0.0), law, gap=0.0, load_speed=speed, duration=0.05)
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
            lambda: simulate_impact(
                example.TRANSMISSION, example.TORQUE, example.CONTACT, gap=0.0, duration=1.0, motor_speed=1.0
            ),
            "motor speed is 1 rad/s",
        ),
        (lambda: simulate_impact(example.TRANSMISSION, example.TORQUE, Hertz(1e8), gap=0.1, duration=-1.0), "duration"),
        (
            lambda: simulate_impact(
                example.TRANSMISSION,
                example.TORQUE,
                Hertz(1e8, permanent_indentation=1e-6),
                gap=0.1,
                duration=1.0,
            ),
            "leaves a dent",
        ),
    ],
)
def test_a_value_without_meaning_is_named(make, message):
    with pytest.raises(UsageError, match=message):
        make()


def test_a_bounce_that_never_ends_is_an_error_and_no_endless_loop():
    frictionless = RigidTransmission(1e-4, 0.0, 0.01)
    with pytest.raises(UsageError, match="more than 200 contacts"):
        simulate_impact(frictionless, ConstantTorque(1.0), HuntCrossley(1e9, 0.0), gap=1e-3, duration=100.0)


def test_a_slew_limit_bounds_the_slope_of_the_torque():
    limited = replace(example.SPEED_LOOP, slew_limit=2.0)
    found = simulate_impact(
        example.RANKED.transmission, limited, example.RANKED.obstacle, gap=0.0, load_speed=0.25, duration=0.05
    )
    slope = np.diff(found.motor_torque) / np.diff(found.time)
    assert np.max(np.abs(slope)) == pytest.approx(2.0, rel=1e-3)
    free = simulate_impact(
        example.RANKED.transmission,
        example.SPEED_LOOP,
        example.RANKED.obstacle,
        gap=0.0,
        load_speed=0.25,
        duration=0.05,
    )
    assert np.max(np.diff(free.motor_torque) / np.diff(free.time)) > 20.0

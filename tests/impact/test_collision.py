"""Simulated collisions against closed forms, and what no passive contact may do."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.bodies import Bodies
from cdtool.impact.collision import collide
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.contact_laws.hertz import Hertz
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.contact_laws.hysteresis_damping import HysteresisDamping
from cdtool.impact.contact_laws.kelvin_voigt import KelvinVoigt
from cdtool.impact.contact_laws.lankarani_nikravesh import LankaraniNikravesh
from cdtool.impact.restitution import damping_for_restitution, hunt_crossley_restitution

# Table 4.1 on the load side: J_t/r^2, d_t/r^2 and tau/r; the machine touches the wall at r tau/d_t.
EXAMPLE = Bodies(mass_1=2.35e-4 / 0.015**2, speed_1=0.25, push=0.5 / 0.015, friction=0.03 / 0.015**2)


@st.composite
def laws(draw: st.DrawFn) -> ContactLaw:
    k, x = draw(st.floats(1e5, 1e10)), draw(st.floats(0.0, 3.0))
    kinds = (
        Hertz(k, draw(st.sampled_from([1.0, 1.5, 2.0])), draw(st.floats(0.0, 1e-3))),
        KelvinVoigt(k, x * math.sqrt(k)),
        HysteresisDamping(k, x * k),
        HuntCrossley(k, x * k, draw(st.sampled_from([1.0, 1.5, 2.5]))),
        LankaraniNikravesh(k, draw(st.floats(0.0, 1.0)), draw(st.floats(0.05, 1.0))),
    )
    return draw(st.sampled_from(kinds))


def test_a_steel_sphere_meets_the_closed_form_of_hertz_to_a_millionth():
    law, mass = Hertz(1.538462e10), 0.032882
    hit = collide(law, Bodies(mass, 0.25)).first
    assert hit.greatest_penetration == pytest.approx(law.greatest_penetration(mass, 0.25), rel=1e-6)
    assert hit.greatest_penetration == pytest.approx(7.74577e-6, rel=2e-6)
    assert hit.peak_force == pytest.approx(331.653, rel=1e-5)
    assert hit.duration == pytest.approx(law.contact_duration(mass, 0.25), rel=1e-6)
    assert hit.duration == pytest.approx(91.192e-6, rel=1e-5)
    assert hit.rate[-1] == pytest.approx(-0.25, rel=1e-8)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("x", [0.01, 0.075, 0.3, 1.0, 2.0])
def test_hunt_crossley_rebounds_as_its_exact_relation_says_for_every_exponent(x, exponent):
    law = HuntCrossley(1e8, 2.0 * x * 1e8, exponent)
    hit = collide(law, Bodies(3.0, 0.5)).first
    assert hit.restitution.newton == pytest.approx(float(hunt_crossley_restitution(x)), abs=1e-8)
    assert hit.greatest_penetration == pytest.approx(law.greatest_penetration(3.0, 0.5), rel=1e-8)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.15, 0.99), st.floats(0.01, 5.0), st.floats(0.01, 100.0), st.floats(1e5, 1e11))
def test_the_damping_for_a_restitution_gives_just_that_rebound(e, speed, mass, stiffness):
    law = HuntCrossley(stiffness, damping_for_restitution(e, speed, stiffness))
    assert collide(law, Bodies(mass, speed)).first.restitution.newton == pytest.approx(e, abs=1e-7)


@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.3, 1.0, 2.0])
def test_kelvin_voigt_parts_when_its_force_has_ended_and_before_the_surface_is_back(ratio):
    law = KelvinVoigt(1e6, 2.0 * ratio * math.sqrt(1e6 * 2.0))
    hit = collide(law, Bodies(2.0, 0.5)).first
    assert hit.restitution.newton == pytest.approx(law.restitution(2.0), abs=1e-8)
    assert hit.force[0] == pytest.approx(law.damping * 0.5)
    assert hit.force[-1] == pytest.approx(0.0, abs=1e-6 * hit.peak_force)
    assert hit.penetration[-1] > 0.05 * hit.greatest_penetration
    if ratio < 1.0:
        # The oscillator's acceleration is 0 at the angle pi - atan2(...) of its damped oscillation.
        under = math.sqrt(1.0 - ratio**2)
        angle = math.pi - math.atan2(2.0 * ratio * under, 1.0 - 2.0 * ratio**2)
        assert hit.duration == pytest.approx(angle / (math.sqrt(1e6 / 2.0) * under), rel=1e-6)


@dataclass(frozen=True)
class Pulling:
    """Kelvin-Voigt as 3.17 is printed, without its clamp."""

    def force(self, penetration: FloatArray, rate: FloatArray) -> FloatArray:
        return np.asarray(
            np.where(np.less(penetration, 0.0), 0.0, 1e6 * np.asarray(penetration) + 400.0 * np.asarray(rate))
        )


def test_a_contact_ends_where_a_law_begins_to_pull():
    hit = collide(Pulling(), Bodies(2.0, 0.5)).first
    assert np.min(hit.force) >= -1e-6
    assert np.all(np.isnan(hit.stored))


def test_a_dent_takes_the_energy_that_its_closed_form_says_and_dissipates_it_on_the_way_in():
    law = Hertz(1e8, permanent_indentation=1e-4)
    hit = collide(law, Bodies(1.0, 0.5)).first
    assert hit.restitution.newton == pytest.approx(law.restitution(1.0, 0.5), abs=1e-8)
    assert hit.penetration[-1] == pytest.approx(1e-4, rel=1e-9)
    assert hit.dissipated[-1] == pytest.approx(hit.dissipated[hit.turn], rel=1e-7)
    assert np.all(np.diff(hit.dissipated) >= -1e-8 * hit.kinetic[0])


def test_a_dent_deeper_than_the_impact_stops_the_body():
    hit = collide(Hertz(1e8, permanent_indentation=1e-2), Bodies(1.0, 0.1)).first
    assert hit.separated
    assert (hit.restitution.newton, hit.restitution.poisson, hit.restitution.stronge) == (0.0, 0.0, 0.0)
    assert not collide(Hertz(1e8, permanent_indentation=1e-2), Bodies(1.0, 0.1, push=1.0)).first.separated


def test_a_ball_in_its_own_dent_bounces_without_further_loss():
    done = collide(Hertz(1e8, permanent_indentation=1e-5), Bodies(1.0, 0.1, push=9.81), contacts=4)
    speeds = [hit.approach_speed for hit in done.impacts]
    assert speeds[1] == pytest.approx(speeds[0] * done.first.restitution.newton, rel=1e-9)
    assert speeds[2:] == pytest.approx(speeds[1:-1], rel=1e-7)
    assert done.impacts[1].penetration[0] == pytest.approx(1e-5, rel=1e-6)


def test_a_ball_that_falls_flies_as_long_as_gravity_says():
    done = collide(HuntCrossley(1e8, 1e8), Bodies(0.5, 0.3, push=0.5 * 9.81), contacts=3)
    for before, after in zip(done.impacts, done.impacts[1:], strict=False):
        assert after.time[0] - before.time[-1] == pytest.approx(2.0 * -before.rate[-1] / 9.81, rel=1e-6)
        assert after.approach_speed == pytest.approx(-before.rate[-1], rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(laws(), st.floats(0.05, 50.0), st.floats(0.05, 50.0), st.floats(0.02, 3.0), st.floats(-2.0, 2.0))
def test_a_passive_contact_never_makes_energy_never_pulls_and_keeps_the_momentum(law, mass_1, mass_2, approach, drift):
    hit = collide(law, Bodies(mass_1, drift + approach, mass_2, drift)).first
    whole = hit.kinetic[0]
    assert np.min(hit.force) >= 0.0
    # What is not in the motion is in the contact, and what the contact has dissipated never comes back.
    assert hit.kinetic + hit.contact_work == pytest.approx(whole, rel=1e-7)
    assert np.all(np.diff(hit.dissipated) >= -1e-7 * whole)
    assert np.all(hit.dissipated >= -1e-7 * whole)
    for e in vars(hit.restitution).values():
        assert 0.0 <= e <= 1.0 + 1e-7
    momentum = hit.speeds @ np.array([mass_1, mass_2])
    assert momentum == pytest.approx(momentum[0], abs=1e-8 * (mass_1 + mass_2) * (approach + abs(drift)))
    assert hit.impulse[-1] == pytest.approx(mass_1 * (hit.speeds[0, 0] - hit.speeds[-1, 0]), rel=1e-6)
    e = hit.restitution
    assert (e.poisson, e.stronge) == pytest.approx((e.newton, e.newton), abs=1e-5)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"mass_1": 0.0}, "mass 1"),
        ({"mass_1": math.inf}, "mass 1"),
        ({"mass_2": -1.0}, "mass 2"),
        ({"speed_2": 0.5}, "nearer"),
        ({"push": -1.0}, "push"),
        ({"friction": math.nan}, "friction"),
    ],
)
def test_bodies_without_meaning_are_refused(changed, said):
    with pytest.raises(UsageError, match=said):
        Bodies(**({"mass_1": 1.0, "speed_1": 0.5} | changed))


def test_a_law_that_stops_nothing_and_counts_without_meaning_are_refused():
    class Nothing:
        def force(self, penetration: FloatArray, rate: FloatArray) -> FloatArray:
            return np.zeros_like(penetration) * rate

    with pytest.raises(UsageError, match="stop"):
        collide(Nothing(), Bodies(1.0, 0.5))
    with pytest.raises(UsageError, match="contacts"):
        collide(Hertz(1e8), Bodies(1.0, 0.5), contacts=0)
    with pytest.raises(UsageError, match="longest"):
        collide(Hertz(1e8), Bodies(1.0, 0.5), longest=0.0)

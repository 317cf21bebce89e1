"""Contact laws: forces, their constants, and what holds for every law of the table."""

from __future__ import annotations

import dataclasses
import math
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.impact.contact_laws import CONTACT_LAWS
from cdtool.impact.contact_laws.base import KeepsIndentation, StoresEnergy
from cdtool.impact.contact_laws.hertz import Hertz, hertz_stiffness
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.contact_laws.hysteresis_damping import HysteresisDamping
from cdtool.impact.contact_laws.kelvin_voigt import KelvinVoigt
from cdtool.impact.contact_laws.lankarani_nikravesh import LankaraniNikravesh

LAWS = {
    "hertz": Hertz(1e8, permanent_indentation=1e-4).pressed_to(4e-4),
    "kelvin_voigt": KelvinVoigt(1e6, 300.0),
    "hysteresis_damping": HysteresisDamping(1e6, 1e6),
    "hunt_crossley": HuntCrossley(1e8, 1e8),
    "lankarani_nikravesh": LankaraniNikravesh(1e8, 0.7, 0.5),
}
STEEL = {"young_1": 210e9, "poisson_1": 0.3, "young_2": 210e9, "poisson_2": 0.3}


def test_every_law_of_the_table_is_tried_here():
    assert list(LAWS) == CONTACT_LAWS.names()
    assert all(CONTACT_LAWS.load(name) is type(law) and law.name == name for name, law in LAWS.items())


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@settings(deadline=None)
@given(penetration=st.floats(-1e-2, 1e-2), rate=st.floats(-10.0, 10.0))
def test_no_law_pulls_and_none_acts_without_contact(law, penetration, rate):
    force = law.force(penetration, rate)
    assert force >= 0.0
    if penetration < 0.0:
        assert force == 0.0


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_arrays_give_what_their_elements_give(law):
    penetration, rate = np.linspace(-1e-4, 1e-3, 12), np.linspace(0.4, -3.0, 12)
    forces, energies = law.force(penetration, rate), law.stored_energy(penetration)
    assert forces.shape == energies.shape == (12,)
    alone = [float(law.force(float(d), float(v))) for d, v in zip(penetration, rate, strict=True)]
    assert forces == pytest.approx(alone, rel=1e-14)
    assert energies == pytest.approx([float(law.stored_energy(float(d))) for d in penetration], rel=1e-14)
    assert np.isscalar(law.force(1e-4, 0.1))


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_missing_penetration_never_results_in_a_force_that_looks_real(law):
    assert math.isnan(law.force(math.nan, 0.1))


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_stored_energy_is_the_work_of_the_static_force(law):
    depth = np.linspace(0.0, 3e-4, 200_001)
    work = np.trapezoid(law.force(depth, np.zeros_like(depth)), depth)
    assert isinstance(law, StoresEnergy)
    assert law.stored_energy(depth[-1]) == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_every_constant_has_a_unit_and_a_meaning_and_is_checked(law):
    for item in dataclasses.fields(law):
        assert item.metadata["unit"] and item.metadata["meaning"]
        with pytest.raises(UsageError) as fault:
            dataclasses.replace(law, **{item.name: -1.0})
        assert "-1" in fault.value.message and fault.value.hint
    with pytest.raises(UsageError):
        dataclasses.replace(law, stiffness=math.nan)


def test_the_stiffness_of_a_steel_sphere_on_steel_is_the_reference():
    assert hertz_stiffness(radius_1=0.01, radius_2=math.inf, **STEEL) == pytest.approx(1.538462e10, rel=1e-6)
    # 3.14 and 3.15 as printed, with two spheres.
    h = (1.0 - 0.3**2) / (pi * 210e9)
    printed = 4.0 / (3.0 * pi * 2.0 * h) * math.sqrt(0.01 * 0.03 / 0.04)
    assert hertz_stiffness(radius_1=0.01, radius_2=0.03, **STEEL) == pytest.approx(printed, rel=1e-12)


def test_the_example_of_chapter_4_is_a_contact_of_7_gigapascal():
    rigid = {"young_2": 1e20, "poisson_2": 0.0}
    k = hertz_stiffness(radius_1=0.01, radius_2=math.inf, young_1=7.37e9, poisson_1=0.0, **rigid)
    assert k == pytest.approx(9.8261e8, rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"radius_1": math.inf}, "both radii"),
        ({"radius_1": 0.0}, "radius 1"),
        ({"young_2": -1.0}, "modulus 2"),
        ({"poisson_1": 0.6}, "ratio 1"),
    ],
)
def test_two_planes_and_impossible_materials_are_refused(changed, said):
    with pytest.raises(UsageError, match=said):
        hertz_stiffness(**({"radius_1": 0.01, "radius_2": math.inf} | STEEL | changed))


def test_the_steel_sphere_at_a_quarter_metre_a_second_has_the_reference_contact():
    k = hertz_stiffness(radius_1=0.01, radius_2=math.inf, **STEEL)
    mass = 7850.0 * 4.0 / 3.0 * pi * 0.01**3
    assert mass == pytest.approx(0.032882, abs=5e-7)
    depth = Hertz(k).greatest_penetration(mass, 0.25)
    assert depth == pytest.approx(7.74577e-6, rel=1e-6)
    assert depth == pytest.approx((5.0 * mass * 0.25**2 / (4.0 * k)) ** 0.4, rel=1e-12)
    assert Hertz(k).force(depth) == pytest.approx(331.653, rel=2e-6)
    assert Hertz(k).contact_duration(mass, 0.25) == pytest.approx(91.192e-6, rel=5e-6)
    assert Hertz(k).contact_duration(mass, 0.25) == pytest.approx(2.9432752 * depth / 0.25, rel=1e-8)


@settings(deadline=None)
@given(st.floats(1e-3, 1e4), st.floats(1e-3, 10.0), st.floats(1e4, 1e11), st.floats(1.01, 100.0))
def test_the_contact_of_hertz_shortens_with_the_fifth_root_of_the_speed(mass, speed, stiffness, factor):
    law = Hertz(stiffness)
    slow, fast = (law.contact_duration(mass, v) for v in (speed, factor * speed))
    assert fast == pytest.approx(slow * factor**-0.2, rel=1e-9)
    deep, deeper = (law.greatest_penetration(mass, v) for v in (speed, factor * speed))
    assert deeper == pytest.approx(deep * factor**0.8, rel=1e-9)
    assert law.contact_duration(mass * factor, speed) == pytest.approx(slow * factor**0.4, rel=1e-9)


def test_a_linear_spring_has_the_half_period_of_a_rigid_gate_on_a_load_cell():
    gate = Hertz(5e5, exponent=1.0)
    depth = gate.greatest_penetration(620.0, 0.2)
    assert gate.force(depth) == pytest.approx(3521.4, abs=0.05)
    assert gate.force(depth) / 620.0 == pytest.approx(5.680, abs=5e-4)
    assert depth == pytest.approx(7.043e-3, abs=5e-7)
    assert gate.contact_duration(620.0, 0.2) == pytest.approx(110.63e-3, abs=5e-6)
    assert gate.stored_energy(depth) == pytest.approx(12.40, abs=5e-3)


def test_hertz_without_indentation_goes_back_the_way_it_came():
    law, depth = Hertz(1e8), np.linspace(0.0, 4e-4, 50)
    assert np.array_equal(law.pressed_to(4e-4).force(depth), law.force(depth))


def test_the_way_back_ends_at_the_permanent_indentation_and_begins_without_a_step():
    law = Hertz(1e8, permanent_indentation=1e-4).pressed_to(4e-4)
    assert law.force(1e-4) == 0.0 and law.force(1.01e-4) > 0.0
    assert law.surface == 1e-4
    assert law.force(4e-4 * (1 - 1e-9)) == pytest.approx(float(law.force(4e-4)), rel=1e-7)
    # Pressed in again it follows the way back, and beyond the old depth the first loading.
    assert law.force(3e-4) < Hertz(1e8).force(3e-4)
    assert law.force(5e-4) == Hertz(1e8).force(5e-4)


def test_the_memory_of_a_dent_only_grows_and_leaves_the_old_law_as_it_was():
    first = Hertz(1e8, permanent_indentation=1e-4)
    pressed = first.pressed_to(4e-4)
    assert isinstance(first, KeepsIndentation)
    assert (first.deepest, pressed.deepest, pressed.pressed_to(2e-4)) == (0.0, 4e-4, pressed)


def test_a_press_that_is_less_than_the_permanent_indentation_gives_nothing_back():
    law = Hertz(1e8, permanent_indentation=1e-3).pressed_to(4e-4)
    assert law.surface == 4e-4
    assert np.all(law.force(np.linspace(0.0, 3.99e-4, 20)) == 0.0)
    assert law.restitution(1.0, 0.1) == 0.0


def test_the_loss_of_a_dent_is_its_share_of_the_depth():
    law = Hertz(1e8, permanent_indentation=1e-4)
    depth = law.greatest_penetration(1.0, 0.5)
    assert law.restitution(1.0, 0.5) ** 2 == pytest.approx(1.0 - 1e-4 / depth, rel=1e-12)
    back = law.pressed_to(depth).stored_energy(depth) / Hertz(1e8).stored_energy(depth)
    assert back == pytest.approx(1.0 - 1e-4 / depth, rel=1e-12)
    assert law.stored_energy(depth) == pytest.approx(float(law.pressed_to(depth).stored_energy(depth)), rel=1e-12)


def test_kelvin_voigt_begins_with_a_step_and_parts_before_it_would_pull():
    law = KelvinVoigt(1e6, 300.0)
    assert law.force(0.0, 0.5) == 150.0
    assert law.force(1e-4, -0.2) == pytest.approx(40.0)
    assert law.force(1e-4, -0.4) == 0.0
    assert law.damping_ratio(1.0) == pytest.approx(0.15)


def test_hysteresis_damping_is_hunt_crossley_with_an_exponent_of_one():
    depth, rate = np.linspace(0.0, 1e-3, 20), np.linspace(0.5, -0.3, 20)
    linear = HysteresisDamping(1e6, 4e5)
    assert np.array_equal(linear.force(depth, rate), HuntCrossley(1e6, 4e5, 1.0).force(depth, rate))
    assert linear.force(0.0, 0.5) == 0.0


def test_hunt_crossley_has_the_depth_of_its_closed_form():
    law = HuntCrossley(9.8261e8, 2.9478e8)
    # A small damping number meets Hertz's depth without losing digits.
    for damping in (0.0, 1e-3, 1e2, 1e4):
        depth = HuntCrossley(1e8, damping).greatest_penetration(1.0, 0.5)
        assert depth == pytest.approx(Hertz(1e8).greatest_penetration(1.0, 0.5), rel=3e-5)
    lam, v = 0.3, 0.25
    stated = (2.5 * 1.04444 / 9.8261e8 * (v / lam - math.log(1.0 + lam * v) / lam**2)) ** 0.4
    assert law.greatest_penetration(1.04444, v) == pytest.approx(stated, rel=1e-5)
    assert stated == pytest.approx(0.0910e-3, abs=1e-7)


def test_lankarani_and_nikravesh_have_the_damping_of_3_22():
    law = LankaraniNikravesh(1e8, 0.8, 0.5)
    alpha = (1.0 - 0.8) / 0.5
    assert law.damping == pytest.approx(1.5 * alpha * 1e8 * (1.0 - alpha * 0.5 / 2.0), rel=1e-12)
    assert law.force(1e-4, 0.3) == HuntCrossley(1e8, law.damping).force(1e-4, 0.3)


def test_an_unknown_law_is_refused_with_the_nearest_name():
    with pytest.raises(UsageError) as fault:
        CONTACT_LAWS.load("hunt_crosley")
    assert "hunt_crossley" in fault.value.hint

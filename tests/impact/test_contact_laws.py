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
from cdtool.impact.contact_laws.base import StoresEnergy
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


@settings(deadline=None)
@given(st.floats(1e-3, 1e4), st.floats(1e-3, 10.0), st.floats(1e4, 1e11), st.floats(1.01, 100.0))
def test_the_contact_of_hertz_shortens_with_the_fifth_root_of_the_speed(mass, speed, stiffness, factor):
    law = Hertz(stiffness)
    slow, fast = (law.contact_duration(mass, v) for v in (speed, factor * speed))
    assert fast == pytest.approx(slow * factor**-0.2, rel=1e-9)
    deep, deeper = (law.greatest_penetration(mass, v) for v in (speed, factor * speed))
    assert deeper == pytest.approx(deep * factor**0.8, rel=1e-9)
    assert law.contact_duration(mass * factor, speed) == pytest.approx(slow * factor**0.4, rel=1e-9)


def test_the_way_back_ends_at_the_permanent_indentation_and_begins_without_a_step():
    law = Hertz(1e8, permanent_indentation=1e-4).pressed_to(4e-4)
    assert law.force(1e-4) == 0.0 and law.force(1.01e-4) > 0.0
    assert law.surface == 1e-4
    assert law.force(4e-4 * (1 - 1e-9)) == pytest.approx(float(law.force(4e-4)), rel=1e-7)
    # Pressed in again it follows the way back, and beyond the old depth the first loading.
    assert law.force(3e-4) < Hertz(1e8).force(3e-4)
    assert law.force(5e-4) == Hertz(1e8).force(5e-4)


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


def test_lankarani_and_nikravesh_have_the_damping_of_3_22():
    law = LankaraniNikravesh(1e8, 0.8, 0.5)
    alpha = (1.0 - 0.8) / 0.5
    assert law.damping == pytest.approx(1.5 * alpha * 1e8 * (1.0 - alpha * 0.5 / 2.0), rel=1e-12)
    assert law.force(1e-4, 0.3) == HuntCrossley(1e8, law.damping).force(1e-4, 0.3)

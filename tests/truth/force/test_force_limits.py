"""The file of force limits: its shipped content, and refused content."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.truth.force.limits import ForceStep, PressureLimit, profile_of, read_force_limits

ISO_QUASI_STATIC = {
    "skull_and_forehead": 130,
    "face": 65,
    "neck": 150,
    "back_and_shoulders": 210,
    "chest": 140,
    "abdomen": 110,
    "pelvis": 180,
    "upper_arms_and_elbows": 150,
    "lower_arms_and_wrists": 160,
    "hands_and_fingers": 140,
    "thighs_and_knees": 220,
    "lower_legs": 130,
}
HEAD = ("skull_and_forehead", "face")
GOOD = """
[door]
title = "Our doors"
source = "our own rule 7"
checked = true
average_of = 2
note = "since May"
steps = [
    { from_s = 0.0, at_most_n = 300.0, name = "impact" },
    { from_s = 0.5, at_most_n = 80, name = "clamped" },
]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_gap_profiles_of_the_gate_standard_differ_in_the_dynamic_force_only():
    shipped = read_force_limits()
    for name, dynamic in (("en_12453_reducing_gap", 400.0), ("en_12453_wide_gap", 1400.0)):
        profile = shipped[name]
        assert [(step.from_s, step.at_most_n) for step in profile.steps] == [(0.0, dynamic), (0.75, 150.0), (5.0, 25.0)]
        assert profile.average_of == 3


def test_robot_profiles_allow_twice_the_force_for_half_a_second_except_at_the_head():
    shipped = read_force_limits()
    found = {name.removeprefix("iso_ts_15066_"): item for name, item in shipped.items() if name.startswith("iso")}
    assert set(found) == set(ISO_QUASI_STATIC)
    for region, force in ISO_QUASI_STATIC.items():
        first = force if region in HEAD else 2.0 * force
        steps = found[region].steps
        assert [(step.from_s, step.at_most_n) for step in steps] == [(0.0, first), (0.5, force)], region
        assert found[region].average_of == 1


def test_every_shipped_profile_names_its_standard_and_says_that_it_is_unchecked():
    for profile in read_force_limits().values():
        assert re.search(r"EN 12453:2017|ISO/TS 15066:2016, Table A\.2", profile.source)
        assert not profile.checked
        assert "to be checked" in profile.warning
        assert replace(profile, checked=True).warning == ""


PRESSURES = {
    "skull_and_forehead": (130, 110),
    "face": (110,),
    "neck": (140, 210),
    "back_and_shoulders": (160, 210),
    "chest": (120, 170),
    "abdomen": (140,),
    "pelvis": (210,),
    "upper_arms_and_elbows": (190, 220),
    "lower_arms_and_wrists": (190, 180, 180),
    "hands_and_fingers": (300, 270, 280, 220, 200, 260, 260, 200, 190),
    "thighs_and_knees": (250, 220),
    "lower_legs": (220, 210),
}


def test_robot_profiles_limit_the_pressure_of_29_areas_and_gate_profiles_none():
    shipped = read_force_limits()
    for region, pressures in PRESSURES.items():
        profile = shipped[f"iso_ts_15066_{region}"]
        assert tuple(item.quasi_static for item in profile.pressures) == pressures
        factors = {item.first / item.quasi_static for item in profile.pressures}
        assert factors == ({1.0} if region in HEAD else {2.0})
        lowest = profile.pressure_limit()
        assert lowest is not None and lowest.quasi_static == min(pressures)
        assert "Table A.2" in profile.pressure_source and "pressure" in profile.pressure_source
        assert "pressures" not in profile.described
    areas = [item.area for profile in shipped.values() for item in profile.pressures]
    assert len(areas) == len(set(areas)) == 29
    assert shipped["en_12453_wide_gap"].pressure_limit() is None


LIMITED = (
    GOOD
    + """pressure_source = "our own rule 8"
pressures = [
    { area = "palm", transient_n_per_cm2 = 500, quasi_static_n_per_cm2 = 250 },
    { area = "thumb", quasi_static_n_per_cm2 = 300 },
]
"""
)


def test_a_file_of_the_user_may_limit_pressures_and_the_lowest_of_each_counts(tmp_path):
    door = read_force_limits(written(tmp_path, LIMITED))["door"]
    assert door.pressures == (PressureLimit("palm", 250.0, 500.0), PressureLimit("thumb", 300.0))
    assert door.pressure_limit() == PressureLimit("palm", 250.0, 300.0)
    assert door.pressure_limit("palm") == door.pressures[0]
    with pytest.raises(UsageError, match="no pressure for the body area 'thum'") as fault:
        door.pressure_limit("thum")
    assert "thumb" in fault.value.hint


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('pressure_source = "our own rule 8"', "", "door.pressure_source: is missing"),
        ("transient_n_per_cm2 = 500", "transient_n_per_cm2 = 200", r"door.pressures\[1\].transient_n_per_cm2: is 200"),
        ("quasi_static_n_per_cm2 = 300", "quasi_static_n_per_cm2 = 0", r"door.pressures\[2\].quasi_static_n_per_cm2"),
        ('"thumb"', '"palm"', r"door.pressures\[2\].area: is 'palm' again"),
        ('    { from_s = 0.5, at_most_n = 80, name = "clamped" },\n', "", "door.steps: has one step"),
        ("pressures = [\n", 'pressures = ["palm",\n', r"door.pressures\[1\]: is"),
    ],
)
def test_a_fault_in_the_pressures_names_file_and_key(tmp_path, old, new, key):
    assert old in LIMITED
    with pytest.raises(ConfigurationError, match=key) as fault:
        read_force_limits(written(tmp_path, LIMITED.replace(old, new)))
    assert "limits.toml" in fault.value.message


def test_a_file_of_the_user_replaces_the_shipped_one(tmp_path):
    profiles = read_force_limits(written(tmp_path, GOOD))
    assert list(profiles) == ["door"]
    door = profiles["door"]
    assert door.steps == (ForceStep(0.0, 300.0, "impact"), ForceStep(0.5, 80.0, "clamped"))
    assert (door.checked, door.average_of, door.note, door.warning) == (True, 2, "since May", "")
    assert (door.ends(0), door.ends(1)) == (0.5, float("inf"))


@pytest.mark.parametrize(
    ("old", "new", "key", "hint"),
    [
        ('source = "our own rule 7"', "", "door.source: is missing", "text"),
        ('source = "our own rule 7"', 'source = "  "', "door.source: is", "text"),
        ("average_of = 2", "average_of = 0", "door.average_of", "at least 1"),
        ("from_s = 0.0", "from_s = 0.1", r"door.steps\[1\].from_s: is 0.1", "give 0"),
        ("from_s = 0.5", "from_s = 0.0", r"door.steps\[2\].from_s: is 0", "more than 0"),
        ("at_most_n = 80", "at_most_n = 0", r"door.steps\[2\].at_most_n", "above 0"),
        ("at_most_n = 80", "at_most_n = inf", r"door.steps\[2\].at_most_n", "above 0"),
        ('"clamped"', '"impact"', r"door.steps\[2\].name: is 'impact' again", "different"),
        ("[door]", "limit = 3\n[door]", "limit: is 3", "table"),
    ],
)
def test_a_fault_names_file_and_key_and_what_is_allowed(tmp_path, old, new, key, hint):
    assert old in GOOD
    with pytest.raises(ConfigurationError, match=key) as fault:
        read_force_limits(written(tmp_path, GOOD.replace(old, new)))
    assert "limits.toml" in fault.value.message
    assert hint in str(fault.value)


def test_an_unknown_profile_is_answered_with_the_nearest():
    with pytest.raises(UsageError, match="en_12453_reducing") as fault:
        profile_of(read_force_limits(), "en_12453_reducing")
    assert "did you mean en_12453_reducing_gap" in fault.value.hint
    assert profile_of(read_force_limits(), "iso_ts_15066_face").title == "ISO/TS 15066: face"


def test_a_file_without_profiles_or_none_at_all_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="no profile"):
        read_force_limits(written(tmp_path, "# nothing\n"))
    with pytest.raises(ConfigurationError, match="no such file"):
        read_force_limits(tmp_path / "none.toml")

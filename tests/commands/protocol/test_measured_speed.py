"""The planned speed of a point against the one measured just before each contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.document.html import to_html
from cdtool.commands.protocol.document.words import words_of
from tests.synthetic.pressure_rig import Run, steady, write_pressure_rig


def made(folder: Path, *speeds, **changes: object) -> Protocol:
    return cdtool.protocol(write_pressure_rig(folder, [Run(speed=speed) for speed in speeds], **changes))


def result(protocol: Protocol) -> tuple[str, list[str]]:
    return protocol.verdict.outcome, [reason.kind for reason in protocol.verdict.reasons]


def test_a_test_at_half_the_speed_is_incomplete_and_names_both_speeds(tmp_path):
    protocol = made(tmp_path, steady(0.2), steady(-0.1))
    assert result(protocol) == ("incomplete", ["speed_differs"])
    assert words_of("en").reasons(protocol.verdict, "incomplete") == [
        "edge, no. 2 (edge/02.csv): measured speed 0.100 m/s, planned 0.2 m/s, allowed difference 10 %"
    ]


def test_a_point_may_state_another_tolerance_but_not_one_that_hides_half_the_speed(tmp_path):
    assert result(made(tmp_path / "a", steady(0.17), point="speed_tolerance_percent = 20")) == ("pass", [])
    assert result(made(tmp_path / "b", steady(0.19), point="speed_tolerance_percent = 2"))[1] == ["speed_differs"]
    with pytest.raises(ConfigurationError, match=r"point\[1\].speed_tolerance_percent: is 60"):
        made(tmp_path / "c", steady(0.1), point="speed_tolerance_percent = 60")


def test_a_gap_before_the_contact_is_incomplete_and_noise_and_other_gaps_are_not(tmp_path):
    rng = np.random.default_rng(3)

    def gap(begin: float, end: float):
        return lambda time: np.where((time > begin) & (time < end), np.nan, steady(0.2)(time))

    def noisy(time):
        return steady(0.2)(time) + rng.normal(0.0, 0.02, len(time))

    assert result(made(tmp_path / "before", gap(-0.08, 0.1))) == ("incomplete", ["speed_missing"])
    assert result(made(tmp_path / "earlier", gap(-1.0, -0.06))) == ("pass", [])
    assert result(made(tmp_path / "noisy", noisy)) == ("pass", [])


def test_a_speed_in_another_unit_or_from_the_position_is_the_same(tmp_path):
    def travelled(time):
        return 0.2 * np.minimum(time, 0.0) + 1.0

    mapped = '{ column = "v", unit = "mm/s" }'
    scaled = made(tmp_path / "mm", lambda time: 1e3 * steady(0.2)(time), speed=mapped)
    assert result(scaled) == ("pass", [])
    path = write_pressure_rig(tmp_path / "derived", [Run(speed=travelled)])
    machine = path.with_name("machine.toml")
    text = machine.read_text(encoding="utf-8")
    machine.write_text(
        text.replace('speed = { column = "v", unit = "m/s" }', 'position = { column = "v", unit = "m" }')
    )
    derived = cdtool.protocol(path)
    assert result(derived) == ("pass", [])
    assert derived.points[0].repetitions[0].speed == pytest.approx(0.2, rel=0.02)


def test_a_rotation_is_no_speed_of_the_contact_and_the_page_says_so(tmp_path):
    path = write_pressure_rig(tmp_path, [Run(speed=steady(0.1))])
    machine = tmp_path / "machine.toml"
    text = machine.read_text(encoding="utf-8")
    others = {"linear_axis": "rotary_axis", "load_mass": "load_inertia", '"m/s"': '"rad/s"'}
    others['force_drive", unit = "N"'] = 'force_drive", unit = "N m"'
    for old, new in others.items():
        text = text.replace(old, new)
    machine.write_text(text, encoding="utf-8")
    protocol = cdtool.protocol(path)
    assert protocol.points[0].repetitions[0].speed is None and result(protocol) == ("pass", [])
    assert "the planned speed is not confirmed by a measurement: edge" in to_html(protocol_document(protocol))

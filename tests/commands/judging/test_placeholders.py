"""`cdtool info` warns of placeholders of `cdtool init` that are still in the machine file."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.init.drafting import init
from cdtool.commands.judging.information import info
from tests.base.findings.facts import fact_of

KINDS = ("placeholder_inertia", "placeholder_ratio", "placeholder_scale", "unchecked_lines")


@pytest.fixture
def log(tmp_path):
    """A motor at up to 1432 rpm, 150 rad/s, with its current."""
    time = np.arange(2000) / 500.0
    speed = 150.0 * np.sin(2.0 * time)
    current = 0.4 * np.cos(2.0 * time) + np.sign(speed)
    path = tmp_path / "log.csv"
    rows = np.column_stack((time, speed * 60.0 / (2.0 * np.pi), current))
    np.savetxt(path, rows, delimiter=",", header="t [s],n [rpm],i [A]", comments="")
    return path


def machine_file(folder, kind="linear_axis", ratio=1.0, mass=0.0, scale=1.0, coordinates="motor"):
    path = folder / "machine.toml"
    load = "load_mass" if kind == "linear_axis" else "load_inertia"
    path.write_text(
        f'[machine]\ntype = "{kind}"\ncoordinates = "{coordinates}"\ntransmission_ratio = {ratio}\n{load} = {mass}\n'
        '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "n", unit = "rpm" }\n'
        f'torque = {{ column = "i", unit = "A", scale = {scale} }}\n'
    )
    return path


def placeholders(log, machine):
    return {item.kind: fact_of(item) for item in info(log, machine=machine).findings if item.kind in KINDS}


def test_a_draft_has_warnings_with_the_speed_that_a_placeholder_causes(log, tmp_path):
    init(log, tmp_path / "machine.toml")
    found = placeholders(log, tmp_path / "machine.toml")
    assert set(found) == set(KINDS)
    assert found["placeholder_ratio"].numbers["speed"] == pytest.approx(150.0, rel=1e-3)
    assert found["placeholder_scale"] == ("placeholder_scale", {"raw": "A", "unit": "N m", "per": "A"})
    assert found["placeholder_inertia"].numbers["key"] == "load_mass"
    assert (
        "transmission_ratio" in found["unchecked_lines"].numbers["keys"]
        and found["unchecked_lines"].numbers["count"] >= 4
    )


def test_each_placeholder_is_found_alone(log, tmp_path):
    complete = {"ratio": 0.01, "mass": 20.0, "scale": 0.05}
    for key, value, kind in (("ratio", 1.0, "placeholder_ratio"), ("mass", 0.0, "placeholder_inertia"),
                             ("scale", 1.0, "placeholder_scale")):  # fmt: skip
        assert set(placeholders(log, machine_file(tmp_path, **{**complete, key: value}))) == {kind}


def test_marks_are_counted_by_key_after_the_line_and_before_it(log, tmp_path):
    path = machine_file(tmp_path, ratio=0.01, mass=20.0, scale=0.05)
    text = path.read_text()
    text = text.replace("transmission_ratio = 0.01", "# CHECK: measured?\n# on two lines\ntransmission_ratio = 0.01")
    path.write_text(
        text.replace("load_mass = 20.0", 'load_mass = 20.0  # from the data sheet. CHECK: "with the leaf"?')
    )
    assert placeholders(log, path) == {
        "unchecked_lines": ("unchecked_lines", {"count": 2, "keys": ("transmission_ratio", "load_mass")})
    }

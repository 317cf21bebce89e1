"""The errors that `cdtool identify` prints for robots cover: dynamics, friction and logs are not those of cdtool."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.commands.identify.robot_coverage import Value, friction_values, gain_values, gain_values_with_centre

ROBOTS = (("planar", 0), ("planar", 1), ("scara", 0), ("scara", 1))


def known(values: list[Value], *keys: str) -> list[float]:
    return [item.distance for item in values if item.key in keys and np.isfinite(item.distance)]


def test_printed_errors_cover_the_friction_of_strange_robots(tmp_path: Path) -> None:
    values: list[Value] = []
    for kind, seed in ROBOTS:
        folder = tmp_path / f"{kind}{seed}"
        folder.mkdir()
        values += friction_values(kind, seed, folder)
    friction = known(values, "viscous_friction", "coulomb_friction")
    assert len(friction) >= 0.7 * 24
    # With 95 % each, less than 18 of 24 in one of 100 000 draws of these robots.
    assert np.mean(np.array(friction) < 1.96) >= 0.75
    assert max(known(values, "constant_force")) < 5.0


def test_torque_constants_with_an_unknown_centre_are_right_or_refused(tmp_path: Path) -> None:
    values = gain_values("scara", 0, tmp_path)
    assert [np.isfinite(item.distance) for item in values] == [True, True, True, False]
    assert max(known(values, "scale")) < 4.0
    # The payload turns about its own axis there: nothing of it but its inertia loads the joint.
    assert values[3].value / values[3].true > 0.5


def test_a_given_centre_makes_the_joint_that_it_loads_identifiable(tmp_path: Path) -> None:
    values = gain_values_with_centre("planar", 0, tmp_path)
    assert len(known(values, "scale, centre given")) == 2
    assert max(known(values, "scale, centre given")) < 4.0

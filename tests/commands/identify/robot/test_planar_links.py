"""The links of a planar arm from its base parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.robot.planar_links import PlanarLinks, planar_links
from cdtool.commands.identify.robot.robot_dynamics import FRICTION, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup
from cdtool.machines.planar_arm import PlanarArm
from tests.commands.identify.robot_motion import coloured, fourier, planar_arm

ARM = planar_arm(coulomb_slope=50.0)
INERTIAL = FRICTION | {ColumnGroup.INERTIAL}


def links(machine: PlanarArm, present: PlanarArm, noise: float = 0.0, seed: int = 1) -> PlanarLinks:
    run = fourier(seed, 2, 20.0, 0.005).run(machine, noise * coloured(seed, (4000, 2), 5.0))
    return planar_links(identify_robot([run], present, INERTIAL))


def values(found: PlanarLinks) -> list[float]:
    return [item.value for item in found.estimates]


def test_centres_and_inertias_are_those_of_the_arm() -> None:
    wrong = replace(ARM, centre_of_mass=(0.1, 0.1), link_inertia=(0.1, 0.1))
    found = links(ARM, wrong)
    assert values(found) == pytest.approx([0.14, 0.18, 0.012, 0.018], rel=2e-3)
    assert [(item.key, item.joint, item.unit) for item in found.estimates] == [
        ("centre_of_mass", 0, "m"),
        ("centre_of_mass", 1, "m"),
        ("link_inertia", 0, "kg m2"),
        ("link_inertia", 1, "kg m2"),
    ]


def test_the_standard_errors_cover_and_the_products_agree_within_theirs() -> None:
    distance, shifts = [], []
    for seed in range(20):
        found = links(ARM, ARM, 0.1, seed)
        true = (0.14, 0.18, 0.012, 0.018)
        rows = zip(found.estimates, true, strict=True)
        distance += [(item.value - value) / item.standard_error for item, value in rows]
        shifts.append(found.shift)
    assert np.mean(np.abs(distance) < 2.0) >= 0.85
    assert np.median(np.abs(distance)) > 0.3
    assert np.median(shifts) < 2.0


def test_a_wrong_length_is_a_contradiction() -> None:
    assert links(ARM, replace(ARM, link_length=0.29), 0.01).shift > 4.0
    assert links(ARM, ARM, 0.01).shift < 3.0


def test_links_that_no_body_can_have_and_a_horizontal_arm_are_refused() -> None:
    with pytest.raises(IdentificationError, match="would have an inertia of -"):
        links(ARM, replace(ARM, link_mass=(1.3, 0.5)), 0.01)
    flat = replace(ARM, gravity_acceleration=0.0)
    with pytest.raises(IdentificationError, match="horizontally"):
        links(flat, flat, 0.1)

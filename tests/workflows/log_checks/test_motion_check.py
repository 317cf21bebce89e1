"""Consistency of speed and position in a log: joints at rest are no evidence, and a warning names joint and units."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cdtool.findings.motion import SpeedSignOpposite
from cdtool.recording import Recording, Series
from cdtool.workflows.log_checks.motion_check import motion_findings

TIME = np.arange(0.0, 10.0, 2e-3)
JOINTS = ("shoulder", "elbow", "wrist")


def arm(speed: np.ndarray, position: np.ndarray, joints: tuple[str, ...] = JOINTS) -> list[Any]:
    channels = {"speed": Series(TIME, speed, "rad/s"), "position": Series(TIME, position, "rad")}
    found = motion_findings(Recording("arm", "arm.csv", joints, channels))
    return [item.fact for item in found if item.severity == "warning"]


def swing(amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    return amplitude * np.cos(0.8 * TIME), amplitude / 0.8 * np.sin(0.8 * TIME)


@pytest.mark.parametrize("quantum", [0.0, 1e-4])
@pytest.mark.parametrize("offset", [0.0, 2e-3])
@pytest.mark.parametrize("seed", range(3))
def test_joints_at_rest_give_no_warning_whatever_noise_offset_and_encoder(seed, offset, quantum):
    rng = np.random.default_rng(seed)
    speed, position = (np.column_stack([column, column, column]) for column in swing(0.5))
    speed[:, 1:] = offset + rng.normal(0.0, 5e-3, (len(TIME), 2))
    position[:, 1:] = 0.3 + rng.normal(0.0, 2e-5, (len(TIME), 2))
    # The wrist sags by a few encoder steps while it is held.
    position[:, 2] += 4e-4 * TIME / TIME[-1]
    if quantum:
        position = np.round(position / quantum) * quantum
    assert arm(speed, position) == []


def test_a_joint_whose_units_are_wrong_is_named_with_its_units_and_the_factor():
    speed, position = (np.column_stack([column, 0.7 * column, 0.0 * column]) for column in swing(0.5))
    position[:, 1] = np.rad2deg(position[:, 1])
    (fact,) = arm(speed, position)
    assert (fact.joint, fact.as_between) == ("elbow", "deg and rad")
    assert (fact.speed_unit, fact.position_unit) == ("rad/s", "rad")
    assert fact.integrated == pytest.approx(0.875, rel=0.01)
    assert fact.spanned / fact.integrated == pytest.approx(57.3, rel=0.01)


def test_a_single_axis_with_wrong_units_is_still_found_and_one_at_rest_is_not():
    speed, position = (column[:, np.newaxis] for column in swing(0.5))
    (fact,) = arm(speed, 1e3 * position, ("axis",))
    assert (fact.joint, fact.as_between) == ("", "mm and m, or ms and s")
    rng = np.random.default_rng(4)
    still = rng.normal(0.0, 2e-5, (len(TIME), 1))
    assert arm(5e-3 + rng.normal(0.0, 5e-3, (len(TIME), 1)), still, ("axis",)) == []


def test_a_joint_with_the_opposite_sign_is_named():
    speed = np.column_stack([np.full(len(TIME), 0.1), np.full(len(TIME), 0.1), np.zeros(len(TIME))])
    position = np.cumsum(speed, axis=0) * 2e-3 * (1.0, -1.0, 1.0)
    assert arm(speed, position) == [SpeedSignOpposite("elbow")]

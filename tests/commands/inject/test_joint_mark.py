"""A position of a named joint."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from cdtool.commands.inject.inject_section import JointMark
from cdtool.recordings.recording import Recording, Series
from tests.machines.robot_model.test_chain import planar_arm
from tests.synthetic.robots import six_joint_robot

TIME = np.arange(200) * 0.01
POSITION = np.column_stack((np.sin(TIME), 1.0 - TIME))


def recording() -> Recording:
    return Recording("log", "log", ("arm", "forearm"), {"position": Series(TIME, POSITION, "rad")})


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("arm = 30deg", math.asin(math.pi / 6.0)),
        ("forearm=0.3 rad", 0.7),
        ("forearm = -0.5rad", 1.5),
        ("arm = 1.2rad", math.inf),
    ],
)
def test_the_position_is_passed_from_either_side(text: str, time: float) -> None:
    mark = JointMark.of_machine(text, planar_arm())
    assert mark.time_in(recording()) == pytest.approx(time, abs=0.011)


def test_a_robot_of_both_kinds_has_both_units(tmp_path: Path) -> None:
    robot = six_joint_robot(tmp_path)
    assert str(JointMark.of_machine("reach = 30mm", robot)) == "reach = 0.03 m"
    assert JointMark.of_machine("pan = 90deg", robot).value == pytest.approx(math.pi / 2.0)

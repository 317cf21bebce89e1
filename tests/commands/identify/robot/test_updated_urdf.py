"""A URDF with new inertias is read back with the same parameters, and is otherwise untouched."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.robot.robot_regressor import body_parameters, with_bodies
from cdtool.commands.identify.robot.updated_urdf import updated_urdf
from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.urdf_reader import read_urdf
from tests.data_folder import UR10E_LOGS
from tests.synthetic.robots import JOINTS, six_joint_urdf

pytest.importorskip("pinocchio")


def read(folder: Path, text: str, names: tuple[str, ...] = JOINTS) -> KinematicTree:
    path = folder / "read.urdf"
    path.write_text(text, encoding="utf-8")
    return read_urdf(path, names, {})


def bodies(tree: KinematicTree) -> FloatArray:
    return np.array([body_parameters(joint) for joint in tree.joints])


def heavier(tree: KinematicTree) -> KinematicTree:
    factors = 1.0 + 0.1 * np.arange(len(tree.joints))
    return with_bodies(tree, bodies(tree) * factors[:, np.newaxis])


def without_inertials(text: str) -> list[str]:
    kept, inside = [], False
    for line in text.splitlines():
        inside = inside or "<inertial>" in line
        if not inside and line.strip():
            kept.append(line)
        inside = inside and "</inertial>" not in line
    return kept


def test_the_reader_gets_the_same_parameters_back(tmp_path: Path) -> None:
    tree = heavier(read(tmp_path, six_joint_urdf()))
    again = read(tmp_path, updated_urdf(six_joint_urdf(), tree))
    np.testing.assert_allclose(bodies(again), bodies(tree), rtol=1e-12, atol=1e-14)
    assert [(joint.rotation, joint.translation) for joint in again.joints] == [
        (joint.rotation, joint.translation) for joint in tree.joints
    ]


FIXED = """<?xml version="1.0" encoding="utf-8"?>
<!-- a comment before the robot -->
<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="base"/>
  <link name="arm">
    <!-- measured with "care" -->
    <inertial>
      <mass value="2"/><origin xyz="0.1 0 0" rpy="0 0 0"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="tool">
    <inertial><origin xyz="0 0.01 0.05" rpy="0.3 0.2 0.1"/><mass value="0.5"/>
      <inertia ixx="0.001" iyy="0.0012" izz="0.0008" ixy="0.0001" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="swing" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1" rpy="0.1 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="arm"/><child link="tool"/>
    <origin xyz="0.4 0 0" rpy="0 0.5 0"/></joint>
  <gazebo reference="arm"><material>Gazebo/Grey</material></gazebo>
</robot>
"""


@pytest.mark.parametrize("factor", [1.2, 0.1])
def test_the_joints_own_link_carries_what_is_fixed_to_it(tmp_path: Path, factor: float) -> None:
    tree = read(tmp_path, FIXED, ("swing",))
    text = updated_urdf(FIXED, with_bodies(tree, factor * bodies(tree)))
    assert text.count("<inertial>") == 1
    np.testing.assert_allclose(bodies(read(tmp_path, text, ("swing",))), factor * bodies(tree), rtol=1e-12)


def test_everything_but_the_inertials_stays_as_it_was(tmp_path: Path) -> None:
    head, *rest = without_inertials(updated_urdf(FIXED, heavier(read(tmp_path, FIXED, ("swing",)))))
    assert rest == without_inertials(FIXED)[3:]
    for kept in ("<!-- a comment before the robot -->", 'name="one"', 'xmlns:xacro="http://www.ros.org/wiki/xacro"'):
        assert kept in head


@pytest.mark.parametrize(
    "link", ['<link name="arm"/>', '<link name="arm">\n  </link>', '<link name="arm"><inertial/></link>']
)
def test_a_link_without_inertial_gets_one(tmp_path: Path, link: str) -> None:
    start, end = FIXED.index('<link name="arm">'), FIXED.index('  <link name="tool">')
    text = FIXED[:start] + link + "\n" + FIXED[end:]
    tree = read(tmp_path, text.replace("<inertial/>", ""), ("swing",))
    wanted = bodies(tree) + bodies(read(tmp_path, FIXED, ("swing",)))
    new = updated_urdf(text, with_bodies(tree, wanted))
    np.testing.assert_allclose(bodies(read(tmp_path, new, ("swing",))), wanted, rtol=1e-12)


def test_the_urdf_of_a_real_robot_comes_back(tmp_path: Path) -> None:
    text = (UR10E_LOGS / "ur10e.urdf").read_text(encoding="utf-8")
    names = tuple(f"joint{i}" for i in range(1, 7))
    tree = heavier(read(tmp_path, text, names))
    np.testing.assert_allclose(bodies(read(tmp_path, updated_urdf(text, tree), names)), bodies(tree), atol=1e-12)

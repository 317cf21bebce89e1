"""A fictitious robot with six revolute, continuous and prismatic joints and skew axes, as a URDF and as a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cdtool.machines.urdf_robot import UrdfRobot

_LINK = """<link name="{name}"><inertial><origin xyz="{com}" rpy="0 0 0"/><mass value="{mass}"/>
<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0.001" ixz="0" iyz="-0.002"/></inertial>
<visual><geometry><mesh filename="package://nowhere/{name}.stl"/></geometry></visual></link>"""
_JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{position}" rpy="{rotation}"/><axis xyz="{axis}"/>
<limit lower="-3" upper="3" effort="100" velocity="3"/></joint>"""

JOINTS = ("pan", "lift", "elbow", "reach", "wrist", "tool")
_KINDS = ("revolute", "revolute", "continuous", "prismatic", "revolute", "continuous")
_AXES = ("0 0 1", "0 1 0", "0.2 1 0.1", "1 0 0.3", "0 0 -1", "0.5 0.5 0.7")
_MASSES = (8.0, 6.0, 4.0, 2.5, 1.5, 0.8)


def six_joint_urdf(kinds: Sequence[str] = _KINDS) -> str:
    """Return the text of the URDF; its meshes do not exist."""
    parts = ['<robot name="six"><link name="base"/>']
    for i, (name, kind, axis, mass) in enumerate(zip(JOINTS, kinds, _AXES, _MASSES, strict=True)):
        parent = f"link{i}" if i else "base"
        com = f"{0.05 + 0.02 * i} {0.01 * i} 0.08"
        spin = {"ixx": 0.05 * mass, "iyy": 0.06 * mass, "izz": 0.04 * mass}
        parts.append(_LINK.format(name=f"link{i + 1}", com=com, mass=mass, **spin))
        origin = {
            "position": f"0.1 {0.02 * i} {0.3 - 0.03 * i}",
            "rotation": f"{0.1 * i} {0.2 - 0.1 * i} 0.3",
        }
        parts.append(_JOINT.format(name=name, kind=kind, parent=parent, child=f"link{i + 1}", axis=axis, **origin))
    return "\n".join([*parts, "</robot>"])


def six_joint_robot(folder: Path, joints: Sequence[str] = JOINTS, **keys: object) -> UrdfRobot:
    """Return the robot as a machine; requires pinocchio."""
    (folder / "six.urdf").write_text(six_joint_urdf(), encoding="utf-8")
    values = {
        "urdf": "six.urdf",
        "joints": list(joints),
        "drive_inertia": 0.3,
        "viscous_friction": 2.0,
        "coulomb_friction": 1.0,
        "coulomb_slope": 50.0,
        **keys,
    }
    return UrdfRobot.of(values, str(folder / "machine.toml"))


def urdf_robot(folder: Path, urdf: str, values: Mapping[str, object]) -> UrdfRobot:
    """Return a machine from the text of a URDF and the keys of its [machine] table; requires pinocchio."""
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    return UrdfRobot.of({"urdf": "robot.urdf", **values}, str(folder / "machine.toml"))

"""A rotary axis: hinged door, barrier, turntable, or the joints of a robot without a known coupled model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from cdtool.base.settings import setting
from cdtool.machines.axis import Axis
from cdtool.machines.joint_machine import JointTable, PerJointNotNegative


@dataclass(frozen=True, kw_only=True)
class RotaryAxisTable(JointTable):
    """The keys of a rotary axis."""

    load_inertia: Annotated[PerJointNotNegative, setting("inertia of the load", unit="kg m2")] = (0.0,)


@dataclass(frozen=True)
class RotaryAxis(Axis):
    """Axes that turn: hinged door, barrier, turntable; several of them move independently.

    Motor and load inertia [kg m2], ratio [rad/rad], friction at the motor [N m s/rad, N m]; load side N m, rad. The
    joints are treated as uncoupled: on a robot only detectors without a model (pure_torque) are meaningful.
    """

    table: ClassVar[type[JointTable]] = RotaryAxisTable
    inertia_key: ClassVar[str] = "load_inertia"

"""A linear axis: gate, sliding door, ball screw, gantry. Several axes that move independently are its joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from cdtool.base.settings import setting
from cdtool.machines.axis import Axis
from cdtool.machines.joint_machine import LINEAR_UNITS, JointTable, PerJointNotNegative


@dataclass(frozen=True, kw_only=True)
class LinearAxisTable(JointTable):
    """The keys of a linear axis."""

    load_mass: Annotated[PerJointNotNegative, setting("moved mass", unit="kg")] = (0.0,)


@dataclass(frozen=True)
class LinearAxis(Axis):
    """Axes that slide: gate, door, ball screw, gantry; several of them move independently.

    Motor inertia [kg m2], load mass [kg], ratio [m/rad], friction at the motor [N m s/rad, N m]; load side N, m. With
    coordinates = "load" friction is given at the load [N s/m, N].
    """

    table: ClassVar[type[JointTable]] = LinearAxisTable
    inertia_key: ClassVar[str] = "load_mass"
    ratio_unit: ClassVar[str] = "m/rad"

    @property
    def load_units(self) -> dict[str, str]:
        """N, m/s, m, m/s2."""
        return LINEAR_UNITS

"""A linear axis: gate, sliding door, ball screw, gantry. Several axes that move independently are its joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from cdtool.machines.axis import Axis
from cdtool.machines.joint_machine import LINEAR_UNITS


@dataclass(frozen=True)
class LinearAxis(Axis):
    """Axes that slide: gate, door, ball screw, gantry; several of them move independently.

    Motor inertia [kg m2], load mass [kg], ratio [m/rad], friction at the motor [N m s/rad, N m]; load side N, m. With
    coordinates = "load" friction is given at the load [N s/m, N].
    """

    inertia_key: ClassVar[str] = "load_mass"
    ratio_unit: ClassVar[str] = "m/rad"

    @property
    def load_units(self) -> dict[str, str]:
        """N, m/s, m, m/s2."""
        return LINEAR_UNITS

"""A linear axis: gate, sliding door, ball screw, gantry. Several axes that move independently are its joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from cdtool.machines.axis import Axis


@dataclass(frozen=True)
class LinearAxis(Axis):
    """Motor inertia [kg m2], load mass [kg], ratio [m/rad], friction at the motor [N m s/rad, N m]; load side N, m.

    With coordinates = "load" friction is given at the load [N s/m, N].
    """

    load_units: ClassVar[Mapping[str, str]] = {
        "torque": "N",
        "speed": "m/s",
        "position": "m",
        "acceleration": "m/s2",
    }
    inertia_key: ClassVar[str] = "load_mass"
    ratio_unit: ClassVar[str] = "m/rad"

"""A rotary axis: hinged door, barrier, turntable, or the joints of a robot of which no coupled model is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from cdtool.machines.axis import Axis


@dataclass(frozen=True)
class RotaryAxis(Axis):
    """Motor and load inertia [kg m2], ratio [rad/rad], friction at the motor [N m s/rad, N m]; load side N m, rad.

    Its joints are taken as uncoupled: on a robot only detectors without a model (pure_torque) are meaningful.
    """

    load_units: ClassVar[Mapping[str, str]] = {
        "torque": "N m",
        "speed": "rad/s",
        "position": "rad",
        "acceleration": "rad/s2",
    }
    inertia_key: ClassVar[str] = "load_inertia"
    ratio_unit: ClassVar[str] = "rad/rad"

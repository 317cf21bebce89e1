"""A rotary axis: hinged door, barrier, turntable, or the joints of a robot without a known coupled model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from cdtool.machines.axis import Axis


@dataclass(frozen=True)
class RotaryAxis(Axis):
    """Axes that turn: hinged door, barrier, turntable; several of them move independently.

    Motor and load inertia [kg m2], ratio [rad/rad], friction at the motor [N m s/rad, N m]; load side N m, rad. The
    joints are treated as uncoupled: on a robot only detectors without a model (pure_torque) are meaningful.
    """

    inertia_key: ClassVar[str] = "load_inertia"

"""The hysteresis damping model: a linear spring, with damping that grows with the penetration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.impact.checks import require_not_negative, require_positive
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley


@dataclass(frozen=True)
class HysteresisDamping:
    """F = k delta + mu delta d(delta)/dt (thesis 3.18), never a pull: Hunt-Crossley's law with n = 1.

    It begins and ends without a step and without tension (the thesis attributes the tension of 3.17 to it). Fails for
    curved bodies, whose stiffness grows with the penetration, and where Hunt-Crossley's law fails.
    """

    name: ClassVar[str] = "hysteresis_damping"
    title: ClassVar[str] = "Hysteresis damping"
    source: ClassVar[str] = "thesis 3.18"

    stiffness: float = field(metadata={"unit": "N/m", "meaning": "k of the spring"})
    damping: float = field(metadata={"unit": "N s/m^2", "meaning": "mu: hysteresis damping factor"})

    def __post_init__(self) -> None:
        require_positive("the stiffness", self.stiffness, "N/m")
        require_not_negative("the damping", self.damping, "N s/m^2")

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike) -> FloatArray:
        """Force [N] at a penetration [m] and its rate [m/s]."""
        return self._general.force(penetration, rate)

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """k delta^2/2 [J]: the spring's."""
        return self._general.stored_energy(penetration)

    def restitution(self, approach_speed: float) -> float:
        """e at an approach speed [m/s], whatever the mass."""
        return self._general.restitution(approach_speed)

    @property
    def _general(self) -> HuntCrossley:
        return HuntCrossley(self.stiffness, self.damping, 1.0)

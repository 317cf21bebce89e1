"""Lankarani and Nikravesh's contact: Hunt-Crossley's with a damping for impacts that lose little."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.impact.checks import require_exponent, require_positive, require_restitution
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.restitution import lankarani_nikravesh_damping


@dataclass(frozen=True)
class LankaraniNikravesh:
    """F = k delta^n (1 + 3 (1 - e^2)/(4 v) d(delta)/dt): Hunt-Crossley's law with mu of 3.22, never a pull.

    `restitution` is the e wanted at `approach_speed`; the result is larger, 0.85 for 0.8 and 0.73 for 0.5.
    Use `HuntCrossley` with `damping_for_restitution` for e below 0.9. Fails where that law fails, and at other
    speeds than the one it is made for.
    """

    name: ClassVar[str] = "lankarani_nikravesh"
    title: ClassVar[str] = "Lankarani-Nikravesh"
    source: ClassVar[str] = "thesis 3.22 with the alpha of e = 1 - alpha v (errata)"

    stiffness: float = field(metadata={"unit": "N/m^n", "meaning": "k: force at a penetration of 1 m"})
    restitution: float = field(metadata={"unit": "1", "meaning": "e that is wanted"})
    approach_speed: float = field(metadata={"unit": "m/s", "meaning": "v at which it is wanted"})
    exponent: float = field(default=1.5, metadata={"unit": "1", "meaning": "n: 1.5 for spheres"})

    def __post_init__(self) -> None:
        require_positive("the stiffness", self.stiffness, "N/m^n")
        require_restitution(self.restitution)
        require_positive("the approach speed", self.approach_speed, "m/s")
        require_exponent(self.exponent)

    @property
    def damping(self) -> float:
        """mu of 3.22 [N s/m^(n+1)]."""
        return lankarani_nikravesh_damping(self.restitution, self.approach_speed, self.stiffness)

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike) -> FloatArray:
        """Force [N] at a penetration [m] and its rate [m/s]."""
        return self._general.force(penetration, rate)

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """k delta^(n+1)/(n+1) [J]: the spring's."""
        return self._general.stored_energy(penetration)

    @property
    def _general(self) -> HuntCrossley:
        return HuntCrossley(self.stiffness, self.damping, self.exponent)

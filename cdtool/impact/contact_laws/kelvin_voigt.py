"""Kelvin and Voigt's contact: a linear spring in parallel with a damper."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.impact.checks import require_not_negative, require_positive
from cdtool.impact.contact_laws.base import pushing, spring_energy
from cdtool.impact.restitution import kelvin_voigt_restitution


@dataclass(frozen=True)
class KelvinVoigt:
    """F = k delta + d d(delta)/dt (thesis 3.17), but never a pull: as printed it ends in tension.

    Fails at first touch, where the force steps to d v; near the end, where the bodies part although the surface
    has not recovered; and in the restitution, which does not depend on the speed. It was devised for polymers.
    """

    name: ClassVar[str] = "kelvin_voigt"
    title: ClassVar[str] = "Kelvin-Voigt"
    source: ClassVar[str] = "thesis 3.17, without its tension (errata)"

    stiffness: float = field(metadata={"unit": "N/m", "meaning": "k of the spring"})
    damping: float = field(metadata={"unit": "N s/m", "meaning": "d of the damper"})

    def __post_init__(self) -> None:
        require_positive("the stiffness", self.stiffness, "N/m")
        require_not_negative("the damping", self.damping, "N s/m")

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike) -> FloatArray:
        """Force [N] at a penetration [m] and its rate [m/s]."""
        return pushing(self.stiffness * np.asarray(penetration) + self.damping * np.asarray(rate), penetration)

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """k delta^2/2 [J]: the spring's."""
        return spring_energy(self.stiffness, 1.0, penetration)

    def damping_ratio(self, mass: float) -> float:
        """zeta = d/(2 sqrt(k m)) with an effective mass [kg]."""
        require_positive("the mass", mass, "kg")
        return self.damping / (2.0 * math.sqrt(self.stiffness * mass))

    def restitution(self, mass: float) -> float:
        """e of an effective mass [kg], the same at every speed."""
        return float(kelvin_voigt_restitution(self.damping_ratio(mass)))

"""Hunt and Crossley's contact: Hertz's spring, with damping that grows with the penetration."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.impact.checks import require_exponent, require_not_negative, require_positive
from cdtool.impact.contact_laws.base import pushing, spring_energy, spring_force
from cdtool.impact.restitution import hunt_crossley_restitution


@dataclass(frozen=True)
class HuntCrossley:
    """F = k delta^n + mu delta^n d(delta)/dt (thesis 3.19 with 3.20; 4.9), never a pull.

    `damping_for_restitution` gives mu for a wanted e, exactly. The clamp acts only where something draws the bodies
    apart faster than k/mu.

    Fails where a body keeps a dent, or rings on (`cdtool.impact.waves`); e falls with the speed in one fixed way, see
    `hunt_crossley_restitution`.
    """

    name: ClassVar[str] = "hunt_crossley"
    title: ClassVar[str] = "Hunt-Crossley"
    source: ClassVar[str] = "thesis 3.19, 3.20, 4.9"

    stiffness: float = field(metadata={"unit": "N/m^n", "meaning": "k: force at a penetration of 1 m"})
    damping: float = field(metadata={"unit": "N s/m^(n+1)", "meaning": "mu: hysteresis damping factor"})
    exponent: float = field(default=1.5, metadata={"unit": "1", "meaning": "n: 1.5 for spheres"})

    def __post_init__(self) -> None:
        require_positive("the stiffness", self.stiffness, "N/m^n")
        require_not_negative("the damping", self.damping, "N s/m^(n+1)")
        require_exponent(self.exponent)

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike) -> FloatArray:
        """Force [N] at a penetration [m] and its rate [m/s]."""
        spring = spring_force(self.stiffness, self.exponent, penetration)
        return pushing(spring * (1.0 + self.damping / self.stiffness * np.asarray(rate)), penetration)

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """k delta^(n+1)/(n+1) [J]: the spring's."""
        return spring_energy(self.stiffness, self.exponent, penetration)

    def restitution(self, approach_speed: float) -> float:
        """e at an approach speed [m/s], whatever the mass and n."""
        return float(hunt_crossley_restitution(self.damping / self.stiffness * approach_speed))

    def greatest_penetration(self, mass: float, approach_speed: float) -> float:
        """delta_c = [(n+1) (m/k) (v/lam - ln(1 + lam v)/lam^2)]^(1/(n+1)), lam = mu/k [m]; 3.19 integrated once.

        Of an effective mass [kg] at a speed [m/s].
        """
        require_positive("the mass", mass, "kg")
        require_positive("the approach speed", approach_speed, "m/s")
        x = self.damping / self.stiffness * approach_speed
        # (x - ln(1 + x))/x^2 loses its digits for a small x, where its series has them.
        loss = 0.5 - x / 3.0 + x * x / 4.0 if x < 1e-5 else (x - math.log1p(x)) / x**2
        n = self.exponent + 1.0
        return float((n * mass * approach_speed**2 * loss / self.stiffness) ** (1.0 / n))

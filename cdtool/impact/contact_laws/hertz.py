"""Hertz's contact, and with a permanent indentation."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_exponent, require_not_negative, require_positive
from cdtool.impact.contact_laws.base import spring_energy, spring_force


@dataclass(frozen=True)
class Hertz:
    """F = k delta^n (thesis 3.13); back from delta_c F_max [(delta - delta_p)/(delta_c - delta_p)]^n (3.16 corrected).

    The printed 3.16 has the exponent 2; only with n is the dent delta_p the only loss, e^2 = 1 - delta_p/delta_c.
    `deepest` is delta_c so far, the law's memory: below it the force follows the unloading, above it the first loading.
    Unloading from less than delta_p has no force at all: e = 0.

    Fails where the material yields over more than a small dent, where bodies fit one another (a shaft in a bearing),
    and if the impact is so short that waves carry energy away (`cdtool.impact.waves`). Without delta_p no energy is
    lost.
    """

    name: ClassVar[str] = "hertz"
    title: ClassVar[str] = "Hertz"
    source: ClassVar[str] = "thesis 3.13 to 3.16; 3.16 with the exponent of the loading (errata)"

    stiffness: float = field(metadata={"unit": "N/m^n", "meaning": "k: force at a penetration of 1 m"})
    exponent: float = field(default=1.5, metadata={"unit": "1", "meaning": "n: 1.5 for spheres"})
    permanent_indentation: float = field(default=0.0, metadata={"unit": "m", "meaning": "delta_p: dent that is left"})
    deepest: float = field(default=0.0, metadata={"unit": "m", "meaning": "delta_c: greatest penetration so far"})

    def __post_init__(self) -> None:
        require_positive("the stiffness", self.stiffness, "N/m^n")
        require_exponent(self.exponent)
        require_not_negative("the permanent indentation", self.permanent_indentation, "m")
        require_not_negative("the greatest penetration so far", self.deepest, "m")

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike = 0.0) -> FloatArray:  # noqa: ARG002 - a law without damping
        """Force [N] at a penetration [m]; the rate changes nothing."""
        first = spring_force(self.stiffness, self.exponent, penetration)
        if not self.permanent_indentation:
            return first
        return np.where(np.less(penetration, self.deepest), self._way_back(penetration, 0.0), first)[()]

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """Return the energy recovered by unloading from a penetration [m] [J]."""
        if not self.permanent_indentation:
            return spring_energy(self.stiffness, self.exponent, penetration)
        depth = np.asarray(penetration)
        left = np.maximum(depth - self.permanent_indentation, 0.0) / (self.exponent + 1.0)
        first = spring_force(self.stiffness, self.exponent, depth) * left
        return np.where(depth < self.deepest, self._way_back(depth, 1.0), first)[()]

    @property
    def surface(self) -> float:
        """Depth of the dent so far [m]: no force up to it."""
        return min(self.permanent_indentation, self.deepest)

    def pressed_to(self, penetration: float) -> Self:
        """The law after a penetration [m]; a smaller one than before changes nothing."""
        return replace(self, deepest=max(self.deepest, penetration))

    def restitution(self, mass: float, approach_speed: float) -> float:
        """e = sqrt(1 - delta_p/delta_c) of a first impact: effective mass [kg], speed [m/s]; 0 below delta_p."""
        return math.sqrt(max(1.0 - self.permanent_indentation / self.greatest_penetration(mass, approach_speed), 0.0))

    def greatest_penetration(self, mass: float, approach_speed: float) -> float:
        """delta_c = [(n + 1) m v^2/(2 k)]^(1/(n+1)) [m] of a first impact, from the energy."""
        require_positive("the mass", mass, "kg")
        require_positive("the approach speed", approach_speed, "m/s")
        n = self.exponent + 1.0
        return float((n * mass * approach_speed**2 / (2.0 * self.stiffness)) ** (1.0 / n))

    def contact_duration(self, mass: float, approach_speed: float) -> float:
        """T = 2 delta_c/v times the integral of (1 - u^(n+1))^(-1/2) over 0..1 [s]: 2.943 delta_c/v for n = 1.5.

        Of a first impact without permanent indentation, whose unloading takes as long as the loading.
        """
        n = self.exponent + 1.0
        shape = 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + 1.0 / n) / math.gamma(0.5 + 1.0 / n)
        return shape * self.greatest_penetration(mass, approach_speed) / approach_speed

    def _way_back(self, penetration: npt.ArrayLike, integrals: float) -> FloatArray:
        """3.16 for `integrals` = 0 [N], its integral from delta_p on for 1 [J]."""
        length = self.deepest - self.permanent_indentation
        if length <= 0.0:
            return np.zeros_like(np.asarray(penetration, dtype=np.float64))
        share = np.clip((np.asarray(penetration) - self.permanent_indentation) / length, 0.0, None)
        scale = (length / (self.exponent + 1.0)) ** integrals
        return np.asarray(self.stiffness * self.deepest**self.exponent * scale * share ** (self.exponent + integrals))


def hertz_stiffness(
    *, radius_1: float, radius_2: float, young_1: float, poisson_1: float, young_2: float, poisson_2: float
) -> float:
    """k of two spheres (thesis 3.14, 3.15) [N/m^1.5]: 4/(3 (s_1 + s_2)) sqrt(R), s = (1 - nu^2)/E, 1/R = 1/R_1 + 1/R_2.

    Radii in m, `math.inf` for a plane; Young's moduli in Pa. Raises UsageError for two planes, whose contact has no k,
    for radii and moduli that are not positive and for Poisson's ratios outside -1 .. 0.5.
    """
    for number, (radius, young, poisson) in enumerate(
        ((radius_1, young_1, poisson_1), (radius_2, young_2, poisson_2)), start=1
    ):
        if not radius > 0.0:
            raise UsageError(f"radius {number} is {radius:g} m", "a number above 0, or infinity for a plane")
        require_positive(f"Young's modulus {number}", young, "Pa")
        if not -1.0 < poisson <= 0.5:
            raise UsageError(f"Poisson's ratio {number} is {poisson:g}", "it lies between -1 and 0.5")
    curvature = 1.0 / radius_1 + 1.0 / radius_2
    if curvature == 0.0:
        raise UsageError("both radii are infinite", "Hertz's contact needs one curved body")
    compliance = (1.0 - poisson_1**2) / young_1 + (1.0 - poisson_2**2) / young_2
    return 4.0 / (3.0 * compliance * math.sqrt(curvature))

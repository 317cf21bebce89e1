"""Elastic waves: is an impact long enough for the bodies to count as rigid? (thesis 3.1.4)

The thesis names the parameter, duration of the contact over period of the first natural mode, and says that waves take
less energy the larger it is. It has no number. The one here is that of a mode excited by half a sine of force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_positive

# With this ratio and above, a mode keeps at most 4.1 % of its energy at the force's peak.
QUASI_STATIC_FROM = 5.0
# Natural periods of a rod in travel times of a wave along it, by how its ends are held.
_TRAVELS = {"free": 2.0, "one fixed": 4.0}


@dataclass(frozen=True)
class WaveCheck:
    """`ratio` of the contact's duration to the first natural period; `warning` is empty where it is long enough."""

    ratio: float
    warning: str

    @property
    def quasi_static(self) -> bool:
        """Whether the bodies count as rigid except for the contact."""
        return not self.warning

    @property
    def words(self) -> str:
        """One sentence for a report."""
        return self.warning or f"the load counts as rigid: the contact lasts {self.ratio:.2g} periods of its first mode"


def check_waves(contact_duration: float, first_frequency: float) -> WaveCheck:
    """Compare a contact's duration [s] with the first natural frequency [Hz] of a body (thesis 3.1.4).

    Of two bodies the one with the lower frequency decides. Raises UsageError for numbers that are not positive.
    """
    require_positive("the contact's duration", contact_duration, "s")
    require_positive("the first natural frequency", first_frequency, "Hz")
    ratio = contact_duration * first_frequency
    if ratio >= QUASI_STATIC_FROM:
        return WaveCheck(ratio, "")
    lasts = f"the contact lasts {ratio:.2g} periods of the body's first natural mode"
    if ratio < 1.0:
        rest = "it is over before the body has responded as a whole, so the contact law does not determine the rebound"
    else:
        share = 100.0 * float(vibration_share(ratio))
        rest = f"up to {share:.0f} % of the energy of this mode under the peak force remains as vibration"
    return WaveCheck(ratio, f"waves matter: {lasts}; {rest}")


def vibration_share(ratio: npt.ArrayLike) -> FloatArray:
    """Energy of a mode after half a sine of force, at most, over its energy under the peak force: (4 q/(4 q^2 - 1))^2.

    q is the ratio of the contact's duration to the mode's period; the envelope of the exact answer, whose zeros no
    machine meets on purpose. Of use from q = 1 on; below, it is NaN: there the mode is not near its static shape.
    """
    q = np.asarray(ratio, dtype=np.float64)
    known = np.maximum(q, 1.0)
    return np.where(q >= 1.0, (4.0 * known / (4.0 * known**2 - 1.0)) ** 2, np.nan)[()]


def rod_first_frequency(length: float, young: float, density: float, ends: str = "free") -> float:
    """First longitudinal natural frequency [Hz] of a rod: c/(2 L) with free ends, c/(4 L) with one fixed.

    c = sqrt(E/rho): Young's modulus in Pa, density in kg/m3; length in m. Raises UsageError for other ends ("free",
    "one fixed"). A beam hit across its axis oscillates far slower: give `check_waves` its own frequency.
    """
    require_positive("the length", length, "m")
    require_positive("Young's modulus", young, "Pa")
    require_positive("the density", density, "kg/m3")
    if ends not in _TRAVELS:
        raise UsageError(f"a rod with ends '{ends}'", f"known: {', '.join(_TRAVELS)}")
    return math.sqrt(young / density) / (_TRAVELS[ends] * length)

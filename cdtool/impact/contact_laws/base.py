"""The contract of a contact law, and what several share.

Conventions: the penetration [m] grows while the bodies approach; its rate [m/s] is then positive (the thesis's
v = V2 - V1 is minus that). The force [N] pushes the bodies apart; it is never negative: a contact cannot pull.
"""

from __future__ import annotations

from typing import Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray


class ContactLaw(Protocol):
    """A law that returns the force of a contact; arrays of one shape in and out, a scalar for scalars."""

    def force(self, penetration: npt.ArrayLike, rate: npt.ArrayLike) -> FloatArray:
        """Force [N] at a penetration [m] and its rate [m/s]; 0 without contact, never negative."""
        ...


@runtime_checkable
class StoresEnergy(Protocol):
    """A law that defines how much of the work done on it is recoverable."""

    def stored_energy(self, penetration: npt.ArrayLike) -> FloatArray:
        """Elastic energy [J] at a penetration [m]."""
        ...


@runtime_checkable
class KeepsIndentation(Protocol):
    """A law with a memory of the greatest penetration so far; the memory is part of the value, the law stays frozen."""

    @property
    def surface(self) -> float:
        """Penetration [m] up to which there is no force."""
        ...

    def pressed_to(self, penetration: float) -> Self:
        """The law after the bodies were pressed that far [m] into one another."""
        ...


def spring_force(stiffness: float, exponent: float, penetration: npt.ArrayLike) -> FloatArray:
    """F = k delta^n (thesis 3.13) [N], 0 without contact."""
    return np.asarray(stiffness * np.maximum(penetration, 0.0) ** exponent)[()]


def spring_energy(stiffness: float, exponent: float, penetration: npt.ArrayLike) -> FloatArray:
    """Integral of 3.13: k delta^(n+1)/(n+1) [J]."""
    return np.asarray(stiffness * np.maximum(penetration, 0.0) ** (exponent + 1.0) / (exponent + 1.0))[()]


def pushing(force: npt.ArrayLike, penetration: npt.ArrayLike) -> FloatArray:
    """Return a force that a contact can exert: 0 without contact and instead of tension."""
    return np.where(np.less(penetration, 0.0), 0.0, np.maximum(force, 0.0))[()]

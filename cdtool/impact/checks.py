"""Checks of constants that a user gives."""

from __future__ import annotations

import math

from cdtool.base.errors import UsageError


def require_positive(name: str, value: float, unit: str = "") -> None:
    """Raise UsageError unless 0 < value < infinity."""
    if not 0.0 < value < math.inf:
        raise UsageError(f"{name} is {_written(value, unit)}", "a finite number above 0 is needed")


def require_not_negative(name: str, value: float, unit: str = "") -> None:
    """Raise UsageError unless 0 <= value < infinity."""
    if not 0.0 <= value < math.inf:
        raise UsageError(f"{name} is {_written(value, unit)}", "0 or a finite number above it is needed")


def require_exponent(value: float) -> None:
    """Raise UsageError unless the exponent is 1 or more: below 1 the initial stiffness would be infinite."""
    if not 1.0 <= value < math.inf:
        raise UsageError(f"the exponent is {value:g}", "1 for a linear spring, 1.5 for Hertz's spheres")


def require_restitution(value: float) -> None:
    """Raise UsageError unless 0 <= value <= 1."""
    if not 0.0 <= value <= 1.0:
        raise UsageError(f"the restitution is {value:g}", "it lies between 0 (plastic) and 1 (elastic)")


def _written(value: float, unit: str) -> str:
    return f"{value:g} {unit}".rstrip()

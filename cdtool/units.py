"""Conversion of units to SI. An unknown unit is an error that lists the known ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdtool.errors import ConfigurationError, nearest


@dataclass(frozen=True)
class Unit:
    """A unit's dimension, named by its SI unit, and the factor to that unit."""

    si: str
    factor: float


# SI units of raw drive values: a scale converts them to a channel's own unit (N m per A, for example).
RAW_UNITS = ("A", "V", "1", "count")

_STANDARD_GRAVITY = 9.80665
_TURN = 2.0 * math.pi
_INCH, _POUND_FORCE = 0.0254, 0.45359237 * _STANDARD_GRAVITY

UNITS: dict[str, Unit] = {
    # time
    "s": Unit("s", 1.0),
    "ms": Unit("s", 1e-3),
    "us": Unit("s", 1e-6),
    "ns": Unit("s", 1e-9),
    "min": Unit("s", 60.0),
    # angle, angular speed, angular acceleration
    "rad": Unit("rad", 1.0),
    "mrad": Unit("rad", 1e-3),
    "deg": Unit("rad", math.radians(1.0)),
    "rev": Unit("rad", _TURN),
    "rad/s": Unit("rad/s", 1.0),
    "deg/s": Unit("rad/s", math.radians(1.0)),
    "rev/s": Unit("rad/s", _TURN),
    "rpm": Unit("rad/s", _TURN / 60.0),
    "rad/s2": Unit("rad/s2", 1.0),
    "deg/s2": Unit("rad/s2", math.radians(1.0)),
    # length, speed, acceleration
    "m": Unit("m", 1.0),
    "cm": Unit("m", 1e-2),
    "mm": Unit("m", 1e-3),
    "um": Unit("m", 1e-6),
    "m/s": Unit("m/s", 1.0),
    "mm/s": Unit("m/s", 1e-3),
    "m/min": Unit("m/s", 1.0 / 60.0),
    "mm/min": Unit("m/s", 1e-3 / 60.0),
    "m/s2": Unit("m/s2", 1.0),
    "mm/s2": Unit("m/s2", 1e-3),
    "g": Unit("m/s2", _STANDARD_GRAVITY),
    "mg": Unit("m/s2", _STANDARD_GRAVITY * 1e-3),
    # force, torque
    "N": Unit("N", 1.0),
    "kN": Unit("N", 1e3),
    "mN": Unit("N", 1e-3),
    "kgf": Unit("N", _STANDARD_GRAVITY),
    "N m": Unit("N m", 1.0),
    "mN m": Unit("N m", 1e-3),
    "kN m": Unit("N m", 1e3),
    # pressure
    "Pa": Unit("Pa", 1.0),
    "kPa": Unit("Pa", 1e3),
    "MPa": Unit("Pa", 1e6),
    "mbar": Unit("Pa", 1e2),
    "bar": Unit("Pa", 1e5),
    "N/cm2": Unit("Pa", 1e4),
    "N/mm2": Unit("Pa", 1e6),
    "psi": Unit("Pa", _POUND_FORCE / _INCH**2),
    # a channel of a robot with linear and rotary joints: rad or m, N m or N ... for each joint
    "SI": Unit("SI", 1.0),
    # raw drive values: RAW_UNITS
    "A": Unit("A", 1.0),
    "mA": Unit("A", 1e-3),
    "V": Unit("V", 1.0),
    "mV": Unit("V", 1e-3),
    "%": Unit("1", 1e-2),
    "1": Unit("1", 1.0),
    "count": Unit("count", 1.0),
}

_SPELLINGS = {
    "Nm": "N m",
    "N*m": "N m",
    "N·m": "N m",
    "mNm": "mN m",
    "kNm": "kN m",
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
    "mm/s^2": "mm/s2",
    "rad/s^2": "rad/s2",
    "rad/s²": "rad/s2",
    "deg/s^2": "deg/s2",
    "°": "deg",
    "°/s": "deg/s",
    "µs": "us",
    "μs": "us",
    "1/min": "rpm",
    "U/min": "rpm",
    "r/min": "rpm",
    "rev/min": "rpm",
    "tr/min": "rpm",
    "giri/min": "rpm",
    "RPM": "rpm",
    "min-1": "rpm",
    "min⁻¹": "rpm",
    "min^-1": "rpm",
    "rad/sec": "rad/s",
    "deg/sec": "deg/s",
    "mm/sec": "mm/s",
    "m/sec": "m/s",
    "m/s/s": "m/s2",
    "mm/s/s": "mm/s2",
    "sec": "s",
    "counts": "count",
    "inc": "count",
    "pulse": "count",
    "degree": "deg",
    "degrees": "deg",
    "radians": "rad",
    "°/s²": "deg/s2",
    "mm/s²": "mm/s2",
    "N.m": "N m",
    "N/cm^2": "N/cm2",
    "N/cm²": "N/cm2",
    "N/mm^2": "N/mm2",
    "N/mm²": "N/mm2",
    "N-m": "N m",
    "Arms": "A",
    "Amps": "A",
    "": "1",
}


def unit(name: str, where: str) -> Unit:
    """Return the unit of that name. Raises ConfigurationError, naming `where`, if it is unknown."""
    known = find_unit(name)
    if known is None:
        raise ConfigurationError(f"{where}: unknown unit '{name}'", nearest(name, UNITS))
    return known


def find_unit(name: str) -> Unit | None:
    """Return the unit of that name, or None."""
    text = name.strip()
    return UNITS.get(_SPELLINGS.get(text, text))

"""Conversion of units to SI. An unknown unit is an error that lists the known ones.

A unit is a product or quotient of the symbols and words of one table, each with an SI prefix: daN, kp, lbf in, kg/cm2,
Kilonewton, Umdrehungen pro Minute. A mass stands for its weight, as that is what a load cell measures.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache

from cdtool.base.errors import UsageError, nearest


@dataclass(frozen=True)
class Unit:
    """A unit's dimension, named by its SI unit, and the factor to that unit."""

    si: str
    factor: float


# SI units of raw drive values: a scale converts them to a channel's own unit (N m per A, for example).
RAW_UNITS = ("A", "V", "1", "count")

STANDARD_GRAVITY = 9.80665  # m/s2, by definition (CGPM 1901)
DAY_S = 86400.0  # s, without the leap seconds that no clock of a log counts
_INCH, _POUND = 0.0254, 0.45359237 * STANDARD_GRAVITY  # m and N, by definition (1959)
_PREFIXES = {"u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "da": 1e1, "h": 1e2, "k": 1e3, "M": 1e6}
# Each symbol with its factor, what it measures, its prefixes, and its words in English and German, without a plural.
_TABLE = (
    ("s", 1.0, "s", "m u", "second sekunde sec sek"),
    ("ns", 1e-9, "s", "", "nanosecond nanosekunde"),
    ("min", 60.0, "s", "", "minute"),
    ("h", 3600.0, "s", "", "hour stunde"),
    ("rad", 1.0, "rad", "m", "radian radiant"),
    ("deg", math.radians(1.0), "rad", "", "degree grad"),
    ("rev", 2.0 * math.pi, "rad", "", "revolution umdrehung umdr turn rotation"),
    ("m", 1.0, "m", "u m c d k", "meter metre"),
    ("in", _INCH, "m", "", "inch zoll"),
    ("ft", 12.0 * _INCH, "m", "", "foot feet fuss fuß"),
    ("g", STANDARD_GRAVITY, "m/s2", "m", ""),
    ("N", 1.0, "N", "u m c d da h k M", "newton"),
    ("gf", 1e-3 * STANDARD_GRAVITY, "N", "k", "pond"),
    ("kp", STANDARD_GRAVITY, "N", "", ""),
    ("kg", STANDARD_GRAVITY, "N", "", "kilogram kilogramm"),
    ("tf", 1e3 * STANDARD_GRAVITY, "N", "", "tonne"),
    ("kip", 1e3 * _POUND, "N", "", "kip"),
    ("lbf", _POUND, "N", "k", "lb lbm pound"),
    ("ozf", _POUND / 16.0, "N", "", "oz ounce unze"),
    ("Pa", 1.0, "Pa", "h k M", "pascal"),
    ("bar", 1e5, "Pa", "m", ""),
    ("psi", _POUND / _INCH**2, "Pa", "", ""),
    ("A", 1.0, "A", "u m", "ampere amp arms"),
    ("V", 1.0, "V", "u m", "volt"),
    ("%", 1e-2, "1", "", "percent prozent"),
    ("count", 1.0, "count", "", "count inc pulse"),
)
_PREFIX_WORDS = {
    "kilo": "k", "mega": "M", "milli": "m", "micro": "u", "mikro": "u", "centi": "c", "zenti": "c", "deci": "d",
    "dezi": "d", "deca": "da", "deka": "da", "hecto": "h", "hekto": "h", "k": "k", "da": "da",
}  # fmt: skip
# Signs that are written differently, and the word before an area.
_SIGNS = str.maketrans({**dict(zip("²¹⁻−·⋅*µμ", "21--   uu", strict=True)), "^": "", "°": "deg"})
_TOKEN = re.compile(r"^(.+?)(-?[12])?$")
_AREA = re.compile(r"(?:square |quadrat)(\w+)|(\w+) squared", re.IGNORECASE)
_TURNS_PER_MINUTE = ("rpm", "upm", "1/min", "min-1", "u/min", "r/min", "tr/min", "giri/min")
_SYMBOLS = {
    prefix + symbol: Unit(si, factor * _PREFIXES.get(prefix, 1.0))
    for symbol, factor, si, prefixes, _ in _TABLE
    for prefix in ("", *prefixes.split())
}
_WORDS = {word: symbol for symbol, *_, words in _TABLE for word in words.split()}
_WORD = re.compile(
    rf"({'|'.join(_PREFIX_WORDS)})?({'|'.join(sorted(_WORDS, key=len, reverse=True))})(?:s|n|en|es)?(?:force|kraft)?"
)
# Powers of the units that a unit with a name of its own is made of.
_DIMENSIONS = {si: {si: 1} for si in ("s", "rad", "m", "N", *RAW_UNITS)} | {
    "N m": {"N": 1, "m": 1}, "Pa": {"N": 1, "m": -2}, "m/s": {"m": 1, "s": -1}, "m/s2": {"m": 1, "s": -2},
    "rad/s": {"rad": 1, "s": -1}, "rad/s2": {"rad": 1, "s": -2},
}  # fmt: skip


def unit(name: str) -> Unit:
    """Return the unit of that name. Raises UsageError if it is unknown."""
    known = find_unit(name)
    if known is None:
        raise UsageError(f"unknown unit '{name}'", nearest(name, UNITS))
    return known


@lru_cache(maxsize=1024)
def find_unit(name: str) -> Unit | None:
    """Return the unit of that name, or None.

    >>> find_unit("daN"), find_unit("Kilonewton"), find_unit("N*10")
    (Unit(si='N', factor=10.0), Unit(si='N', factor=1000.0), None)
    """
    text = _AREA.sub(r"\1\g<2>2", name.strip().translate(_SIGNS))
    if text in ("", "1", "SI"):
        return Unit(text or "1", 1.0)
    if text.lower() in _TURNS_PER_MINUTE:
        text = "rev/min"
    if text.lower().startswith("in ") and not re.search("lb|oz", text.lower()):  # `Kraft in daN`, but a torque `in lb`
        return find_unit(text[3:])
    factor, powers = 1.0, dict[str, int]()
    for number, part in enumerate(re.split(r"/| per | pro ", text)):
        for token in re.split(r"[ .]+|-(?!\d)", part.strip()):
            if powers and token.lower() in ("force", "kraft"):
                continue
            symbol, exponent = _TOKEN.findall(token or " ")[0]
            power = int(exponent or 1) * (-1 if number else 1)
            units = _units_of(symbol)
            for one in units:
                factor = factor * one.factor**power if power > 0 else factor / one.factor**-power
                for si, of in _DIMENSIONS[one.si].items():
                    powers[si] = powers.get(si, 0) + power * of
            if not units:
                return None
    left = {si: power for si, power in powers.items() if power}
    return next((Unit(si, factor) for si, of in _DIMENSIONS.items() if of == left), None)


def _units_of(symbol: str) -> tuple[Unit, ...]:
    """Return the unit of a symbol or word, or the two of a torque that is written as one, `Nm`; empty if unknown."""
    if known := _unit_of(symbol):
        return (known,)
    for cut in range(1, len(symbol)):
        parts = tuple(part for part in (_unit_of(symbol[:cut]), _unit_of(symbol[cut:])) if part)
        kinds = [part.si for part in parts]
        if kinds == ["N", "m"] or (kinds == ["m", "N"] and cut > 1):
            return parts
    return ()


def _unit_of(symbol: str) -> Unit | None:
    """Return the unit of a symbol or word; of `KN`, whose case is wrong, the only one that it may be.

    The case of m and M is never wrong: these are prefixes a billion apart.
    """
    small = symbol.lower()
    if symbol in _SYMBOLS:
        return _SYMBOLS[symbol]
    if word := _WORD.fullmatch(small):
        known = _SYMBOLS[_WORDS[word[2]]]
        return Unit(known.si, known.factor * _PREFIXES[_PREFIX_WORDS[word[1]]]) if word[1] else known
    alike = [name for name in _SYMBOLS if name.lower() == small]
    is_read = len(alike) == 1 and len(symbol) > 1 and {symbol[0], alike[0][0]} != {"m", "M"}
    return _SYMBOLS[alike[0]] if is_read else None


# The units that the machine file's page lists, for the nearest one to an unknown name.
_LISTED = (
    "s, ms, us, ns, min, rad, mrad, deg, rev, rad/s, deg/s, rev/s, rpm, rad/s2, deg/s2, m, cm, mm, um, in, ft, m/s, "
    "mm/s, m/min, mm/min, km/h, in/s, ft/s, m/s2, mm/s2, g, mg, N, mN, daN, hN, kN, MN, kgf, kp, lbf, ozf, N m, mN m, "
    "daN m, kN m, kgf m, kp m, lbf ft, lbf in, ozf in, Pa, hPa, kPa, MPa, mbar, bar, N/cm2, N/mm2, daN/cm2, kgf/cm2, "
    "psi, SI, A, mA, V, mV, %, 1, count"
)
UNITS = {name: unit(name) for name in _LISTED.split(", ")}

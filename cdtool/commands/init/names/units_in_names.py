"""Units in names: `LogTime_ms`, `velocity_mps`, `motor_torque_nm`, `rpm`; and names without their units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from cdtool.commands.init.names.words import motion_of, says, word_for, words
from cdtool.formats.column_names import split_unit
from cdtool.recordings.recording import CONTACT_PRESSURE, MEASURED
from cdtool.recordings.units import find_unit

if TYPE_CHECKING:
    from cdtool.commands.init.stream import Stream

_QUANTITIES = (*MEASURED, "force")
# Possible logged units of a quantity on any machine: SI units, and those that a scale converts.
_MEASURES: Mapping[str, tuple[str, ...]] = {
    "time": ("s",),
    "position": ("rad", "m", "count", "1", "V"),
    "speed": ("rad/s", "m/s", "count", "1", "V"),
    "acceleration": ("m/s2", "rad/s2", "count", "1", "V"),
    "torque": ("N m", "N", "A", "count", "1", "V"),
    "force": ("N", "count", "1", "V"),
    CONTACT_PRESSURE: ("Pa",),
}
# Endings of names in lower case; a single letter counts only in the first form, `F_N`, where the case matters.
_CAPITALS = {"N": "N", "A": "A", "V": "V"}
_TAILS = {
    "s": "s", "ms": "ms", "us": "us", "ns": "ns", "min": "min", "sec": "s",
    "rad": "rad", "mrad": "mrad", "deg": "deg", "rev": "rev", "mm": "mm", "cm": "cm", "um": "um", "m": "m",
    "rpm": "rpm", "mps": "m/s", "mmps": "mm/s", "rads": "rad/s", "radps": "rad/s", "degs": "deg/s", "degps": "deg/s",
    "rad_s": "rad/s", "deg_s": "deg/s", "m_s": "m/s", "mm_s": "mm/s", "m_min": "m/min", "u_min": "rpm", "1_min": "rpm",
    "m_s2": "m/s2", "rad_s2": "rad/s2", "mps2": "m/s2", "g": "g", "mg": "mg",
    "n": "N", "kn": "kN", "mn": "mN", "nm": "N m", "mnm": "mN m", "knm": "kN m", "n_m": "N m", "kg": "kgf",
    "kgf": "kgf", "a": "A", "ma": "mA", "v": "V", "mv": "mV", "percent": "%", "prozent": "%", "pct": "%",
    "counts": "count", "tr_min": "rpm", "giri_min": "rpm", "rev_min": "rpm", "r_min": "rpm", "rev_s": "rev/s",
    "rad_sec": "rad/s", "deg_sec": "deg/s", "mm_min": "mm/min", "count": "count", "cnt": "count",
    "cnts": "count", "inc": "count", "ticks": "count",
    "meters": "m", "metres": "m", "meters_per_sec": "m/s", "meters_per_second": "m/s",
    "millimeters": "mm", "radians": "rad", "radians_per_sec": "rad/s", "radians_per_second": "rad/s",
    "rad_per_sec": "rad/s", "degrees": "deg", "degrees_per_sec": "deg/s", "degrees_per_second": "deg/s",
    "deg_per_sec": "deg/s", "rotations": "rev", "rotations_per_sec": "rev/s", "amps": "A", "amperes": "A", "volts": "V",
    "newtons": "N", "newton_meters": "N m", "seconds": "s", "milliseconds": "ms", "microseconds": "us",
    "nanoseconds": "ns", "n_cm2": "N/cm2", "n_mm2": "N/mm2", "ncm2": "N/cm2", "nmm2": "N/mm2",
    "kpa": "kPa", "mpa": "MPa",
}  # fmt: skip
# A unit that begins with a capital letter, without a separator, is written out: it has at least this many letters.
_CAMEL, _WRITTEN_OUT = re.compile(r"(?<=[a-z])(?=[A-Z])"), 4
_SEPARATOR = re.compile(r"[\W_]+")
_INSIDE = re.compile(r"\s[\[(]([^\[\]()]{2,})[\])](?=\s)")
# Units of other quantities: temperature, power, frequency, pressure, resistance, energy.
_FOREIGN = frozenset(
    ("°c", "degc", "celsius", "℃", "k", "°f", "w", "kw", "va", "hz", "khz", "bar", "mbar", "pa", "kpa", "mpa", "ohm",
     "kohm", "j", "kj", "wh", "vdc", "vac")
)  # fmt: skip
# The letters of an index: `position.A#`.
_INDEX_LETTERS = re.compile(r"(?<=.)[\W_]+[A-Za-z]{1,2}#")
_SURE = 2.0  # a word of more than one letter
_OF_UNIT: Mapping[str, str] = {
    "rad": "position", "m": "position", "rad/s": "speed", "m/s": "speed", "rad/s2": "acceleration",
    "m/s2": "acceleration", "N m": "torque", "A": "torque", "N": "force",
}  # fmt: skip


def own_name(stream: Stream) -> str:
    """Return the name of a column or field; a topic's name only if the field's is generic (`data`).

    The letters of an index are left out if the rest indicates a quantity: `position.A#` is no current.
    """
    if not stream.topic:
        name = split_unit(stream.name)[0] if stream.unit else stream.name
        shorter = _INDEX_LETTERS.sub("#", name)
        return shorter if any(word_for(quantity, shorter)[0] >= _SURE for quantity in _QUANTITIES) else name
    plain = stream.field.split("[")[0] == "data"
    return f"{stream.topic} {stream.field}" if plain else stream.field


def label(stream: Stream) -> str:
    """Return a stream's name without the unit at its end."""
    name = own_name(stream)
    rest, tail, unit = _split(name)
    if not rest or not unit:
        return name
    asked = [quantity for quantity in _QUANTITIES if word_for(quantity, rest)[0]] + ["time"] * bool(says("clock", rest))
    if any(unit_in_name(quantity, name) for quantity in asked) or (not asked and _stands_for_itself(rest, tail)):
        return rest
    return name


def unit_in_name(quantity: str, name: str) -> str:
    """Return the unit at the end of a name if it measures that quantity, else an empty text.

    Not every ending is a unit: `tau_m` is a motor's torque, `phi_m` its angle.
    """
    rest, _, unit = _split(name)
    if not unit or not _measures(quantity, unit):
        return ""
    if unit == "m" and (motion_of(rest) == "angle" or words(rest)[-1:] == ("q",)):
        return ""
    if unit == "N" and quantity == "torque" and not says("force_of_drive", rest):
        return ""
    if unit == "kgf" and quantity != "force":
        return ""
    return unit


def may_be(quantity: str, stream: Stream) -> bool:
    """Return False if the unit in the header, or an unambiguous one in the name, does not measure that quantity."""
    if stream.unit and find_unit(stream.unit):
        return _measures(quantity, stream.unit)
    if stream.unit and is_foreign(stream.unit):
        return False
    rest, tail, unit = _split(own_name(stream))
    return not unit or _measures(quantity, unit) or not _stands_for_itself(rest, tail)


def is_foreign(unit: str) -> bool:
    """Whether a unit measures nothing that a channel may be: a temperature, a power, a frequency, a pressure."""
    return unit.strip().lower() in _FOREIGN


def pressure_unit(stream: Stream) -> str:
    """Return the unit of pressure of a stream, from its header or its name; empty if it has none."""
    if stream.unit:
        return stream.unit if _measures(CONTACT_PRESSURE, stream.unit) else ""
    unit = _split(own_name(stream))[2]
    return unit if unit and _measures(CONTACT_PRESSURE, unit) else ""


def quantity_of_unit(stream: Stream) -> str:
    """Return the quantity that the unit in the header, or an unambiguous one in the name, measures; empty if none."""
    known = find_unit(stream.unit) if stream.unit else None
    if known is None and not stream.unit:
        rest, tail, unit = _split(own_name(stream))
        known = find_unit(unit) if unit and _stands_for_itself(rest, tail) else None
    return _OF_UNIT.get(known.si, "") if known is not None else ""


def _measures(quantity: str, unit: str) -> bool:
    known = find_unit(unit)
    return known is not None and known.si in _MEASURES[quantity]


def _split(name: str) -> tuple[str, str, str]:
    """Return (the name before the ending, the ending, its unit); empty texts without such an ending.

    A unit in brackets within the name counts as its ending: `Kraft [kN] gefiltert`.
    """
    if (inside := _INSIDE.search(name)) and find_unit(inside[1]):
        return name.replace(inside[0], ""), inside[0], inside[1]
    parts = [part for part in _SEPARATOR.split(name) if part]
    found = _tail(parts, 3) or _tail(parts, 2) or _after_slash(name) or _tail(parts, 1)
    return found or _written_out(name) or (name, "", "")


def _written_out(name: str) -> tuple[str, str, str] | None:
    """Return the split of a name in mixed case whose last words are a unit: `VelocityMetersPerSec`."""
    parts = [part for part in _SEPARATOR.split(_CAMEL.sub("_", name)) if part]
    tails = (_tail(parts, count) for count in (3, 2, 1))
    return next((tail for tail in tails if tail and len(tail[1]) >= _WRITTEN_OUT), None)


def _tail(parts: list[str], count: int) -> tuple[str, str, str] | None:
    """Return the split of a name whose last parts are a unit: `_mm_s`, `_ms`; of forces and torques any: `_daN`."""
    tail = "_".join(parts[-count:])
    unit = _CAPITALS.get(tail) or _TAILS.get(tail.lower(), "")
    if not unit and len(tail) > 1 and (known := find_unit(tail)) and known.si in ("N", "N m"):
        unit = tail
    if unit and (len(parts) > count or tail.lower() == "rpm"):
        return "_".join(parts[:-count]), tail, unit
    return None


def _after_slash(name: str) -> tuple[str, str, str] | None:
    """Return the split of a name whose unit is after a slash: `Kraft F / N`; not of the path of a topic."""
    for slash in [] if name.startswith("/") else re.finditer("/", name):
        rest, unit = name[: slash.start()].strip(), name[slash.end() :].strip()
        is_unit = unit.lower() in _FOREIGN or (find_unit(unit) is not None and not rest[-1:].isdigit())
        if rest and unit and is_unit:
            return rest, f"/{unit}", unit
    return None


def _stands_for_itself(rest: str, tail: str) -> bool:
    """Whether an ending is a unit after any name: `_mm`, `pulses_N`; not `MOTOR_N`, `tau_m`."""
    if tail.startswith("/"):
        return True
    return len(tail) > 1 if tail not in _CAPITALS else rest != rest.upper()


def factor_of(unit: str) -> float:
    """Return the factor of a unit to SI; 1 for one that is not known."""
    known = find_unit(unit)
    return known.factor if known is not None else 1.0


def si_of(unit: str) -> str:
    """Return the SI unit of a unit's dimension; empty for one that is not known."""
    known = find_unit(unit) if unit else None
    return known.si if known is not None else ""

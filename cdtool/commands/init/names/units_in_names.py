"""Units in names: `LogTime_ms`, `velocity_mps`, `motor_torque_nm`, `rpm`; and names without their units."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import TYPE_CHECKING

from cdtool.commands.init.names.words import BOUND, QUANTITIES, motion_of, says, word_for, words
from cdtool.formats.column_names import split_unit
from cdtool.recordings.recording import CONTACT_PRESSURE
from cdtool.recordings.units import find_unit

if TYPE_CHECKING:
    from cdtool.commands.init.stream import Stream

_TABLES = tomllib.loads(files(__package__).joinpath("units.toml").read_text(encoding="utf-8"))
_ENDING: Mapping[str, str] = _TABLES["ending"]
_CAPITAL: Mapping[str, str] = _TABLES["capital"]
# A unit that begins with a capital letter, without a separator, is written out: it has at least this many letters.
_CAMEL, _WRITTEN_OUT = re.compile(r"(?<=[a-z])(?=[A-Z])"), 4
_SEPARATOR = re.compile(r"[\W_]+")
_INSIDE = re.compile(r"\s[\[(]([^\[\]()]{2,})[\])](?=\s)")
# The letters of an index: `position.A#`.
_INDEX_LETTERS = re.compile(r"(?<=.)[\W_]+[A-Za-z]{1,2}#")


def own_name(stream: Stream) -> str:
    """Return the name of a column or field; a topic's name only if the field's is generic (`data`).

    The letters of an index are left out if the rest indicates a quantity: `position.A#` is no current.
    """
    if not stream.topic:
        name = split_unit(stream.name)[0] if stream.unit else stream.name
        shorter = _INDEX_LETTERS.sub("#", name)
        return shorter if any(word_for(quantity, shorter)[0] >= BOUND for quantity in QUANTITIES) else name
    plain = stream.field.split("[")[0] == "data"
    return f"{stream.topic} {stream.field}" if plain else stream.field


def label(stream: Stream) -> str:
    """Return a stream's name without the unit at its end."""
    name = own_name(stream)
    rest, tail, unit = _split(name)
    if not unit:
        return name
    asked = [quantity for quantity in QUANTITIES if word_for(quantity, rest)[0]] + ["time"] * bool(says("clock", rest))
    is_unit = any(unit_in_name(quantity, name) for quantity in asked) if asked else _stands_for_itself(rest, tail)
    return rest if is_unit else name


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
    return "" if unit == "kgf" and quantity != "force" else unit


def may_be(quantity: str, stream: Stream) -> bool:
    """Return False if the unit in the header, or an unambiguous one in the name, does not measure that quantity."""
    if stream.unit and (find_unit(stream.unit) or is_foreign(stream.unit)):
        return _measures(quantity, stream.unit)
    rest, tail, unit = _split(own_name(stream))
    return not unit or _measures(quantity, unit) or not _stands_for_itself(rest, tail)


def is_foreign(unit: str) -> bool:
    """Whether a unit measures nothing that a channel may be: a temperature, a power, a frequency, a pressure."""
    return unit.strip().lower() in _TABLES["foreign"]["units"]


def pressure_unit(stream: Stream) -> str:
    """Return the unit of pressure of a stream, from its header or its name; empty if it has none."""
    unit = stream.unit or _split(own_name(stream))[2]
    return unit if unit and _measures(CONTACT_PRESSURE, unit) else ""


def quantity_of_unit(stream: Stream) -> str:
    """Return the quantity that the unit in the header, or an unambiguous one in the name, measures; empty if none."""
    unit = stream.unit or ""
    if not unit:
        rest, tail, ending = _split(own_name(stream))
        unit = ending if ending and _stands_for_itself(rest, tail) else ""
    quantity: str = _TABLES["indicates"].get(si_of(unit), "")
    return quantity


def alike(unit: str) -> str:
    """Return a unit and the units it may be instead."""
    text: str = _TABLES["alike"].get(unit, unit)
    return text


def factor_of(unit: str) -> float:
    """Return the factor of a unit to SI; 1 for one that is not known."""
    known = find_unit(unit)
    return known.factor if known is not None else 1.0


def si_of(unit: str) -> str:
    """Return the SI unit of a unit's dimension; empty for one that is not known."""
    known = find_unit(unit) if unit else None
    return known.si if known is not None else ""


def _measures(quantity: str, unit: str) -> bool:
    return si_of(unit) in _TABLES["measures"][quantity]


def _split(name: str) -> tuple[str, str, str]:
    """Return (the name before the ending, the ending, its unit); the name and empty texts without such an ending.

    A unit in brackets within the name counts as its ending: `Kraft [kN] gefiltert`.
    """
    if (inside := _INSIDE.search(name)) and find_unit(inside[1]):
        return name.replace(inside[0], ""), inside[0], inside[1]
    parts, camel = ([part for part in _SEPARATOR.split(text) if part] for text in (name, _CAMEL.sub("_", name)))
    plain = _tail(parts, 3) or _tail(parts, 2) or _after_slash(name) or _tail(parts, 1)
    written = (_tail(camel, count) for count in (3, 2, 1))
    return plain or next((tail for tail in written if tail and len(tail[1]) >= _WRITTEN_OUT), (name, "", ""))


def _tail(parts: list[str], count: int) -> tuple[str, str, str] | None:
    """Return the split of a name whose last parts are a unit: `_mm_s`, `_ms`, `_rad_per_sec`, `_meters`, `_daN`."""
    tail = "_".join(parts[-count:])
    unit = _CAPITAL.get(tail) or _ENDING.get(tail.lower(), "")
    if not unit:
        text = "/".join(parts[-count:]) if count == 2 else " ".join(parts[-count:])
        text = text if count == 1 else text.lower()
        is_written = count > 1 or (len(tail) >= _WRITTEN_OUT and tail.lower().endswith("s"))
        unit = text if si_of(text) and (is_written or (len(tail) > 1 and si_of(text) in ("N", "N m"))) else ""
    if unit and (len(parts) > count or tail.lower() == "rpm"):
        return "_".join(parts[:-count]), tail, unit
    return None


def _after_slash(name: str) -> tuple[str, str, str] | None:
    """Return the split of a name whose unit is after a slash: `Kraft F / N`; not of the path of a topic."""
    for slash in [] if name.startswith("/") else re.finditer("/", name):
        rest, unit = name[: slash.start()].strip(), name[slash.end() :].strip()
        if rest and unit and (is_foreign(unit) or (find_unit(unit) is not None and not rest[-1:].isdigit())):
            return rest, f"/{unit}", unit
    return None


def _stands_for_itself(rest: str, tail: str) -> bool:
    """Whether an ending is a unit after any name: `_mm`, `pulses_N`; not `MOTOR_N`, `tau_m`."""
    if tail in _CAPITAL:
        return rest != rest.upper()
    return len(tail) > 1

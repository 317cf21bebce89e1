"""Classify words above the rows of a table (units, types, numbered names) and the columns by most of their cells."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cdtool.formats.csv.cells import kind
from cdtool.recordings.units import find_unit

# Units without a factor to SI in cdtool, and words for units.
_UNIT_WORDS = frozenset(
    (
        *("msec", "hz", "khz", "mhz", "°c", "degc", "k", "w", "kw", "l/min", "ohm", "-", "db", "lsb", "incr", "digit"),
        "digits",
    )
)
_TYPES = frozenset(
    (
        *("real", "lreal", "int", "dint", "lint", "sint", "uint", "udint", "usint", "bool", "byte", "word", "dword"),
        *("float", "double", "float32", "float64", "single", "string", "date", "boolean", "integer", "number"),
        *("numeric", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))),
    )
)


def column_kinds(rows: Sequence[Sequence[str]], width: int) -> str:
    """Return one letter per column, the kind of most of its cells: N, T, X, or M if all are missing."""
    counts = [Counter(kind(row[i]) for row in rows) for i in range(width)]
    return "".join(max("NTX", key=each.__getitem__) if {*each} - {"M"} else "M" for each in counts)


def are_numbered(cells: Sequence[str]) -> bool:
    """Return whether the cells are a word and then consecutive numbers from 0 or 1: `t,1,2,3`."""
    rest = list(cells[1:])
    if not cells or kind(cells[0]) not in "XM" or not rest or not all(cell.isdigit() for cell in rest):
        return False
    return [int(cell) for cell in rest] == list(range(int(rest[0]), int(rest[0]) + len(rest))) and int(rest[0]) < 2


def are_types(cells: Sequence[str]) -> bool:
    """Return whether the cells are data types, which PLCs write below the names: `REAL;INT`."""
    words = [cell.lower().strip("[]()") for cell in cells if cell]
    return bool(words) and all(word in _TYPES for word in words)


def is_unit(cell: str) -> bool:
    """Return whether a cell is a unit: a known unit, a word for one, or any text in brackets."""
    if cell[:1] in ("[", "(") and cell[-1:] in ("]", ")"):
        bare = cell[1:-1].strip()
        return kind(bare) == "X" or bare in ("", "1")
    return find_unit(cell) is not None or cell.lower() in _UNIT_WORDS

"""Commas that part cells, or are decimal marks of numbers without quotes: where that is open, a table is refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import kind
from cdtool.formats.csv.head import Head
from cdtool.formats.csv.lines import Line

_EXPONENT = r"[eE][+-]?[0-9]+"
_PADDED = re.compile(rf"0[0-9]+(?:{_EXPONENT})?|[0-9]+{_EXPONENT}")
_FRACTION = re.compile(rf"[0-9]+(?:{_EXPONENT})?")
# Before a decimal comma: digits, perhaps in groups. Behind a comma that parts thousands: the next group.
_WHOLE = re.compile(r"[+-]?(?:[0-9]+|[1-9][0-9]{0,2}(?:[.'\u00a0\u202f ][0-9]{3})+)")
_FIRST_GROUP, _GROUP = re.compile(r"[+-]?[1-9][0-9]{0,2}"), re.compile(r"[0-9]{3}(?:\.[0-9]*)?")

_HINT = (
    'pin decimal = "," and separator = "semicolon" in [csv] if it is one number, '
    'separator = "comma" if it is two cells; or save the table with semicolons'
)


def refuse_commas_that_may_be_decimal(
    path: Path, data: Sequence[tuple[Line, list[str]]], kinds: str, separator: str, named: bool
) -> None:
    """Without a header, `0,05` may be two cells or 0.05: what looks like a fraction cut off by its comma is refused.

    `named`: a comment above holds one word, perhaps the name of one column.
    """
    if separator != ",":
        return
    pairs = kinds == "NN" and _may_be_one(data)
    points = not pairs and any("." in cell for _, row in data for i, cell in enumerate(row) if kinds[i] == "N")
    wrong = next(
        ((line, row, i) for line, row in data for i in range(1, len(row)) if _is_fraction(data, kinds, row, i, points)),
        None,
    )
    if wrong is None and pairs and (named or (len(data) > 2 and not _is_counted(data))):
        wrong = (*data[0], 1)
    if wrong is not None:
        line, row, i = wrong
        raise RecordingError(
            f"{path}: line {line.number}: '{row[i - 1]},{row[i]}' is one number (decimal comma) or two cells",
            _HINT,
        )


def _is_fraction(data: Sequence[tuple[Line, list[str]]], kinds: str, row: Sequence[str], i: int, points: bool) -> bool:
    """Digits behind zeros, or with an exponent, after a number; three or six in each row after a time of day."""
    if kinds[i] != "N":
        return False
    if kinds[i - 1] == "N":
        if row[i].startswith("0") and _GROUP.fullmatch(row[i]) and _FIRST_GROUP.fullmatch(row[i - 1]):
            return True
        return not points and _PADDED.fullmatch(row[i]) is not None
    if kinds[i - 1] != "T" or ":" not in row[i - 1] or row is not data[0][1]:  # asked once: it is of all rows
        return False
    digits = {len(cells[i]) if cells[i].isdigit() else 0 for _, cells in data}
    return len(digits) == 1 and digits <= {3, 6, 9}


def _may_be_one(data: Sequence[tuple[Line, list[str]]]) -> bool:
    """True if each row of two cells may be one number: `1,5`, `-3,07e+00`, `1.234,5` or `1,234.5`."""
    decimals = all(_WHOLE.fullmatch(row[0]) and _FRACTION.fullmatch(row[1]) for _, row in data)
    return decimals or all(_FIRST_GROUP.fullmatch(row[0]) and _GROUP.fullmatch(row[1]) for _, row in data)


def _is_counted(data: Sequence[tuple[Line, list[str]]]) -> bool:
    """True if the first column goes up in equal steps, as a counter or a clock does, and the second changes."""
    first = [cells[0].replace(".", "") for _, cells in data]
    if not all(cell.isdigit() for cell in first) or len({cells[1] for _, cells in data}) == 1:
        return False
    steps = {int(b) - int(a) for a, b in pairwise(first)}
    return len(steps) == 1 and min(steps) > 0


def refuse_one_column_of_decimals(
    path: Path, rows: Sequence[tuple[Line, list[str]]], head: Head, data: Sequence[tuple[Line, list[str]]]
) -> None:
    """One name or number over lines such as `1,5`: one column with a decimal comma, or two without names."""
    above = [(line, cells) for line, cells in rows if line.number < head.first.number]
    if head.names is not None or not above or len(above[-1][1]) != 1:
        return
    word = above[-1][1][0]
    if kind(word) != "N" and not _may_be_one(data):
        return
    raise RecordingError(
        f"{path}: line {head.first.number} ({head.first.text[:40]!r}) is one number (decimal comma) or two cells; "
        f"line {above[-1][0].number} has one ({word[:40]!r})",
        _HINT,
    )

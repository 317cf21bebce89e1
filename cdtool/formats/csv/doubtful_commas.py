"""Commas that part cells, or are decimal marks of numbers without quotes: where that is open, a table is refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.csv.head import Head
from cdtool.formats.csv.lines import Line

_PADDED = re.compile(r"0[0-9]+")


def refuse_commas_that_may_be_decimal(
    path: Path, data: Sequence[tuple[Line, list[str]]], kinds: str, separator: str
) -> None:
    """Without a header, `0,05` may be two cells or 0.05: what looks like a fraction cut off by its comma is refused."""
    if separator != ",":
        return
    points = any("." in cell for _, row in data for i, cell in enumerate(row) if kinds[i] == "N")
    wrong = next(
        ((line, row, i) for line, row in data for i in range(1, len(row)) if _is_fraction(data, kinds, row, i, points)),
        None,
    )
    if wrong is None and not points and len(kinds) == 2 and kinds == "NN" and len(data) > 2 and not _is_counted(data):
        wrong = (*data[0], 1) if all(cell.lstrip("-").isdigit() for _, row in data for cell in row) else None
    if wrong is not None:
        line, row, i = wrong
        raise RecordingError(
            f"{path}: line {line.number}: '{row[i - 1]},{row[i]}' is one number (decimal comma) or two cells",
            'pin separator in [csv], and decimal = "," if it is one number',
        )


def _is_fraction(data: Sequence[tuple[Line, list[str]]], kinds: str, row: Sequence[str], i: int, points: bool) -> bool:
    """Digits behind zeros after a number; or three or six digits in each row after a time of day."""
    if kinds[i] != "N":
        return False
    if kinds[i - 1] == "N":
        return not points and _PADDED.fullmatch(row[i]) is not None
    if kinds[i - 1] != "T" or ":" not in row[i - 1] or row is not data[0][1]:  # asked once: it is of all rows
        return False
    digits = {len(cells[i]) if cells[i].isdigit() else 0 for _, cells in data}
    return len(digits) == 1 and digits <= {3, 6, 9}


def _is_counted(data: Sequence[tuple[Line, list[str]]]) -> bool:
    """True if the first column goes up in equal steps, as a counter or a clock does."""
    first = [cells[0] for _, cells in data]
    if not all(cell.isdigit() for cell in first):
        return False
    steps = {int(b) - int(a) for a, b in pairwise(first)}
    return len(steps) == 1 and min(steps) > 0


def refuse_one_column_of_decimals(
    path: Path, rows: Sequence[tuple[Line, list[str]]], head: Head, data: Sequence[tuple[Line, list[str]]]
) -> None:
    """One name over lines such as `1,5`: one column with a decimal comma, or two without names."""
    above = [(line, cells) for line, cells in rows if line.number < head.first.number]
    if head.names is not None or not above or len(above[-1][1]) != 1 or any("." in cell for _, r in data for cell in r):
        return
    raise RecordingError(
        f"{path}: line {head.first.number} ({head.first.text[:40]!r}) is one number (decimal comma) or two cells; "
        f"line {above[-1][0].number} has one name",
        "save the table with semicolons, or pin separator and header in [csv]",
    )

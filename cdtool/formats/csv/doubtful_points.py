"""Points that are decimal marks, or part thousands: a column of `998`, `999`, `1.000` may be read in two ways.

Where no number of the sample shows which, the rows behind it are looked through for the first that does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.lines import begins_comment
from cdtool.formats.csv.marks import Marks, find_marks
from cdtool.formats.csv.row_kernel import Integers
from cdtool.formats.csv.text import Bytes

_WHOLE = re.compile(r"[+-]?(?:0|[1-9][0-9]*)")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")
_MARKED = re.compile(r"[.,'][0-9]")
# So many numbers such as `1.234`, and none that is otherwise: no other is waited for.
_ENOUGH = 1000
_ROWS_HELD = 2000


def settled_marks(dialect: Dialect) -> Marks:
    """The marks by all rows of a table whose sample shows no decimal mark; raises RecordingError where two fit."""
    pins, path = dialect.pins, dialect.text.path
    seen: list[tuple[str, int]] = []
    points: dict[int, tuple[str, int]] = {}
    for text, line, column in _marked_cells(dialect):
        if _MARKED.search(text) is None:
            continue
        seen.append((text, line))
        if _GROUPED.fullmatch(text) is None or len(seen) == _ENOUGH:
            break  # this one decides, or no more are waited for
        points.setdefault(column, (text, line))
    marks = find_marks(path, seen, dialect.separator if dialect.width > 1 else "", pins.decimal, pins.thousands)
    if marks.sure or marks.decimal != ".":
        return marks
    for column, (text, line) in points.items():
        whole = next((cells[column] for cells in _first_rows(dialect) if _WHOLE.fullmatch(cells[column])), None)
        if whole is not None:
            raise RecordingError(
                f"{path}: line {line}, column '{dialect.names[column]}': '{text}' beside '{whole}' is "
                f"{text.replace('.', '')} (thousands) or {text} (decimal point)",
                'pin decimal = "," if it parts thousands, or decimal = ".", in [csv] of the machine file',
            )
    return marks


def _marked_cells(dialect: Dialect) -> Iterator[tuple[str, int, int]]:
    """Cells of columns of numbers with a mark between digits, their lines and columns, in the file's order."""
    line, end = dialect.first_line, dialect.text.line_end
    marks = b".'" if dialect.separator == "," else b".,'"
    for block, size in dialect.text.blocks(dialect.offset):
        counted = 0
        if any(block.find(letter, 0, size) >= 0 for letter in marks):
            for place in _numbers(np.frombuffer(block, np.uint8, size), marks, dialect.separator).tolist():
                if place < counted:  # of the same line
                    continue
                first, last = block.rfind(end, 0, place) + 1, block.find(end, place)
                line += block.count(end, counted, first)
                counted = last
                for column, cell in enumerate(_cells(dialect, bytes(block[first:last]))):
                    # A last line that is not ended may be cut off: `1.0` may have been `1.000`.
                    if dialect.kinds[column] in "NM" and (last < size or _GROUPED.fullmatch(cell)):
                        yield cell, line, column
        line += block.count(end, counted, size)


def _numbers(data: Bytes, marks: bytes, separator: str) -> Integers:
    """Where marks stand within what is a number from border to border: not in the seconds of a time, nor in a date."""
    borders = separator.encode() + b'" \t\r\n'
    other = np.flatnonzero((data < ord("0")) | (data > ord("9")))
    letters = data[other]
    mark = _is_one_of(marks)[letters]
    begun = np.append(True, _is_one_of(borders + b"+-")[letters][:-1])
    digits = np.diff(other, append=len(data)) - 1
    ended = np.append(_is_one_of(borders + b"eE")[letters][1:], True)
    parted = np.append(mark[1:], False) & (digits == 3)
    found: Integers = other[mark & begun & (digits > 0) & (ended | parted)]
    return found


def _is_one_of(letters: bytes) -> npt.NDArray[np.bool_]:
    """For each byte whether it is one of these."""
    table = np.zeros(256, dtype=bool)
    table[list(letters)] = True
    return table


def _cells(dialect: Dialect, raw: bytes) -> list[str]:
    """The cells of a row; none of any other line."""
    text = dialect.text.decode(raw)
    cells = [] if begins_comment(text, dialect.comment) else split_line(text, dialect.separator)
    return cells if len(cells) == dialect.width else []


def _first_rows(dialect: Dialect) -> Iterator[list[str]]:
    for block, size in dialect.text.blocks(dialect.offset):
        for raw in bytes(block[:size]).split(dialect.text.line_end, _ROWS_HELD)[:_ROWS_HELD]:
            if cells := _cells(dialect, raw):
                yield cells
        return

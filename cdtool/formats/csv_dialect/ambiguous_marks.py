"""Commas and points with two possible meanings: a table is refused if its rows do not decide between them.

A comma may separate cells, or be the decimal mark of a number without quotes. A point may be a decimal mark or a
thousands separator: `1.000` can be read in two ways. If no number of the sample decides, the rows after the sample are
searched for the first one that does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice

from cdtool.base.errors import RecordingError
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.lines import SplitLine, begins_comment
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.csv_dialect.marks import Marks, find_marks

# Before and after a comma that separates thousands.
_FIRST_GROUP, _GROUP = re.compile(r"[+-]?[1-9][0-9]{0,2}"), re.compile(r"[0-9]{3}(?:\.[0-9]*)?")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")
_MARKED = re.compile(r"[.,'][0-9]")


def refuse_commas_that_may_be_decimal(data: Sequence[SplitLine], kinds: str) -> None:
    """Raise RecordingError if rows without a header may have decimal commas: `0,05` may be two cells or 0.05.

    Only a number with a decimal point shows that commas are none.
    """
    columns = [i for i, letter in enumerate(kinds) if letter == "N"]
    points = any("." in row.cells[i] and not _GROUPED.fullmatch(row.cells[i]) for row in data for i in columns)
    for i in columns[1:] if kinds[0] == "N" else columns:
        row = _one_number(data, kinds, i, points)
        if row is not None:
            number = f"{row.cells[i - 1]},{row.cells[i]}"
            raise RecordingError(
                f"line {row.number}: '{number}' may be one number (decimal comma) or two cells",
                'pin decimal = "," and separator = "semicolon" in [csv] if it is one number, '
                'separator = "comma" if they are two cells; or save the table with semicolons',
            )


def _one_number(data: Sequence[SplitLine], kinds: str, i: int, points: bool) -> SplitLine | None:
    """Return the first row in which cell `i` may belong to the number before it; None if there is no such row.

    After a number: if no number has a decimal point, or for the next group of thousands. After a time of day: 3, 6 or 9
    digits in all rows.
    """
    if kinds[i - 1] == "N" and not points:
        return data[0]
    if kinds[i - 1] == "N":
        groups = [row for row in data if _FIRST_GROUP.fullmatch(row.cells[i - 1]) and _GROUP.fullmatch(row.cells[i])]
        certain = (row for row in groups if row.cells[i].startswith("0") or len(groups) == len(data))
        return next(certain, None)
    digits = {len(row.cells[i]) if row.cells[i].isdigit() else 0 for row in data}
    is_time = kinds[i - 1] == "T" and ":" in data[0].cells[i - 1]
    return data[0] if is_time and len(digits) == 1 and digits <= {3, 6, 9} else None


def resolve_marks(dialect: Dialect) -> Marks:
    """Return the marks by all rows of a table whose sample has no decimal mark.

    Raises RecordingError if the rows can be read in two ways.
    """
    numbers: list[tuple[str, int, int]] = []
    # After 1000 numbers such as `1.234` without any other, the search ends.
    for cell in islice(_marked_cells(dialect), 1000):
        numbers.append(cell)
        if _GROUPED.fullmatch(cell[0]) is None:
            break  # this number decides
    separator = dialect.separator if dialect.width > 1 else ""
    marks = find_marks(((text, line) for text, line, _ in numbers), separator)
    grouped = next((cell for cell in numbers if _GROUPED.fullmatch(cell[0])), None)
    if grouped is not None and not marks.sure:
        text, line, column = grouped
        raise RecordingError(
            f"line {line}, column '{dialect.names[column]}': '{text}' may be {text.replace('.', '')} (thousands) or "
            f"{text} (decimal point)",
            'pin decimal = "," if the point separates thousands, or decimal = ".", in [csv] of the machine file',
        )
    return marks


def _marked_cells(dialect: Dialect) -> Iterator[tuple[str, int, int]]:
    """Yield the cells of columns of numbers that have a mark, with line and column, in the file's order."""
    for line, cells, is_last in _rows(dialect, [mark for mark in (".", "'", ",") if mark != dialect.separator]):
        for column, cell in enumerate(cells):
            # A last line without a line end may be cut off: `1.0` may have been `1.000`.
            if dialect.kinds[column] in "NM" and _MARKED.search(cell) and (not is_last or _GROUPED.fullmatch(cell)):
                yield cell, line, column


def _rows(dialect: Dialect, marks: Sequence[str]) -> Iterator[tuple[int, list[str], bool]]:
    """Yield the rows of blocks with one of the marks: line, cells, and whether the block ends without a line end."""
    line = dialect.first_line
    for block in dialect.text.blocks(dialect.offset):
        lines = block.split(dialect.text.line_end)
        if any(mark.encode() in block for mark in marks):
            for i, raw in enumerate(lines):
                if cells := _cells(dialect, raw):
                    yield line + i, cells, i == len(lines) - 1
        line += len(lines) - 1


def _cells(dialect: Dialect, raw: bytes) -> list[str]:
    """Return the cells of a row; empty for any other line, such as one of a footer."""
    text = dialect.text.decode(raw)
    cells = [] if begins_comment(text, dialect.comment) else split_line(text, dialect.separator)
    if len(cells) != dialect.width or (dialect.kinds[0] in "NT" and kind(cells[0]) == "X"):
        return []
    return cells
